//! Weights of the rows, their residuals and derivatives.

use super::equation::{At, Equation};
use super::observation::{LOWER, ObservationError, ObservationRow, READINGS};
use crate::Real;
use crate::robot::{Arm, ArmIndex, OF_ARM, OF_ROBOT, Robot, TRANSMISSION_NUMBERS};
use crate::samples::{Unknowns, squares};
use nalgebra::Vector3;

/// Rounding of a computed position, in ε times the robot's size.
const ROUNDING: f64 = 4.0;
/// Parts in which the rows of a set of readings are absorbed.
pub(super) const PARTS: usize = 2;

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
    /// Finds the nominal robot's position.
    ///
    /// # Errors
    /// [`ObservationError::Unreached`] and [`ObservationError::SamePlace`].
    pub(super) fn place(&mut self, robot: &Robot<T>) -> Result<(), ObservationError> {
        let (own, other) = self.poses(robot).ok_or(ObservationError::Unreached)?;
        self.nominal = own.position;
        if let Some(other) = other {
            let apart = own.position - other.position;
            let least = T::EPSILON.square_root() * own.position.dot(&own.position).square_root();
            if !(apart.dot(&apart).square_root() > least) {
                return Err(ObservationError::SamePlace);
            }
        }
        Ok(())
    }

    /// Computes the weights of the readings; `shape`: the covariance of two readings in products of their σ, if it is not
    /// that of independent ones.
    pub(super) fn take_weights(
        &mut self,
        at: &At<'_, T>,
        shape: impl Fn(usize, usize) -> Option<T>,
    ) {
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
        let mut shares = [None; READINGS];
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
            *share = Some(([a, b, c, d, e, f], equation.sigma));
        }
        let [first, ..] = robot.arms();
        let size = own.position.dot(&own.position) + first.lb().squared();
        let rounding = T::from_f64(ROUNDING) * T::EPSILON;
        self.factor = cholesky(&shares, rounding.squared() * size, shape);
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

    /// The rows (∂r/∂p, r), by columns. `None` if the robot has no such pose.
    pub(super) fn linearized<const N: usize>(
        &self,
        at: &At<'_, T>,
        units: &[T; N],
    ) -> Option<T::Columns<[T; READINGS]>>
    where
        T: Unknowns<N>,
    {
        let mut columns = T::columns([T::ZERO; READINGS]);
        let known = self.left_out || self.linearize(at, units, columns.as_mut());
        known.then_some(columns)
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

    /// Writes the rows (∂r/∂p, r) into columns for [`absorb`](Self::absorb), and returns Σ r². `None` if the robot has no
    /// such pose.
    pub(crate) fn derive(
        &self,
        at: &At<'_, T>,
        units: &[T],
        columns: &mut [[T; READINGS]],
    ) -> Option<T> {
        if self.left_out {
            return Some(T::ZERO);
        }
        columns.fill([T::ZERO; READINGS]);
        if !self.linearize(at, units, columns) {
            return None;
        }
        let residuals = columns.last().map_or(T::ZERO, |own| squares(own));
        self.compact(columns);
        Some(residuals)
    }

    /// Absorbs the rows from [`derive`](Self::derive) into a triangle: the reflections of the leading columns, or in the
    /// last part those of all others.
    pub(super) fn absorb(&self, part: usize, columns: &mut [[T; READINGS]], entries: &mut [T]) {
        let size = columns.len();
        // Rows of zeros change nothing but cost time.
        if self.left_out {
        } else if self.observation.readings() <= 2 {
            let (twos, _) = columns.as_flattened_mut().as_chunks_mut::<2>();
            let twos = twos.get_mut(..size).unwrap_or_default();
            absorb_part(part, twos, entries, T::absorb_two);
        } else {
            absorb_part(part, columns, entries, T::absorb_five);
        }
    }

    /// Compacts rows (in columns of five) with at most two readings to columns of two.
    fn compact(&self, columns: &mut [[T; READINGS]]) {
        let mut read = (0..READINGS).filter(|reading| self.observation.is_read(*reading));
        let (first, second, None) = (read.next(), read.next(), read.next()) else {
            return;
        };
        for index in 0..columns.len() {
            let column = columns.get(index).copied().unwrap_or([T::ZERO; READINGS]);
            let at = |reading: Option<usize>| {
                let entry = reading.and_then(|reading| column.get(reading));
                entry.copied().unwrap_or(T::ZERO)
            };
            let two = [at(first), at(second)];
            if let Some(place) = columns.as_flattened_mut().as_chunks_mut().0.get_mut(index) {
                *place = two;
            }
        }
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
        let is_read = |index: &usize| self.observation.is_read(*index);
        for (index, row) in self.factor_rows().enumerate() {
            let Some((pivot, row)) = row.split_last().filter(|_| is_read(&index)) else {
                continue;
            };
            // Where nothing is read there are zeros.
            for (known, factor) in row.iter().enumerate().filter(|(known, _)| is_read(known)) {
                for column in columns.iter_mut() {
                    if let (Some(known), Some(entry)) =
                        (column.get(known).copied(), column.get_mut(index))
                    {
                        *entry -= *factor * known;
                    }
                }
            }
            for column in columns.iter_mut() {
                if let Some(entry) = column.get_mut(index) {
                    *entry /= *pivot;
                }
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

/// A part of the absorption of rows into the last columns of a triangle. The parts cost about the same.
fn absorb_part<T: Real, const K: usize>(
    part: usize,
    columns: &mut [[T; K]],
    entries: &mut [T],
    absorb: impl FnOnce(&mut [T], &mut [[T; K]], usize),
) {
    let leading = columns.len() * 3 / 10;
    let (first, pivots) = match part {
        0 => (0, leading),
        _ => (leading, columns.len() - leading),
    };
    let columns = columns.get_mut(first..).unwrap_or_default();
    let rest = columns.len();
    let above = entries.len().saturating_sub(rest * (rest + 1) / 2);
    absorb(
        entries.get_mut(above..).unwrap_or_default(),
        columns,
        pivots,
    );
}

/// Adds ∂h/∂P of a reading whose derivative by the pose's position is `by_position`.
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
    // Not `chunks_exact_mut`, which can divide by zero where it is not inlined.
    let (of_arms, _) = columns.as_chunks_mut::<OF_ARM>();
    for (((own, part), q), index) in of_arms.iter_mut().zip(parts).zip(joints).zip(ArmIndex::ALL) {
        let gradient = of_arm(index).constraint_by_parameters(&pose.position, *q);
        add_products(own, reading, part, gradient.as_slice());
    }
}

/// Adds the derivatives by the numbers of the transmissions, which follow the parameters.
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

fn product<T: Real>(one: &[T], other: &[T]) -> T {
    one.iter()
        .zip(other)
        .fold(T::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// L of L Lᵀ, each row up to its diagonal, which is positive: every reading has its own σ. Of each reading, the parts of the
/// joints' noise and σ; where nothing is read there is a 1. L Lᵀ is the readings' covariance, `rounding` on its diagonal.
fn cholesky<T: Real>(
    shares: &[Option<([T; 6], T)>; READINGS],
    rounding: T,
    shape: impl Fn(usize, usize) -> Option<T>,
) -> [T; LOWER] {
    let mut rows = [[T::ZERO; READINGS]; READINGS];
    let mut factor = [T::ZERO; LOWER];
    let mut entries = factor.iter_mut();
    for (index, share) in shares.iter().enumerate() {
        let Some((known, [own, ..])) = rows.split_at_mut_checked(index) else {
            break;
        };
        let mut diagonal = T::ONE;
        if let Some((share, sigma)) = share {
            for (column, (above, other)) in known.iter().zip(shares).enumerate() {
                if let (Some((other, other_sigma)), Some(pivot)) = (other, above.get(column)) {
                    let mut sum = product(share, other) - product(own, above);
                    if let Some(shape) = shape(index, column) {
                        sum += shape * *sigma * *other_sigma;
                    }
                    if let Some(entry) = own.get_mut(column) {
                        *entry = sum / *pivot;
                    }
                }
            }
            let square = match shape(index, index) {
                Some(shape) => shape * sigma.squared(),
                None => sigma.squared(),
            };
            let variance = product(share, share) + (square + rounding);
            diagonal = (variance - product(own, own)).square_root();
        }
        if let Some(entry) = own.get_mut(index) {
            *entry = diagonal;
        }
        for (value, entry) in own.iter().take(index + 1).zip(&mut entries) {
            *entry = *value;
        }
    }
    factor
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use crate::fixtures::{instruments, joints, paper};
    use crate::observations::{
        Height, Instruments, Observation, ObservationNoise, ObservationProblem, ObservationRow,
        Plane,
    };
    use crate::samples::Noise;

    /// With a noise too small to represent, rounding remains: four ε of the robot's size.
    #[test]
    fn rounding_is_a_noise_too() {
        let robot = paper();
        let planes = [Plane::default()];
        let instruments = Instruments {
            noise: ObservationNoise::new(Noise::new(1.0, 0.0).unwrap(), 1e-15, 1.0).unwrap(),
            ..instruments(&planes, &[])
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
