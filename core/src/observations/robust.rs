//! Observations of which some may be wrong: every row is right or wrong as a whole.

use super::instruments::{Instruments, OF_ROBOT};
use super::outcome::ObservationOutcome;
use super::problem::{ObservationProblem, PrepareError};
use super::row::ObservationRow;
use super::start::StartValues;
use crate::Real;
use crate::calibration::limits::SAMPLES_FOR_ROBUST_FIT;
use crate::calibration::{Minimizer, Prior, Problem, Progress, Refusal, Settings, TolerancePrior};
use crate::robot::{ArmIndex, Robot};
use crate::robust::{Fits, Loss, RobustOutcome, RobustRefusal, WeighedSample, fit};
use core::fmt;

/// Rows beside the unknowns of the instruments that lead near the robot, if its tolerance is known.
const SUBSET_WITH_TOLERANCE: usize = 8;
/// Wider scales let wrong rows back in, which the robot's parameters then follow, for there are hardly more rows than
/// parameters. Of 45 rows, eight of them wrong, 20 had 46 % of the robots refused, 2.5 had 8 %.
const WIDENED: f64 = 2.5;
/// Parameters of the robot that measurements decide where the tolerance is known: heights of a plate some twelve,
/// distances some sixteen.
const DECIDED_WITH_TOLERANCE: usize = 14;

/// Why there is no robust fit of observations.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RobustObservationError {
    /// They are no problem to solve.
    Prepare(PrepareError),
    /// Too few, too many that disagree, or what is left does not calibrate the robot.
    Refused(RobustRefusal),
}

impl fmt::Display for RobustObservationError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Prepare(error) => error.fmt(formatter),
            Self::Refused(refusal) => refusal.fmt(formatter),
        }
    }
}

impl core::error::Error for RobustObservationError {}

impl From<PrepareError> for RobustObservationError {
    fn from(error: PrepareError) -> Self {
        Self::Prepare(error)
    }
}

impl From<RobustRefusal> for RobustObservationError {
    fn from(refusal: RobustRefusal) -> Self {
        Self::Refused(refusal)
    }
}

/// Calibrates a robot from observations of which some may be wrong, as [`robust_fit`](crate::robust::robust_fit)
/// does from positions. `work` has room for as many; its first places hold afterwards what became of each row, in
/// their order, and the rows weigh what they weigh in the fit. M = N + 1, E = M (M + 1)/2.
///
/// # Errors
/// Rows that are no problem to solve, too few, too many that disagree, or a [`Refusal`] of what is left.
///
/// ```
/// use delta_cal::calibration::Settings;
/// use delta_cal::observations::{
///     Height, Instruments, Observation, ObservationNoise, ObservationRow, Plane, PositionFrame,
///     robust_fit_observations,
/// };
/// use delta_cal::robust::{Loss, WeighedSample};
/// use delta_cal::{Noise, SymmetricRobot, Tolerance};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let drawn = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let built = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..drawn }.robot()?;
/// let mut rows = Vec::new();
/// for k in 0..45 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     // Dirt under the gauge block at one place.
///     let dirt = if k == 17 { 0.8 } else { 0.0 };
///     let height = Some(Height { plane: 0, height: built.forward(&joints)?.z + 560.0 + dirt });
///     rows.push(ObservationRow::new(Observation { height, ..Observation::at(joints) }));
/// }
/// let instruments = Instruments {
///     frame: PositionFrame::Base,
///     planes: &[Plane::default()],
///     points: &[],
///     noise: ObservationNoise::new(Noise::new(0.02, 0.0)?, 0.02, 0.02)?,
///     transmission: None,
/// };
/// let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.0035)?);
/// let mut work = [WeighedSample::vacant(); 45];
/// let robot = drawn.robot()?;
/// let outcome = robust_fit_observations::<_, 27, 28, 406>(
///     &robot, &instruments, &mut rows, &settings, Loss::Tukey, &mut work,
/// )?;
/// assert!(outcome.suspected == 1 && work[17].suspected());
/// # Ok(())
/// # }
/// ```
pub fn robust_fit_observations<T: Real, const N: usize, const M: usize, const E: usize>(
    robot: &Robot<T>,
    instruments: &Instruments<'_, T>,
    rows: &mut [ObservationRow<T>],
    settings: &Settings<T>,
    loss: Loss,
    work: &mut [WeighedSample<T>],
) -> Result<RobustOutcome<T, ObservationOutcome<T, N>>, RobustObservationError> {
    for row in rows.iter_mut() {
        row.set_weight(T::ONE);
    }
    let problem = ObservationProblem::<T, N>::prepare(robot, instruments, rows)?;
    let (start, prior) = (*problem.start(), problem.prior(settings));
    let weighed = work.get_mut(..rows.len()).ok_or(RobustRefusal::NoRoom {
        samples: rows.len(),
    })?;
    let (mut counted, mut readings) = (0, 0);
    for (place, row) in weighed.iter_mut().zip(rows.iter()) {
        *place = WeighedSample::vacant();
        if row.is_left_out() {
            place.dimensions = 0;
        } else {
            place.dimensions = u8::try_from(row.observation().readings()).unwrap_or(0);
        }
        counted += usize::from(place.dimensions > 0);
        readings += usize::from(place.dimensions);
    }
    if counted < SAMPLES_FOR_ROBUST_FIT {
        return Err(RobustRefusal::TooFewSamples {
            samples: counted,
            needed: SAMPLES_FOR_ROBUST_FIT,
        }
        .into());
    }
    // The noise of observations is always stated.
    let settings = Settings {
        noise: Some(*instruments.noise.position()),
        ..*settings
    };
    let mut fits = Observed::<T, N, M, E> {
        robot,
        instruments,
        settings: &settings,
        start,
        prior,
        rows,
        counted,
        readings,
    };
    Ok(fit(&mut fits, loss, weighed)?)
}

/// Observations, prepared.
struct Observed<'a, T: Real, const N: usize, const M: usize, const E: usize> {
    robot: &'a Robot<T>,
    instruments: &'a Instruments<'a, T>,
    settings: &'a Settings<T>,
    start: StartValues<T, N>,
    /// What is known beforehand.
    prior: TolerancePrior<T, N>,
    rows: &'a mut [ObservationRow<T>],
    /// Rows that count, and their readings.
    counted: usize,
    readings: usize,
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Observed<'_, T, N, M, E> {
    /// How many rows have so many readings, on average.
    fn rows_for(&self, readings: usize) -> usize {
        (readings * self.counted).div_ceil(self.readings.max(1))
    }

    fn weighed(
        &mut self,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> ObservationProblem<'_, T, N> {
        for (row, own) in self.rows.iter_mut().zip(weighed) {
            row.set_weight(own.factor);
        }
        let mut problem =
            ObservationProblem::new(self.robot, self.instruments, self.rows, self.start);
        problem.count_as(effective);
        problem
    }
}

impl<T: Real, const N: usize, const M: usize, const E: usize> Fits<T> for Observed<'_, T, N, M, E> {
    type Correction = [T; N];
    type Outcome = ObservationOutcome<T, N>;

    fn settings(&self) -> &Settings<T> {
        self.settings
    }

    fn widened(&self) -> T {
        T::from_f64(WIDENED)
    }

    fn nominal(&self) -> [T; N] {
        [T::ZERO; N]
    }

    fn subset(&self) -> usize {
        // Of the transmissions the tolerance tells enough.
        let unknowns = self.instruments.of_places();
        match self.settings.tolerance {
            Some(_) => SUBSET_WITH_TOLERANCE + self.rows_for(unknowns),
            None => self.rows_for(OF_ROBOT + unknowns) + 1,
        }
    }

    /// A robot far from its tolerance explains many wrong rows, where hardly more rows than parameters count.
    fn prior_cost(&self, correction: &[T; N]) -> T {
        Prior::<T, N, M, E>::cost(&self.prior, correction)
    }

    fn parameters(&self) -> usize {
        let of_robot = match self.settings.tolerance {
            Some(_) => DECIDED_WITH_TOLERANCE,
            None => OF_ROBOT,
        };
        self.rows_for(of_robot + self.instruments.of_places())
    }

    fn fit(
        &mut self,
        settings: &Settings<T>,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Option<[T; N]> {
        let problem = self.weighed(weighed, effective);
        let prior = problem.prior(settings);
        let mut minimizer: Minimizer<T, _, _, N, M, E> =
            Minimizer::with_prior(&problem, ArmIndex::First, prior, settings)
                .ok()?
                .for_its_end();
        while minimizer.step(&problem) == Progress::Working {}
        minimizer.end()
    }

    fn outcome(
        &mut self,
        weighed: &[WeighedSample<T>],
        effective: T,
    ) -> Result<ObservationOutcome<T, N>, Refusal> {
        let settings = self.settings;
        self.weighed(weighed, effective).solve::<M, E>(settings)
    }

    fn measure(&self, correction: &[T; N], weighed: &mut [WeighedSample<T>]) {
        let problem = ObservationProblem::new(self.robot, self.instruments, self.rows, self.start);
        let at = Problem::<T, N, M, E>::displaced(&problem, correction);
        for (row, own) in self.rows.iter().zip(weighed) {
            own.distance = problem.distance(&at, row);
        }
    }
}

#[cfg(test)]
mod tests;
