//! The calibration in bounded steps, with rows that the caller keeps.

use super::instruments::{Instruments, OF_ROBOT};
use super::observation::{Observation, ObservationError};
use super::outcome::ObservationOutcome;
use super::prepared::Prepared;
use super::problem::ObservationProblem;
use super::row::ObservationRow;
use super::solve::Minimisation;
use crate::Real;
use crate::calibration::{Refusal, Settings};
use crate::robot::Robot;

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
