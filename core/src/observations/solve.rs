//! How the problem is solved: what is known beforehand, the minimisation, a second start; at once or in bounded steps.

use super::instruments::{
    Instruments, OF_FRAME, OF_PLANE, OF_POINT, OF_ROBOT, OF_TRANSMISSIONS, PositionFrame,
};
use super::observation::{Observation, ObservationError, ObservationRow};
use super::problem::{InstrumentsAt, ObservationProblem, Prepared};
use crate::Real;
use crate::calibration::{
    Estimate, JointOutcome, Minimizer, Progress, Refusal, Settings, TolerancePrior, enough_samples,
};
use crate::frame::RigidTransform;
use crate::robot::{ArmIndex, Robot};
use nalgebra::SMatrix;

impl<T: Real, const N: usize> ObservationProblem<'_, T, N> {
    /// Calibrates the robot. Where the iteration from nominal leads nowhere because some pose is near a
    /// singularity of the nominal robot, it starts again from the solution of the other poses.
    ///
    /// # Errors
    /// A [`Refusal`]; the robot keeps its parameters.
    pub fn solve<const M: usize, const E: usize>(
        &self,
        settings: &Settings<T>,
    ) -> Result<ObservationOutcome<T, N>, Refusal> {
        let mut minimisation = Minimisation::<T, N, M, E>::new();
        loop {
            if let Some(result) = minimisation.step(self, settings) {
                return result;
            }
        }
    }

    /// The minimisation of this problem, with the settings' tolerance and what is known of the instruments.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    #[allow(clippy::type_complexity)]
    pub fn minimizer<const M: usize, const E: usize>(
        &self,
        settings: &Settings<T>,
    ) -> Result<Minimizer<T, InstrumentsAt<T, N>, TolerancePrior<T, N>, N, M, E>, Refusal> {
        Minimizer::with_prior(self, ArmIndex::First, self.prior(settings), settings)
    }

    /// What is known of the parameters beforehand, in units of
    /// [`unit_of`](crate::calibration::Problem::unit_of).
    pub fn prior(&self, settings: &Settings<T>) -> TolerancePrior<T, N> {
        let [first, second, third] = self.robot.arms();
        let arms = [first, second, third];
        TolerancePrior::coupled(self.weights(settings), arms, settings.tolerance.as_ref())
    }

    /// 1/σ of what is known of each parameter by itself; 0 where nothing is known, 1 for places that no
    /// unknown needs.
    fn weights(&self, settings: &Settings<T>) -> [T; N] {
        let mut weights = [T::ZERO; N];
        let places = self.robot.drive().places();
        let places = places.into_iter().cycle().take(OF_ROBOT);
        for ((weight, unit), parameter) in weights.iter_mut().zip(self.prepared.units).zip(places) {
            *weight = match (parameter, &settings.tolerance) {
                (Some(parameter), Some(tolerance)) => unit / tolerance.of(parameter),
                (Some(_), None) => T::ZERO,
                (None, _) => T::ONE,
            };
        }
        let mut put = |column: usize, count: usize, sigma: T| {
            let places = weights
                .iter_mut()
                .zip(self.prepared.units)
                .skip(column)
                .take(count);
            for (weight, unit) in places {
                *weight = unit / sigma;
            }
        };
        if let Some(tolerance) = &self.instruments.transmission {
            put(OF_ROBOT, OF_TRANSMISSIONS, tolerance.sigma());
        }
        for (index, plane) in (0..).zip(self.instruments.planes) {
            if let Some((_, sigma)) = plane.known {
                put(self.instruments.plane_column(index), 1, sigma);
            }
            if let Some(sigma) = plane.level {
                put(
                    self.instruments.plane_column(index) + 1,
                    OF_PLANE - 1,
                    sigma,
                );
            }
        }
        for (index, point) in (0..).zip(self.instruments.points) {
            if let Some((_, sigma)) = point.known {
                put(self.instruments.point_column(index), OF_POINT, sigma);
            }
        }
        let used = OF_ROBOT + self.instruments.unknowns();
        for weight in weights.iter_mut().skip(used) {
            *weight = T::ONE;
        }
        if self.instruments.frame == PositionFrame::Sensor {
            let first = self.instruments.frame_column();
            let numbers = weights.iter_mut().skip(first).take(OF_FRAME);
            for (number, weight) in numbers.enumerate() {
                if self.prepared.start.is_free(number) {
                    *weight = T::ONE;
                }
            }
        }
        weights
    }
}

type Correction<T, const N: usize, const M: usize, const E: usize> =
    Minimizer<T, InstrumentsAt<T, N>, TolerancePrior<T, N>, N, M, E>;

/// One minimisation after the other, in bounded steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimisation<T: Real, const N: usize, const M: usize, const E: usize> {
    pass: Pass<T, N>,
    minimizer: Option<Correction<T, N, M, E>>,
}

#[derive(Debug, Clone, Copy)]
enum Pass<T, const N: usize> {
    /// All rows, from nominal.
    FromNominal,
    /// The rows of poses that are not near a singularity of the nominal robot; why from nominal nothing came.
    ClearAlone(Refusal),
    /// All rows, from the solution of those.
    FromClear([T; N]),
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Minimisation<T, N, M, E> {
    pub(super) const fn new() -> Self {
        Self {
            pass: Pass::FromNominal,
            minimizer: None,
        }
    }

    /// One step of the same problem; the result with the last one.
    pub(super) fn step(
        &mut self,
        whole: &ObservationProblem<'_, T, N>,
        settings: &Settings<T>,
    ) -> Option<Result<ObservationOutcome<T, N>, Refusal>> {
        let mut problem = *whole;
        problem.prepared.clear_alone = matches!(self.pass, Pass::ClearAlone(_));
        problem.prepared.second_start = match self.pass {
            Pass::FromClear(start) => Some(start),
            _ => None,
        };
        let Some(minimizer) = &mut self.minimizer else {
            return self.begin(&problem, settings);
        };
        if minimizer.step(&problem) == Progress::Working {
            return None;
        }
        self.end(&problem)
    }

    // Not inlined, here and below: what is done one after the other shares the stack.
    #[inline(never)]
    fn begin(
        &mut self,
        problem: &ObservationProblem<'_, T, N>,
        settings: &Settings<T>,
    ) -> Option<Result<ObservationOutcome<T, N>, Refusal>> {
        if let Err(refusal) = enough_samples::<T, _, N, M, E>(problem, ArmIndex::First, settings) {
            return Some(Err(refusal));
        }
        let prior = problem.prior(settings);
        let minimizer = Minimizer::unstarted(ArmIndex::First, prior, settings);
        self.minimizer.insert(minimizer).begin(problem);
        None
    }

    #[inline(never)]
    fn end(
        &mut self,
        problem: &ObservationProblem<'_, T, N>,
    ) -> Option<Result<ObservationOutcome<T, N>, Refusal>> {
        let minimizer = self.minimizer.as_ref()?;
        if let Pass::ClearAlone(refusal) = self.pass {
            let Some(start) = minimizer.end() else {
                return Some(Err(refusal));
            };
            self.pass = Pass::FromClear(start);
            self.minimizer = None;
            return None;
        }
        let result = minimizer
            .estimate(problem)
            .and_then(|estimate| problem.outcome(&estimate));
        match (&self.pass, &result) {
            (
                Pass::FromNominal,
                Err(
                    refusal @ (Refusal::NotConverged { .. }
                    | Refusal::Undetermined { .. }
                    | Refusal::ResidualContradictsNoise { .. }
                    | Refusal::FarFromNominal { .. }
                    | Refusal::NonFinite { .. }),
                ),
            ) if problem.rows().iter().any(ObservationRow::is_steep) => {
                self.pass = Pass::ClearAlone(*refusal);
                self.minimizer = None;
                None
            }
            _ => Some(result),
        }
    }
}

impl<T: Real> ObservationRow<T> {
    /// A row for an [`ObservationSolver`], checked for a robot and instruments.
    ///
    /// # Errors
    /// What is wrong with the observation.
    pub fn checked(
        observation: Observation<T>,
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
    ) -> Result<Self, ObservationError> {
        observation.check(robot.drive(), instruments)?;
        let mut row = Self::new(observation);
        row.look_whether_reached(robot)?;
        Ok(row)
    }
}

/// Calibrates from observations one bounded step at a time, to the same bits as
/// [`ObservationProblem::solve`]. Robot, instruments, rows and settings stay with the caller, who hands in the
/// same ones with every step.
///
/// N parameters in all or more, M = N + 1, E = M (M + 1)/2. The longest step is the first, which looks where the
/// instruments are: its time grows with the number of rows.
///
/// ```
/// use delta_cal::calibration::Settings;
/// use delta_cal::observations::{
///     Height, Instruments, Observation, ObservationNoise, ObservationRow, ObservationSolver, Plane, PositionFrame,
/// };
/// use delta_cal::{Noise, SymmetricRobot, Tolerance};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let drawn = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let built = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..drawn }.robot()?;
/// let drawn = drawn.robot()?;
/// let instruments = Instruments {
///     frame: PositionFrame::Base,
///     planes: &[Plane::default()],
///     points: &[],
///     noise: ObservationNoise::new(Noise::new(0.02, 0.0)?, 0.02, 0.02)?,
///     transmission: None,
/// };
/// let mut rows = Vec::new();
/// for k in 0..45 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     let height = Some(Height { plane: 0, height: built.forward(&joints)?.z + 560.0 });
///     let observation = Observation { height, ..Observation::at(joints) };
///     rows.push(ObservationRow::checked(observation, &drawn, &instruments)?);
/// }
/// let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.0035)?);
/// let mut solver = ObservationSolver::<f64, 27, 28, 406>::new();
/// let outcome = loop {
///     if let Some(result) = solver.step(&drawn, &instruments, &mut rows, &settings) {
///         break result?;
///     }
/// };
/// let [c, ..] = outcome.plane(&instruments, 0);
/// assert!((c + 560.0).abs() < 1.0);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ObservationSolver<T: Real, const N: usize, const M: usize, const E: usize> {
    prepared: Option<Prepared<T, N>>,
    /// Rows that have their weights.
    weighed: usize,
    minimisation: Minimisation<T, N, M, E>,
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Default
    for ObservationSolver<T, N, M, E>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const N: usize, const M: usize, const E: usize> ObservationSolver<T, N, M, E> {
    /// Whether there is room for the unknowns of these instruments.
    pub fn has_room_for(instruments: &Instruments<'_, T>) -> bool {
        OF_ROBOT + instruments.unknowns() <= N
    }

    /// Before the first step.
    pub const fn new() -> Self {
        Self {
            prepared: None,
            weighed: 0,
            minimisation: Minimisation::new(),
        }
    }

    /// One step; with the last one the outcome, or why there is none. A step after that is none of a calibration:
    /// begin with a new solver.
    ///
    /// # Errors
    /// A [`Refusal`]; of instruments for which there is [no room](Self::has_room_for), [`Refusal::TooManyUnknowns`].
    pub fn step(
        &mut self,
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
        rows: &mut [ObservationRow<T>],
        settings: &Settings<T>,
    ) -> Option<Result<ObservationOutcome<T, N>, Refusal>> {
        let Some(prepared) = &mut self.prepared else {
            if !Self::has_room_for(instruments) {
                let parameters = (OF_ROBOT + instruments.unknowns()) as u64;
                return Some(Err(Refusal::TooManyUnknowns { parameters }));
            }
            return match Prepared::begun(robot, instruments, rows) {
                Ok(begun) => {
                    self.prepared = Some(begun);
                    None
                }
                Err(refusal) => Some(Err(refusal)),
            };
        };
        if let Some(row) = rows.get_mut(self.weighed) {
            self.weighed += 1;
            row.take_weights(robot, instruments, prepared.start());
            prepared.count(robot, row);
            return None;
        }
        let problem = ObservationProblem {
            robot,
            instruments,
            rows,
            prepared: *prepared,
        };
        self.minimisation.step(&problem, settings)
    }
}

/// A robot calibrated from observations, and the unknowns of the instruments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservationOutcome<T: Real, const N: usize> {
    /// The calibrated robot.
    pub robot: Robot<T>,
    /// All parameters, the robot's 24 first, and how far they can be trusted.
    pub estimate: Estimate<T, N>,
    unknowns: [T; N],
    frame: RigidTransform<T>,
}

impl<T: Real, const N: usize> ObservationOutcome<T, N> {
    pub(super) const fn new(
        robot: Robot<T>,
        estimate: Estimate<T, N>,
        unknowns: [T; N],
        frame: RigidTransform<T>,
    ) -> Self {
        Self {
            robot,
            estimate,
            unknowns,
            frame,
        }
    }

    /// The unknowns at their places among all parameters; what stands before them has no meaning.
    pub const fn unknowns(&self) -> &[T; N] {
        &self.unknowns
    }

    /// The frame of the coordinates: from the robot's frame to it.
    pub const fn frame(&self) -> RigidTransform<T> {
        self.frame
    }

    /// c (length), a and b of a plane z = c + a x + b y.
    pub fn plane(&self, instruments: &Instruments<'_, T>, plane: u8) -> [T; 3] {
        self.from(instruments.plane_column(plane))
    }

    /// x, y and z of a point and what its sensor reads too much. Length.
    pub fn point(&self, instruments: &Instruments<'_, T>, point: u8) -> [T; 4] {
        let [x, y, z, offset] = self.from(instruments.point_column(point));
        let has_offset = instruments.points.get(usize::from(point));
        let has_offset = has_offset.is_some_and(|point| point.offset);
        [x, y, z, if has_offset { offset } else { T::ZERO }]
    }

    fn from<const K: usize>(&self, column: usize) -> [T; K] {
        let mut values = [T::ZERO; K];
        for (value, unknown) in values.iter_mut().zip(self.unknowns.iter().skip(column)) {
            *value = *unknown;
        }
        values
    }

    /// The robot's 24 geometric parameters alone; the covariance takes the share of all other unknowns into account.
    /// The robot has the transmissions that were found.
    pub fn of_robot(&self) -> JointOutcome<T> {
        let whole = &self.estimate;
        let mut correction = [T::ZERO; OF_ROBOT];
        let mut prior_share = [T::ZERO; OF_ROBOT];
        for (own, value) in correction.iter_mut().zip(whole.correction) {
            *own = value;
        }
        for (own, value) in prior_share.iter_mut().zip(whole.prior_share) {
            *own = value;
        }
        let block = |all: &SMatrix<T, N, N>| {
            SMatrix::<T, OF_ROBOT, OF_ROBOT>::from_fn(|row, column| {
                all.get((row, column)).copied().unwrap_or(T::ZERO)
            })
        };
        JointOutcome {
            robot: self.robot,
            estimate: Estimate {
                correction,
                covariance: whole.covariance.as_ref().map(block),
                prior_share,
                residual_rms: whole.residual_rms,
                estimated_noise: whole.estimated_noise,
                degrees_of_freedom: whole.degrees_of_freedom,
                effective_samples: whole.effective_samples,
                samples: whole.samples,
                iterations: whole.iterations,
                termination: whole.termination,
                start: whole.start,
                conditions: whole.conditions,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

    use super::{Minimisation, Pass};
    use crate::calibration::{Problem, Refusal, Settings, Tolerance};
    use crate::observations::{
        Instruments, Observation, ObservationNoise, ObservationProblem, ObservationRow,
        PositionFrame,
    };
    use crate::robot::{Parameter, Robot, SymmetricRobot};
    use crate::samples::{Noise, Triangle};
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg32;

    /// Positions that contradict their noise, of a robot whose forearms are too short for level upper arms; the last at a
    /// pose near those, or not.
    fn rows(steep: bool) -> [ObservationRow<f64>; 30] {
        let robot = robot().robot().unwrap();
        core::array::from_fn(|index| {
            let t = index as f64;
            let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
            let joints = if steep && index == 29 {
                [0.2; 3]
            } else {
                joints.map(|q| 0.9 + 0.5 * q)
            };
            let x = robot.forward(&joints).unwrap();
            let off = (5.0 * t).sin();
            ObservationRow::new(Observation {
                position: [Some(x.x + off), Some(x.y - off), Some(x.z + off)],
                ..Observation::at(joints)
            })
        })
    }

    fn robot() -> SymmetricRobot<f64> {
        SymmetricRobot {
            forearm: 420.0,
            ..SymmetricRobot::PAPER
        }
    }

    fn instruments() -> Instruments<'static, f64> {
        Instruments {
            frame: PositionFrame::Base,
            planes: &[],
            points: &[],
            noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.02).unwrap(),
            transmission: None,
        }
    }

    /// Where some pose is near a singularity a refusal is looked into once more, from the other poses; where none is it
    /// stands.
    #[test]
    fn a_refusal_is_tried_again_only_where_a_pose_is_nearly_singular() {
        let (robot, instruments) = (robot().robot().unwrap(), instruments());
        let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
        for steep in [false, true] {
            let mut rows = rows(steep);
            let problem = ObservationProblem::<f64, 24>::prepare(&robot, &instruments, &mut rows);
            let problem = problem.unwrap();
            assert_eq!(
                problem.rows().iter().filter(|row| row.is_steep()).count(),
                usize::from(steep)
            );
            let mut minimisation = Minimisation::<f64, 24, 25, 325>::new();
            let refusal = loop {
                if let Some(result) = minimisation.step(&problem, &settings) {
                    break result.unwrap_err();
                }
            };
            assert!(matches!(
                refusal,
                Refusal::ResidualContradictsNoise { .. } | Refusal::FarFromNominal { .. }
            ));
            assert_eq!(matches!(minimisation.pass, Pass::FromNominal), !steep);
        }
    }

    /// Without the poses near a singularity their rows add nothing; the solution of the others is the second start.
    #[test]
    fn a_row_that_is_passed_over_adds_nothing() {
        let (robot, instruments) = (robot().robot().unwrap(), instruments());
        let mut rows = rows(true);
        let problem = ObservationProblem::<f64, 24>::prepare(&robot, &instruments, &mut rows);
        let mut problem = problem.unwrap();
        let at = Problem::<f64, 24, 25, 325>::displaced(&problem, &[0.0; 24]);
        for clear_alone in [false, true] {
            problem.prepared.clear_alone = clear_alone;
            for piece in [5, 29] {
                let mut normal = Triangle::<f64, 25, 325>::zero();
                let summed = Problem::<f64, 24, 25, 325>::sum_of_squares(&problem, &at, piece);
                let taken = problem.linearize(&at, &mut normal, piece);
                let nothing = clear_alone && piece == 29;
                assert_eq!(summed.sum_of_squares == 0.0, nothing);
                assert_eq!(taken.sum_of_squares == 0.0, nothing);
                assert_eq!(normal == Triangle::zero(), nothing);
            }
        }
        let start = |problem: &ObservationProblem<'_, f64, 24>| {
            Problem::<f64, 24, 25, 325>::free_start(problem, 0)
        };
        assert_eq!(start(&problem), None);
        problem.prepared.second_start = Some([0.25; 24]);
        assert_eq!(start(&problem), Some([0.25; 24]));
    }

    /// Robots made to 2 mm and 10 mrad, measured also where the arms are nearly level. For some the iteration from nominal
    /// fails, for the nominal robot is nearly singular there; from the solution of the other poses it finds the robot.
    #[test]
    fn the_solution_of_the_other_poses_leads_where_nominal_does_not() {
        let (nominal, instruments) = (robot().robot().unwrap(), instruments());
        let tolerance = Tolerance::new(2.0, 0.01).unwrap();
        let settings = Settings::new().with_tolerance(tolerance);
        let middle = [0.9; 3];
        let mut found = 0;
        for seed in 0..60 {
            let mut rng = Pcg32::seed_from_u64(seed);
            // Evenly in (−1, 1); times √3 the standard deviation is 1.
            let mut uniform = move || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
            let mut error = |sigma: f64| libm::sqrt(3.0) * sigma * uniform();
            let truth = Robot::from_parameters(nominal.parameters().map(|mut arm| {
                for (value, parameter) in arm.iter_mut().zip(Parameter::ROTARY) {
                    *value += error(tolerance.of(parameter));
                }
                arm
            }));
            let truth = truth.unwrap();
            let mut rows = [ObservationRow::new(Observation::at(middle)); 20];
            for row in &mut rows {
                let (joints, position) = loop {
                    let joints = [(); 3].map(|()| 0.25 + error(0.29));
                    if let (Ok(position), Ok(_)) =
                        (truth.forward(&joints), nominal.forward(&joints))
                    {
                        break (joints, position);
                    }
                };
                let position = position.map(|x| x + error(0.02));
                *row = ObservationRow::new(Observation {
                    position: [Some(position.x), Some(position.y), Some(position.z)],
                    ..Observation::at(joints)
                });
            }
            let problem = ObservationProblem::<f64, 24>::prepare(&nominal, &instruments, &mut rows);
            let problem = problem.unwrap();
            let mut minimisation = Minimisation::<f64, 24, 25, 325>::new();
            let result = loop {
                if let Some(result) = minimisation.step(&problem, &settings) {
                    break result;
                }
            };
            if let (Pass::FromClear(_), Ok(outcome)) = (minimisation.pass, result) {
                let off = |robot: &Robot<f64>| {
                    (robot.forward(&middle).unwrap() - truth.forward(&middle).unwrap()).norm()
                };
                assert!(10.0 * off(&outcome.robot) < off(&nominal));
                found += 1;
            }
        }
        assert!(found > 5, "{found}");
    }
}
