//! The calibrator from any readings: rows and solver in one object.

use super::instruments::{Instruments, OwnInstruments, PLACES};
use super::observation::{Observation, ObservationError, ObservationRow};
use super::problem::{Held, ObservationProblem, Prepared};
use super::solve::{ObservationMinimizer, ObservationOutcome};
use crate::Busy;
use crate::calibration::{Judged, Minimizer, Phase, Progress, Refusal, Settings, enough_samples};
use crate::robot::{ArmIndex, OF_ROBOT, Robot};
use crate::samples::Unknowns;
use core::mem::ManuallyDrop;
use heapless::Vec;

/// More than there are pieces of a start.
const PIECES: usize = 3 * PLACES + 6;

/// Calibrates all 24 parameters of a robot, and the placement of its instruments, from up to `ROWS` rows of readings:
/// heights, distances and single coordinates, in any mixture (the paper's FKM method).
///
/// The calls are those of [`Calibrator`](crate::calibration::Calibrator). There is room for N unknowns (the robot's 24
/// included), four planes and four points. A plane takes 3 unknowns, a point 3 or 4, a sensor frame 6, the transmissions
/// 15.
///
/// ```
/// use delta_cal::observations::{
///     FkmCalibrator, Height, Instruments, Observation, ObservationNoise, Plane,
/// };
/// use delta_cal::{Noise, Progress, Settings, SymmetricRobot, Tolerance};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let drawn = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let built = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..drawn }.robot()?;
/// // Gauge blocks on a plate somewhere below the robot.
/// let noise = ObservationNoise::new(Noise::new(0.02, 0.0)?, 0.02, 0.02)?;
/// let instruments = Instruments { planes: &[Plane::default()], ..Instruments::new(noise) };
/// let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.0035)?);
/// let mut touches = FkmCalibrator::<f64, 45, 27>::new(&drawn.robot()?, &instruments, &settings)?;
/// for k in 0..45 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     let height = Some(Height { plane: 0, height: built.forward(&joints)?.z + 560.0 });
///     touches.add(&Observation { height, ..Observation::at(joints) })?;
/// }
/// touches.solve()?;
/// while touches.step() == Progress::Working {}
/// let outcome = touches.outcome()?;
/// let [c, ..] = outcome.plane(&touches.instruments(), 0);
/// assert!((c + 560.0).abs() < 1.0);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct FkmCalibrator<T: Unknowns<N>, const ROWS: usize, const N: usize> {
    pub(super) robot: Robot<T>,
    settings: Settings<T>,
    pub(super) instruments: OwnInstruments<T>,
    /// Never dropped, as it needs no drop: the memory of a calibrator can simply be reused.
    pub(super) rows: ManuallyDrop<Vec<ObservationRow<T>, ROWS>>,
    prepared: Option<Prepared<T, N>>,
    /// The piece of the start that is located next, or [`PIECES`] and the number of rows that have their weights.
    ready: usize,
    minimizer: Option<ObservationMinimizer<T, N>>,
    outcome: Option<ObservationOutcome<T, N>>,
    phase: Phase,
}

impl<T: Unknowns<N>, const ROWS: usize, const N: usize> FkmCalibrator<T, ROWS, N> {
    /// A calibrator without observations; `robot` is the uncalibrated robot: the nominal values of the tolerance and
    /// the start of the iteration. The noise is that of the instruments; that of `settings` is not used, nor its free
    /// start.
    ///
    /// # Errors
    /// [`Refusal::TooManyUnknowns`] and [`Refusal::UnusableInstrument`].
    #[inline]
    pub fn new(
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
        settings: &Settings<T>,
    ) -> Result<Self, Refusal> {
        if let Some(instrument) = instruments.unusable() {
            return Err(Refusal::UnusableInstrument(instrument));
        }
        let unknowns = OF_ROBOT + instruments.unknowns();
        let own = OwnInstruments::new(instruments).filter(|_| unknowns <= N);
        let Some(instruments) = own else {
            let parameters = unknowns as u64;
            return Err(Refusal::TooManyUnknowns { parameters });
        };
        Ok(Self {
            robot: robot.clone(),
            settings: settings.with_free_start(false),
            instruments,
            rows: ManuallyDrop::new(Vec::new()),
            prepared: None,
            ready: 0,
            minimizer: None,
            outcome: None,
            phase: Phase::Collecting,
        })
    }

    /// Adds one observation. Discards the outcome of earlier ones.
    ///
    /// # Errors
    /// A fault of the observation, [`ObservationError::Full`] or [`ObservationError::Busy`]; nothing is added. Also
    /// [`ObservationError::Unreached`]: a solve starts from the nominal robot, where such a reading has no residual.
    pub fn add(&mut self, observation: &Observation<T>) -> Result<(), ObservationError> {
        if self.solving() {
            return Err(Busy.into());
        }
        observation.check(&self.robot, &self.instruments.view())?;
        let mut row = ObservationRow::new(*observation);
        row.place(&self.robot)?;
        self.rows.push(row).map_err(|_| ObservationError::Full)?;
        self.phase = Phase::Collecting;
        Ok(())
    }

    /// Starts a solve; does nothing if one is in progress or finished.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`], or the refusal already known for these observations.
    pub fn solve(&mut self) -> Result<(), Refusal> {
        let (samples, needed) = (self.samples(), self.settings.samples_needed());
        self.phase.start(|| {
            self.prepared = None;
            self.ready = 0;
            self.minimizer = None;
            if samples < needed {
                return Err(Refusal::TooFewSamples {
                    arm: ArmIndex::First,
                    samples,
                    needed,
                });
            }
            Ok(())
        })
    }

    /// One step of the solve started by [`solve`](Self::solve); does nothing once finished. The first steps check
    /// the rows and locate one instrument each: their duration grows with the number of rows.
    pub fn step(&mut self) -> Progress {
        if !self.solving() {
            return Progress::Finished;
        }
        let step = self.advance();
        self.phase.stepped(step)
    }

    fn advance(&mut self) -> Result<Progress, Refusal> {
        let instruments = self.instruments.view();
        let rows = self.rows.as_mut_slice();
        let Some(prepared) = &mut self.prepared else {
            let begun = Prepared::begun(&self.robot, &instruments, rows)?;
            self.prepared = Some(begun);
            return Ok(Progress::Working);
        };
        let Some(weighed) = self.ready.checked_sub(PIECES) else {
            let start = &mut prepared.start;
            let more = start.locate(&self.robot, &instruments, rows, self.ready);
            self.ready = if more { self.ready + 1 } else { PIECES };
            return Ok(Progress::Working);
        };
        if let Some(row) = rows.get_mut(weighed) {
            self.ready += 1;
            prepared.weigh(&self.robot, &instruments, row, |_, _| None);
            return Ok(Progress::Working);
        }
        let problem = ObservationProblem {
            robot: &self.robot,
            instruments: &instruments,
            rows,
            prepared: Held::Lent(prepared),
        };
        if let (Some(minimizer), Some(outcome)) = (&mut self.minimizer, &mut self.outcome) {
            if minimizer.is_done() {
                problem.complete(outcome)?;
                return Ok(Progress::Finished);
            }
            minimizer.step(&problem, &mut outcome.estimate)?;
            return Ok(Progress::Working);
        }
        Self::vacate(&mut self.outcome, &self.robot);
        Self::begin(&mut self.minimizer, &problem, &self.settings)?;
        Ok(Progress::Working)
    }

    #[inline(never)] // with `begin` 6 kB of stack, 18 kB built for size
    fn vacate(outcome: &mut Option<ObservationOutcome<T, N>>, robot: &Robot<T>) {
        *outcome = Some(ObservationOutcome::vacant(robot));
    }

    #[inline(never)] // see `vacate`
    fn begin(
        minimizer: &mut Option<ObservationMinimizer<T, N>>,
        problem: &ObservationProblem<'_, T, N>,
        settings: &Settings<T>,
    ) -> Result<(), Refusal> {
        enough_samples(&problem.extent(), ArmIndex::First, settings)?;
        let prior = problem.prior(settings);
        minimizer
            .insert(Minimizer::unstarted(ArmIndex::First, prior, settings))
            .begin(problem);
        Ok(())
    }

    /// The calibrated robot and the placement of the instruments, or the reason for refusal.
    ///
    /// # Errors
    /// A [`Refusal`]: keep the robot's current parameters. [`Refusal::Unfinished`] before the last step.
    pub fn outcome(&self) -> Result<&ObservationOutcome<T, N>, Refusal> {
        self.phase.outcome(self.outcome.as_ref())
    }

    /// Runs the whole solve at once, if there is time for it.
    ///
    /// # Errors
    /// Same as [`outcome`](Self::outcome).
    pub fn calibrate(&mut self) -> Result<ObservationOutcome<T, N>, Refusal> {
        self.solve()?;
        while self.step() == Progress::Working {}
        self.outcome().cloned()
    }

    /// Aborts a solve and discards the outcome. The observations stay.
    pub fn stop(&mut self) {
        self.phase = Phase::Collecting;
    }

    /// Discards the observations and everything solved from them.
    pub fn reset(&mut self) {
        self.rows.clear();
        self.prepared = None;
        self.ready = 0;
        self.minimizer = None;
        self.outcome = None;
        self.stop();
    }

    /// Whether a solve is in progress, during which no observation is accepted.
    pub const fn solving(&self) -> bool {
        self.phase.solving()
    }

    /// Whether a solve has finished and nothing was added since: there is an outcome or a refusal.
    pub const fn finished(&self) -> bool {
        self.phase.finished()
    }

    /// Number of observations added.
    pub fn samples(&self) -> u64 {
        self.rows.len() as u64
    }

    /// The instruments the readings refer to.
    pub fn instruments(&self) -> Instruments<'_, T> {
        self.instruments.view()
    }

    /// The uncalibrated robot.
    pub const fn robot(&self) -> &Robot<T> {
        &self.robot
    }

    /// What the calibration assumes.
    pub const fn settings(&self) -> &Settings<T> {
        &self.settings
    }
}
