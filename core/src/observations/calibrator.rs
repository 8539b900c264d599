//! The calibrator from any readings: rows and solver are one object.

use super::instruments::{Instruments, OF_ROBOT, OwnInstruments};
use super::observation::{Observation, ObservationError, ObservationRow};
use super::problem::{ObservationProblem, Prepared};
use super::solve::{ObservationMinimizer, ObservationOutcome};
use crate::Real;
use crate::calibration::{Minimizer, Phase, Progress, Refusal, Settings, enough_samples};
use crate::robot::{ArmIndex, Robot};
use core::mem::ManuallyDrop;
use heapless::Vec;

/// [`FkmCalibrator`] for heights above one plate: N = 27.
pub type TouchCalibrator<T, const ROWS: usize> = FkmCalibrator<T, ROWS, 27, 28, 406>;

/// Calibrates all 24 parameters of a robot, and where its instruments are, from up to `ROWS` rows of readings: heights,
/// distances, single coordinates, in any mixture (the paper's FKM method).
///
/// The calls are those of [`Calibrator`](crate::calibration::Calibrator). There is room for N unknowns, the robot's 24
/// among them, for four planes and for four points; M = N + 1, E = M (M + 1)/2. A plane takes 3, a point 3 or 4, the
/// frame of a sensor 6, the transmissions 15.
///
/// ```
/// use delta_cal::observations::{
///     Height, Instruments, Observation, ObservationNoise, Plane, PositionFrame, TouchCalibrator,
/// };
/// use delta_cal::{Noise, Progress, Settings, SymmetricRobot, Tolerance};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let drawn = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let built = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..drawn }.robot()?;
/// // Gauge blocks on a plate that lies somewhere below the robot.
/// let instruments = Instruments {
///     frame: PositionFrame::Base,
///     planes: &[Plane::default()],
///     points: &[],
///     noise: ObservationNoise::new(Noise::new(0.02, 0.0)?, 0.02, 0.02)?,
///     transmission: None,
/// };
/// let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.0035)?);
/// let mut touches = TouchCalibrator::<f64, 45>::new(&drawn.robot()?, &instruments, &settings)?;
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
pub struct FkmCalibrator<T: Real, const ROWS: usize, const N: usize, const M: usize, const E: usize>
{
    robot: Robot<T>,
    settings: Settings<T>,
    instruments: OwnInstruments<T>,
    /// Not dropped, as there is nothing to drop: a calibrator can lie in memory that is given up as it is.
    rows: ManuallyDrop<Vec<ObservationRow<T>, ROWS>>,
    prepared: Option<Prepared<T, N>>,
    /// Rows that have their weights.
    weighed: usize,
    minimizer: Option<ObservationMinimizer<T, N, M, E>>,
    outcome: Option<ObservationOutcome<T, N>>,
    phase: Phase,
}

impl<T: Real, const ROWS: usize, const N: usize, const M: usize, const E: usize>
    FkmCalibrator<T, ROWS, N, M, E>
{
    /// Without observations; `robot` is the robot before calibration, the nominal of the tolerance and the start of the
    /// iteration. The noise of `settings` is not used: that of the instruments is.
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
            robot: *robot,
            settings: *settings,
            instruments,
            rows: ManuallyDrop::new(Vec::new()),
            prepared: None,
            weighed: 0,
            minimizer: None,
            outcome: None,
            phase: Phase::Collecting,
        })
    }

    /// Takes in one observation. An outcome of those before is dropped. One that the nominal robot does not reach is
    /// kept and does not count.
    ///
    /// # Errors
    /// A fault of the observation, [`ObservationError::Full`] or [`ObservationError::Busy`]; nothing is taken in.
    pub fn add(&mut self, observation: &Observation<T>) -> Result<(), ObservationError> {
        if self.solving() {
            return Err(ObservationError::Busy);
        }
        observation.check(self.robot.drive(), &self.instruments.view())?;
        let mut row = ObservationRow::new(*observation);
        row.look_whether_reached(&self.robot)?;
        self.rows.push(row).map_err(|_| ObservationError::Full)?;
        self.phase = Phase::Collecting;
        Ok(())
    }

    /// Begins to solve; does nothing if that is under way or done.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`], or the refusal of these observations that is known already.
    pub fn solve(&mut self) -> Result<(), Refusal> {
        match self.phase {
            Phase::Solving | Phase::Finished => Ok(()),
            Phase::Refused(refusal) => Err(refusal),
            Phase::Collecting => {
                let (samples, needed) = (self.samples(), self.settings.samples_needed());
                if samples < needed {
                    let arm = ArmIndex::First;
                    let refusal = Refusal::TooFewSamples {
                        arm,
                        samples,
                        needed,
                    };
                    self.phase = Phase::Refused(refusal);
                    return Err(refusal);
                }
                self.prepared = None;
                self.weighed = 0;
                self.minimizer = None;
                self.phase = Phase::Solving;
                Ok(())
            }
        }
    }

    /// One step of what [`solve`](Self::solve) has begun; does nothing once finished. The first looks where the
    /// instruments are: its time grows with the number of rows.
    pub fn step(&mut self) -> Progress {
        if self.solving() {
            match self.advance() {
                Ok(Progress::Working) => return Progress::Working,
                Ok(Progress::Finished) => self.phase = Phase::Finished,
                Err(refusal) => self.phase = Phase::Refused(refusal),
            }
        }
        Progress::Finished
    }

    fn advance(&mut self) -> Result<Progress, Refusal> {
        let instruments = self.instruments.view();
        let rows = self.rows.as_mut_slice();
        let Some(prepared) = &mut self.prepared else {
            let begun = Prepared::begun(&self.robot, &instruments, rows)?;
            self.prepared = Some(begun);
            return Ok(Progress::Working);
        };
        if let Some(row) = rows.get_mut(self.weighed) {
            self.weighed += 1;
            row.take_weights(&self.robot, &instruments, prepared.start());
            prepared.count(&self.robot, row);
            return Ok(Progress::Working);
        }
        let problem = ObservationProblem {
            robot: &self.robot,
            instruments: &instruments,
            rows,
            prepared: *prepared,
        };
        if let (Some(minimizer), Some(outcome)) = (&mut self.minimizer, &mut self.outcome) {
            if minimizer.is_done() {
                problem.complete(outcome)?;
                return Ok(Progress::Finished);
            }
            minimizer.step(&problem, &mut outcome.estimate)?;
            return Ok(Progress::Working);
        }
        self.outcome = Some(ObservationOutcome::vacant(&self.robot));
        Self::begin(&mut self.minimizer, &problem, &self.settings)?;
        Ok(Progress::Working)
    }

    // Not inlined: what is done one after the other shares the stack.
    #[inline(never)]
    fn begin(
        minimizer: &mut Option<ObservationMinimizer<T, N, M, E>>,
        problem: &ObservationProblem<'_, T, N>,
        settings: &Settings<T>,
    ) -> Result<(), Refusal> {
        enough_samples::<T, _, N, M, E>(problem, ArmIndex::First, settings)?;
        let prior = problem.prior(settings);
        minimizer
            .insert(Minimizer::unstarted(ArmIndex::First, prior, settings))
            .begin(problem);
        Ok(())
    }

    /// The calibrated robot and the places of the instruments, or why there are none.
    ///
    /// # Errors
    /// A [`Refusal`]: the robot keeps its parameters. [`Refusal::Unfinished`] before the last step.
    pub fn outcome(&self) -> Result<&ObservationOutcome<T, N>, Refusal> {
        match self.phase {
            Phase::Collecting | Phase::Solving => Err(Refusal::Unfinished),
            Phase::Refused(refusal) => Err(refusal),
            Phase::Finished => self.outcome.as_ref().ok_or(Refusal::Unfinished),
        }
    }

    /// Solves to the end at once, where there is time for it.
    ///
    /// # Errors
    /// As [`outcome`](Self::outcome).
    pub fn calibrate(&mut self) -> Result<ObservationOutcome<T, N>, Refusal> {
        self.solve()?;
        while self.step() == Progress::Working {}
        self.outcome().cloned()
    }

    /// Gives up what [`solve`](Self::solve) has begun, and drops the outcome. The observations stay.
    pub fn stop(&mut self) {
        self.phase = Phase::Collecting;
    }

    /// Drops the observations and all that was solved from them.
    pub fn reset(&mut self) {
        self.rows.clear();
        self.stop();
    }

    /// Whether it solves, and takes no observation meanwhile.
    pub const fn solving(&self) -> bool {
        matches!(self.phase, Phase::Solving)
    }

    /// Whether a solve has finished, and nothing was added since: there is an outcome or a refusal.
    pub const fn finished(&self) -> bool {
        matches!(self.phase, Phase::Finished | Phase::Refused(_))
    }

    /// Observations taken in, those included that the nominal robot does not reach.
    pub fn samples(&self) -> u64 {
        self.rows.len() as u64
    }

    /// What the readings refer to.
    pub fn instruments(&self) -> Instruments<'_, T> {
        self.instruments.view()
    }

    /// The robot before calibration.
    pub const fn robot(&self) -> &Robot<T> {
        &self.robot
    }

    /// What the calibration assumes.
    pub const fn settings(&self) -> &Settings<T> {
        &self.settings
    }
}
