//! Weights of the rows, their residuals and derivatives.

use super::equation::{At, Equation};
use super::instruments::OF_ROBOT;
use super::observation::{LOWER, ObservationError, ObservationRow, READINGS, lower_rows};
use crate::Real;
use crate::robot::{Arm, ArmIndex, Robot, TRANSMISSION_NUMBERS};
use crate::samples::triangle::reduce;
use nalgebra::Vector3;

/// Rounding of a computed position, in ε times the robot's size.
const ROUNDING: f64 = 4.0;
/// Parameters of an arm.
const ARM: usize = 8;

/// A robot at one set of joint angles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pose<T: Real> {
    position: Vector3<T>,
    /// (∂f/∂X)⁻¹ by columns: the point moves by −cᵢ when the constraint of arm i grows by 1.
    columns: [Vector3<T>; 3],
}

impl<T: Real> Pose<T> {
    /// `None` if the robot has no such pose, or a singular one.
    pub(crate) fn new(robot: &Robot<T>, joints: &[T; 3]) -> Option<Self> {
        let position = robot.forward(joints).ok()?;
        let columns = robot.inverse_by_position(&position, joints).ok()?;
        Some(Self { position, columns })
    }

    const fn position(&self) -> &Vector3<T> {
        &self.position
    }

    /// The derivative of a reading by each arm's constraint.
    fn by_constraints(&self, by_position: &Vector3<T>) -> [T; 3] {
        self.columns.map(|column| -by_position.dot(&column))
    }
}

impl<T: Real> ObservationRow<T> {
    /// Excludes the row if the robot does not reach its joint angles.
    ///
    /// # Errors
    /// [`ObservationError::SamePlace`].
    pub(super) fn look_whether_reached(
        &mut self,
        robot: &Robot<T>,
    ) -> Result<(), ObservationError> {
        let poses = self.poses(robot);
        self.left_out = poses.is_none();
        if let Some((own, _)) = &poses {
            self.nominal = own.position;
        }
        if let Some((own, Some(other))) = poses {
            let apart = own.position - other.position;
            let least = T::EPSILON.square_root() * own.position.dot(&own.position).square_root();
            if !(apart.dot(&apart).square_root() > least) {
                return Err(ObservationError::SamePlace);
            }
        }
        Ok(())
    }

    /// Computes the weights of the readings.
    pub(super) fn take_weights(&mut self, at: &At<'_, T>) {
        let robot = at.robot;
        let Some((own, other)) = self.poses(robot) else {
            return;
        };
        let equations = self.equations(at, &own.position, other.as_ref().map(Pose::position));
        let sigma = at.instruments.noise.position().joint();
        let by_joints = |pose: &Pose<T>, joints: &[T; 3], direction: &Vector3<T>| {
            let mut parts = pose.by_constraints(direction);
            for ((part, arm), q) in parts.iter_mut().zip(robot.arms()).zip(joints) {
                *part *= arm.constraint_by_joint(&pose.position, *q) * sigma;
            }
            parts
        };
        let mut shares = [[T::ZERO; 6]; READINGS];
        for (share, equation) in shares.iter_mut().zip(&equations) {
            let Some(equation) = equation else { continue };
            let [a, b, c] = by_joints(&own, &self.observation.joints, &equation.by_position);
            let mut opposite = [T::ZERO; 3];
            if let (true, Some(other), Some(joints)) = (
                equation.between_poses,
                &other,
                self.observation.other_joints(),
            ) {
                opposite = by_joints(other, joints, &-equation.by_position);
            }
            let [d, e, f] = opposite;
            *share = [a, b, c, d, e, f];
        }
        let [first, ..] = robot.arms();
        let size = own.position.dot(&own.position) + first.lb().squared();
        let rounding = (T::from_f64(ROUNDING) * T::EPSILON).squared() * size;
        let mut covariance = [[T::ZERO; READINGS]; READINGS];
        for (index, ((row, share), equation)) in covariance
            .iter_mut()
            .zip(&shares)
            .zip(&equations)
            .enumerate()
        {
            for (entry, other) in row.iter_mut().zip(&shares) {
                *entry = product(share, other);
            }
            if let Some(diagonal) = row.get_mut(index) {
                *diagonal += match equation {
                    Some(equation) => equation.sigma.squared() + rounding,
                    None => T::ONE,
                };
            }
        }
        self.factor = cholesky(&covariance);
    }

    fn poses(&self, robot: &Robot<T>) -> Option<(Pose<T>, Option<Pose<T>>)> {
        let own = T::pose(robot, &self.observation.joints)?;
        let other = match self.observation.other_joints() {
            Some(joints) => Some(T::pose(robot, joints)?),
            None => None,
        };
        Some((own, other))
    }

    fn equations(
        &self,
        at: &At<'_, T>,
        own: &Vector3<T>,
        other: Option<&Vector3<T>>,
    ) -> [Option<Equation<T>>; READINGS] {
        T::equations(&self.observation, at, own, other)
    }

    /// Readings minus expected values, in σ. `None` if the robot does not reach the joint angles.
    pub(super) fn residuals(&self, at: &At<'_, T>) -> Option<[T; READINGS]> {
        if self.left_out {
            return Some([T::ZERO; READINGS]);
        }
        let own = at.robot.forward(&self.observation.joints).ok()?;
        let other = match self.observation.other_joints() {
            Some(joints) => Some(at.robot.forward(joints).ok()?),
            None => None,
        };
        let equations = self.equations(at, &own, other.as_ref());
        let mut residuals = equations.map(|equation| equation.map_or(T::ZERO, |own| own.residual));
        self.whiten(core::slice::from_mut(&mut residuals));
        Some(residuals)
    }

    /// The rows (∂r/∂p, r), by columns, M = N + 1. `None` if the robot has no such pose.
    pub(super) fn linearized<const N: usize, const M: usize>(
        &self,
        at: &At<'_, T>,
        units: &[T; N],
    ) -> Option<[[T; READINGS]; M]> {
        let mut columns = [[T::ZERO; READINGS]; M];
        (self.left_out || self.linearize(at, units, &mut columns)).then_some(columns)
    }

    /// Writes (∂r/∂p, r) into columns of zeros; `false` if the robot has no such pose.
    fn linearize(&self, at: &At<'_, T>, units: &[T], columns: &mut [[T; READINGS]]) -> bool {
        let observation = &self.observation;
        let Some((own, other)) = self.poses(at.robot) else {
            return false;
        };
        let equations = self.equations(at, &own.position, other.as_ref().map(Pose::position));
        for (reading, equation) in equations.iter().enumerate() {
            let Some(equation) = equation else { continue };
            let mut add = |pose: &Pose<T>, joints: &[T; 3], by_position: &Vector3<T>| {
                add_by_parameters(columns, reading, at.robot, pose, joints, by_position);
                if at.instruments.transmission.is_some() {
                    add_by_transmissions(columns, reading, at.robot, pose, joints, by_position);
                }
            };
            add(&own, &observation.joints, &equation.by_position);
            if let (true, Some(other), Some(joints)) =
                (equation.between_poses, &other, observation.other_joints())
            {
                add(other, joints, &-equation.by_position);
            }
            let from = columns.get_mut(equation.column..).unwrap_or_default();
            add_products(from, reading, T::ONE, &equation.by_unknowns);
            for (column, unit) in columns.iter_mut().zip(units) {
                if let Some(entry) = column.get_mut(reading) {
                    *entry *= -*unit;
                }
            }
            if let Some(entry) = columns.last_mut().and_then(|last| last.get_mut(reading)) {
                *entry = equation.residual;
            }
        }
        self.whiten(columns);
        true
    }

    /// Absorbs the rows (∂r/∂p, r) into a triangle by way of columns of zeros, and returns Σ r². `None` if the robot has
    /// no such pose.
    pub(crate) fn absorb(
        &self,
        at: &At<'_, T>,
        units: &[T],
        columns: &mut [[T; READINGS]],
        entries: &mut [T],
    ) -> Option<T> {
        if self.left_out {
            return Some(T::ZERO);
        }
        if !self.linearize(at, units, columns) {
            return None;
        }
        let residuals = columns.last().map_or(T::ZERO, |own| squared_length(own));
        let size = columns.len();
        // Rows of zeros change nothing but cost time.
        match self.read_alone(columns) {
            Some(few) => reduce(entries, size, few, size),
            None => reduce(entries, size, columns, size),
        }
        Some(residuals)
    }

    /// Compacts rows (in columns of five) with at most two readings to columns of two.
    fn read_alone<'a>(&self, columns: &'a mut [[T; READINGS]]) -> Option<&'a mut [[T; 2]]> {
        let (mut read, mut count) = ([READINGS; READINGS], 0);
        for reading in 0..READINGS {
            if let (true, Some(place)) = (self.observation.is_read(reading), read.get_mut(count)) {
                *place = reading;
                count += 1;
            }
        }
        let [first, second, READINGS, ..] = read else {
            return None;
        };
        let size = columns.len();
        for index in 0..size {
            let column = columns.get(index).copied().unwrap_or([T::ZERO; READINGS]);
            let at = |reading: usize| column.get(reading).copied().unwrap_or(T::ZERO);
            let two = [at(first), at(second)];
            if let Some(place) = columns.as_flattened_mut().as_chunks_mut().0.get_mut(index) {
                *place = two;
            }
        }
        columns.as_flattened_mut().as_chunks_mut().0.get_mut(..size)
    }

    /// L⁻¹ ∂h/∂X at the row's own pose and at the start of a distance. `None` if the robot has no such pose.
    pub(super) fn by_positions(&self, at: &At<'_, T>) -> Option<[[Vector3<T>; READINGS]; 2]> {
        let mut by_positions = [[Vector3::zeros(); READINGS]; 2];
        if self.left_out {
            return Some(by_positions);
        }
        let (own, other) = self.poses(at.robot)?;
        let equations = self.equations(at, &own.position, other.as_ref().map(Pose::position));
        let [by_own, by_other] = &mut by_positions;
        for axis in 0..3 {
            let component = |vector: &Vector3<T>| vector.get(axis).copied().unwrap_or(T::ZERO);
            let mut at_own = [T::ZERO; READINGS];
            let mut at_other = [T::ZERO; READINGS];
            for ((mine, theirs), equation) in at_own.iter_mut().zip(&mut at_other).zip(&equations) {
                let Some(equation) = equation else { continue };
                *mine = component(&equation.by_position);
                if equation.between_poses {
                    *theirs = -*mine;
                }
            }
            for (vectors, column) in [(&mut *by_own, at_own), (&mut *by_other, at_other)] {
                let mut column = column;
                self.whiten(core::slice::from_mut(&mut column));
                for (vector, value) in vectors.iter_mut().zip(column) {
                    if let Some(entry) = vector.get_mut(axis) {
                        *entry = value;
                    }
                }
            }
        }
        Some(by_positions)
    }

    /// L⁻¹ times columns of readings, times √ of the row's weight. Missing readings are 0.
    fn whiten(&self, columns: &mut [[T; READINGS]]) {
        for (index, row) in self.factor_rows().enumerate() {
            let Some((pivot, row)) = row.split_last().filter(|_| self.observation.is_read(index))
            else {
                continue;
            };
            for column in columns.iter_mut() {
                let Some((known, [entry, ..])) = column.split_at_mut_checked(index) else {
                    continue;
                };
                for (factor, known) in row.iter().zip(known) {
                    *entry -= *factor * *known;
                }
                *entry /= *pivot;
            }
        }
        if self.root_weight != T::ONE {
            for entry in columns.as_flattened_mut() {
                *entry *= self.root_weight;
            }
        }
    }

    /// Σ 1/Lₖₖ² times the squared size of the robot: the size of the terms from which the residuals are summed.
    pub(super) fn terms_squared(&self, robot: &Robot<T>) -> T {
        if self.left_out {
            return T::ZERO;
        }
        let [first, ..] = robot.arms();
        let mut sum = T::ZERO;
        for (index, row) in self.factor_rows().enumerate() {
            if let (true, Some(pivot)) = (self.observation.is_read(index), row.last()) {
                sum += T::ONE / pivot.squared();
            }
        }
        let nominal = &self.nominal;
        sum * self.root_weight.squared() * (nominal.dot(nominal) + first.lb().squared())
    }
}

/// Adds ∂h/∂P of a reading whose derivative by the pose's position is `by_position`.
#[inline(never)]
fn add_by_parameters<T: Real>(
    columns: &mut [[T; READINGS]],
    reading: usize,
    robot: &Robot<T>,
    pose: &Pose<T>,
    joints: &[T; 3],
    by_position: &Vector3<T>,
) {
    let parts = pose.by_constraints(by_position);
    let of_arm = |index: ArmIndex| -> &Arm<T> { robot.arm(index) };
    for (((own, part), q), index) in columns
        .chunks_exact_mut(ARM)
        .zip(parts)
        .zip(joints)
        .zip(ArmIndex::ALL)
    {
        let gradient = of_arm(index).constraint_by_parameters(&pose.position, *q);
        add_products(own, reading, part, gradient.as_slice());
    }
}

/// Adds the derivatives by the numbers of the transmissions, which follow the parameters.
#[inline(never)]
fn add_by_transmissions<T: Real>(
    columns: &mut [[T; READINGS]],
    reading: usize,
    robot: &Robot<T>,
    pose: &Pose<T>,
    joints: &[T; 3],
    by_position: &Vector3<T>,
) {
    let parts = pose.by_constraints(by_position);
    let numbers = columns.get_mut(OF_ROBOT..).unwrap_or_default();
    for (((own, part), q), arm) in numbers
        .chunks_exact_mut(TRANSMISSION_NUMBERS)
        .zip(parts)
        .zip(joints)
        .zip(robot.arms())
    {
        let gradient = arm.constraint_by_transmission(&pose.position, *q);
        add_products(own, reading, part, &gradient);
    }
}

/// Adds multiples of a reading's derivatives to its entries of the columns.
fn add_products<T: Real>(
    columns: &mut [[T; READINGS]],
    reading: usize,
    factor: T,
    derivatives: &[T],
) {
    for (column, derivative) in columns.iter_mut().zip(derivatives) {
        if let Some(entry) = column.get_mut(reading) {
            *entry += factor * *derivative;
        }
    }
}

pub(super) fn squared_length<T: Real>(residuals: &[T]) -> T {
    residuals
        .iter()
        .fold(T::ZERO, |sum, residual| sum + residual.squared())
}

fn product<T: Real>(one: &[T], other: &[T]) -> T {
    one.iter()
        .zip(other)
        .fold(T::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// L of L Lᵀ, each row up to its diagonal, which is positive: every reading has its own σ.
fn cholesky<T: Real>(covariance: &[[T; READINGS]; READINGS]) -> [T; LOWER] {
    let mut factor = [T::ZERO; LOWER];
    let mut start = 0;
    for (index, entries) in covariance.iter().enumerate() {
        let mut own = [T::ZERO; READINGS];
        for (column, (entry, above)) in entries
            .iter()
            .zip(lower_rows(&factor))
            .enumerate()
            .take(index)
        {
            let sum = *entry - product(&own, above);
            if let (Some(target), Some(pivot)) = (own.get_mut(column), above.last()) {
                *target = sum / *pivot;
            }
        }
        let squared = entries.get(index).copied().unwrap_or(T::ONE) - product(&own, &own);
        if let Some(target) = own.get_mut(index) {
            *target = squared.square_root();
        }
        for (entry, value) in factor
            .iter_mut()
            .skip(start)
            .zip(own.iter().take(index + 1))
        {
            *entry = *value;
        }
        start += index + 1;
    }
    factor
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

    use crate::observations::{
        Distance, DistanceFrom, Height, Instruments, Observation, ObservationError,
        ObservationNoise, ObservationProblem, ObservationRow, Plane, Point, PositionFrame,
    };
    use crate::robot::{Robot, SymmetricRobot};
    use crate::samples::Noise;
    use nalgebra::{SMatrix, Vector3};

    const PLANES: [Plane<f64>; 1] = [Plane {
        known: Some((-560.0, 1.0)),
        level: Some(1e-9),
    }];
    const POINTS: [Point<f64>; 1] = [Point {
        known: Some((Vector3::new(50.0, -30.0, -700.0), 1.0)),
        offset: false,
    }];

    fn robot() -> Robot<f64> {
        SymmetricRobot::PAPER.robot().unwrap()
    }

    /// Too short for level upper arms: near these, the forearms are almost coplanar.
    fn short_forearms() -> Robot<f64> {
        let robot = SymmetricRobot {
            forearm: 420.0,
            ..SymmetricRobot::PAPER
        };
        robot.robot().unwrap()
    }

    fn instruments() -> Instruments<'static, f64> {
        Instruments {
            frame: PositionFrame::Base,
            planes: &PLANES,
            points: &POINTS,
            noise: ObservationNoise::new(
                Noise::by_axis([0.02, 0.03, 0.1], 1e-4).unwrap(),
                0.05,
                0.04,
            )
            .unwrap(),
            transmission: None,
        }
    }

    fn joints(index: usize) -> [f64; 3] {
        let t = index as f64;
        [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()]
    }

    /// Every kind of reading, in rows that hold all, some or one of them.
    fn observation(index: usize) -> Observation<f64> {
        let own = joints(index);
        let from = if index.is_multiple_of(2) {
            DistanceFrom::Pose(joints(index + 5))
        } else {
            DistanceFrom::Point(0)
        };
        let [x, y, z, height, distance] = readings(&own, &joints(index + 5), &from);
        Observation {
            position: [
                (index % 3 != 1).then_some(x),
                Some(y),
                (index % 4 != 2).then_some(z),
            ],
            height: (index % 5 != 3).then_some(Height { plane: 0, height }),
            distance: (index % 7 != 4).then_some(Distance { from, distance }),
            ..Observation::at(own)
        }
    }

    /// x, y, z, height and distance at joint angles.
    fn readings(own: &[f64; 3], other: &[f64; 3], from: &DistanceFrom<f64>) -> [f64; 5] {
        let x = robot().forward(own).unwrap();
        let other = match from {
            DistanceFrom::Pose(_) => robot().forward(other).unwrap(),
            DistanceFrom::Point(_) => Vector3::new(50.0, -30.0, -700.0),
        };
        [x.x, x.y, x.z, x.z + 560.0, (x - other).norm()]
    }

    /// The noise of the reading itself, and of both poses' joint angles by central differences.
    #[test]
    fn a_row_is_weighed_by_the_covariance_of_its_readings() {
        let (robot, instruments) = (robot(), instruments());
        let mut rows: [ObservationRow<f64>; 24] =
            core::array::from_fn(|index| ObservationRow::new(observation(index)));
        let problem =
            ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut rows).unwrap();
        for (index, row) in problem.rows().iter().enumerate() {
            let observation = *row.observation();
            let from = observation.distance.map(|distance| distance.from);
            let between = matches!(from, Some(DistanceFrom::Pose(_)));
            let from = from.unwrap_or(DistanceFrom::Point(0));
            let mut by_joints = SMatrix::<f64, 5, 6>::zeros();
            for joint in 0..6 {
                let [above, below] = [1e-6, -1e-6].map(|by| {
                    let mut both = [joints(index), joints(index + 5)];
                    both.as_flattened_mut()[joint] += by;
                    readings(&both[0], &both[1], &from)
                });
                for reading in 0..5 {
                    if joint < 3 || (between && reading == 4) {
                        by_joints[(reading, joint)] = (above[reading] - below[reading]) / 2e-6;
                    }
                }
            }
            let [x, y, z] = observation.position.map(|own| own.is_some());
            let read = [
                x,
                y,
                z,
                observation.height.is_some(),
                observation.distance.is_some(),
            ];
            let mut expected = by_joints * by_joints.transpose() * 1e-8;
            for (reading, sigma) in [0.02, 0.03, 0.1, 0.05, 0.04].into_iter().enumerate() {
                expected[(reading, reading)] += sigma * sigma;
                if !read[reading] {
                    expected.row_mut(reading).fill(0.0);
                    expected.column_mut(reading).fill(0.0);
                    expected[(reading, reading)] = 1.0;
                }
            }
            let factor = SMatrix::<f64, 5, 5>::from_fn(|index, column| {
                let own = row.factor_rows().nth(index).unwrap();
                own.get(column).copied().unwrap_or(0.0)
            });
            let found = factor * factor.transpose();
            // Differences over 1e-6 rad have eight correct digits.
            assert!((found - expected).amax() < 1e-6 * expected.amax());

            // Σ 1/Lₖₖ² times |X|² + Lb².
            let size = robot.forward(&joints(index)).unwrap().norm_squared() + 480.0 * 480.0;
            let pivots = (0..5).filter(|reading| read[*reading]);
            let squares: f64 = pivots
                .map(|k| 1.0 / (factor[(k, k)] * factor[(k, k)]))
                .sum();
            assert!((row.terms_squared(&robot) / (squares * size) - 1.0).abs() < 1e-12);
            let mut twice = *row;
            twice.set_weight(2.0);
            let start = &problem.prepared.start;
            let residuals = |row: &ObservationRow<f64>| {
                let built = Robot::from_parameters(robot.parameters().map(|mut arm| {
                    arm[5] += 0.3;
                    arm
                }));
                let built = built.unwrap();
                row.residuals(&start.at(&built, &instruments, start.unknowns()))
            };
            let (once, doubled) = (residuals(row).unwrap(), residuals(&twice).unwrap());
            assert!(once.iter().any(|residual| residual.abs() > 0.1));
            for (once, doubled) in once.into_iter().zip(doubled) {
                assert!((doubled - libm::sqrt(2.0) * once).abs() <= 1e-14 * once.abs());
            }
            assert!((twice.terms_squared(&robot) / (2.0 * squares * size) - 1.0).abs() < 1e-12);
        }
    }

    /// Two poses are the same place if they are closer than √ε times the distance from the base.
    #[test]
    fn a_distance_needs_two_places() {
        let robot = robot();
        let own = joints(4);
        let x = robot.forward(&own).unwrap();
        for (part, same) in [(0.0, true), (0.5, true), (2.0, false), (1e6, false)] {
            let apart = Vector3::new(0.3, -0.4, 0.5).normalize() * (part * 1.5e-8 * x.norm());
            let other = robot.inverse(&(x + apart)).unwrap();
            let mut row = ObservationRow::new(Observation {
                distance: Some(Distance {
                    from: DistanceFrom::Pose(other),
                    distance: 1.0,
                }),
                ..Observation::at(own)
            });
            let expected = if same {
                Err(ObservationError::SamePlace)
            } else {
                Ok(())
            };
            assert_eq!(row.look_whether_reached(&robot), expected, "{part}");
        }
        // A pose out of reach is ignored.
        let mut row = ObservationRow::new(Observation {
            position: [Some(1.0), None, None],
            ..Observation::at([0.0; 3])
        });
        row.look_whether_reached(&short_forearms()).unwrap();
        assert!(row.is_left_out());
    }

    /// With a noise too small to represent, rounding remains: four ε of the robot's size.
    #[test]
    fn rounding_is_a_noise_too() {
        let robot = robot();
        let instruments = Instruments {
            noise: ObservationNoise::new(Noise::new(1.0, 0.0).unwrap(), 1e-15, 1.0).unwrap(),
            points: &[],
            ..instruments()
        };
        let mut rows: [ObservationRow<f64>; 4] = core::array::from_fn(|index| {
            ObservationRow::new(Observation {
                height: Some(Height {
                    plane: 0,
                    height: 60.0,
                }),
                ..Observation::at(joints(index))
            })
        });
        let problem =
            ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut rows).unwrap();
        for (index, row) in problem.rows().iter().enumerate() {
            let size = robot.forward(&joints(index)).unwrap().norm_squared() + 480.0 * 480.0;
            let expected = 4.0 * f64::EPSILON * libm::sqrt(size);
            assert!((row.factor_rows().nth(3).unwrap()[3] / expected - 1.0).abs() < 1e-5);
        }
    }
}
