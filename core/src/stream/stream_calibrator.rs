//! The calibration of a stream in bounded steps, with gate and forgetting.

mod calibrators;
mod snapshot;
mod work;

use super::gate::{Alarm, GateCounts};
use super::stream_options::StreamOptions;
use super::stream_outcome::{AddError, Added, StreamOutcome};
use super::stream_refusal::StreamRefusal;
use crate::Real;
use crate::calibration::limits::MOST_REJECTED;
use crate::calibration::{Progress, Settings};
use crate::robot::{ArmIndex, Robot};
use crate::samples::Sample;
use calibrators::Calibrators;
use work::Work;

/// A robot's calibration from samples that come one by one. It contains the estimator, the gate and forgetting,
/// and does their steps in the right order. Controller and host run this code, so that both accept and reject the same
/// samples and compute the same bits.
///
/// ```
/// use delta_cal::{Noise, Progress, Sample, Settings, SymmetricRobot, Tolerance};
/// use delta_cal::stream::{Added, Estimator, Selection, StreamCalibrator, StreamOptions, StreamOutcome, Verdict};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.4, ..nominal }.robot()?;
/// let settings = Settings::default().with_noise(Noise::new(0.02, 0.0)?).with_tolerance(Tolerance::new(0.5, 0.003)?);
/// let options = StreamOptions { estimator: Estimator::Joint, selection: Selection::Gated { forgetting: None } };
/// let mut stream = StreamCalibrator::new(&nominal.robot()?, &settings, &options);
/// for k in 0..40 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     let mut position = truth.forward(&joints)?;
///     if k == 30 {
///         position.x += 5.0; // the reflector slipped
///     }
///     let added = stream.add(&Sample { joints, position })?;
///     assert_eq!(matches!(added, Added::Tested(Verdict::Rejected(_))), k == 30);
///     // Without a stated noise or tolerance the gate first needs an estimate.
///     while stream.step() == Progress::Working {}
/// }
/// stream.solve();
/// while stream.step() == Progress::Working {} // between the turns of a control loop
/// let Some(Ok(StreamOutcome::Joint(outcome))) = stream.result() else { panic!() };
/// // Where the platform is, to the noise.
/// let joints = [0.1, 0.2, -0.3];
/// assert!((outcome.robot.forward(&joints)? - truth.forward(&joints)?).norm() < 0.02);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct StreamCalibrator<T: Real> {
    calibrators: Calibrators<T>,
    samples: u64,
    work: Work<T>,
    /// Whether to solve as soon as the gate's estimate is finished.
    asked: bool,
}

impl<T: Real> StreamCalibrator<T> {
    /// Without samples; `robot` is the robot before calibration, the nominal of the tolerance and the start of the iteration.
    pub fn new(robot: &Robot<T>, settings: &Settings<T>, options: &StreamOptions<T>) -> Self {
        Self {
            calibrators: Calibrators::new(robot, settings, options),
            samples: 0,
            work: Work::Collecting,
            asked: false,
        }
    }

    /// Takes in one sample, or tests it first. A result of the samples before is dropped.
    ///
    /// # Errors
    /// A faulty number, or a solve that has not finished; nothing has changed.
    pub fn add(&mut self, sample: &Sample<T>) -> Result<Added<T>, AddError> {
        if self.solving() {
            return Err(AddError::Busy);
        }
        let (added, wants_estimate) = self.calibrators.add(sample)?;
        self.samples = self.samples.saturating_add(1);
        self.work = if wants_estimate {
            Work::Estimate
        } else {
            Work::Collecting
        };
        Ok(added)
    }

    /// Begins to solve, unless that is under way or done. If the gate's estimate is being solved, the solve begins
    /// after it. The work itself is done by [`step`](Self::step).
    pub fn solve(&mut self) {
        match self.work {
            Work::Collecting => {
                self.work = match self.rejected_too_many() {
                    Some(refusal) => Work::Refused(refusal),
                    None => Work::Solve,
                };
            }
            Work::Estimate | Work::Estimating(_) => self.asked = true,
            _ => {}
        }
    }

    /// The gate's objection to all samples.
    fn rejected_too_many(&self) -> Option<StreamRefusal> {
        let counts = self.gate_counts()?;
        if let Some(alarm) = self.alarm() {
            return Some(StreamRefusal::Alarm(alarm));
        }
        let samples = counts.taken.saturating_add(counts.rejected);
        (counts.rejected.saturating_mul(MOST_REJECTED) > samples).then_some(
            StreamRefusal::TooManyRejected {
                rejected: counts.rejected,
                samples,
            },
        )
    }

    /// One bounded step of what there is to solve. After the last step there is a result; if it was the gate's
    /// estimate that was solved, the next sample can be added.
    pub fn step(&mut self) -> Progress {
        self.work.step(&mut self.calibrators);
        if !self.solving() && core::mem::take(&mut self.asked) {
            self.solve();
        }
        if self.solving() {
            Progress::Working
        } else {
            Progress::Finished
        }
    }

    /// Whether there is something left to solve; until that is done, no sample is taken.
    pub const fn solving(&self) -> bool {
        !matches!(
            self.work,
            Work::Collecting | Work::Solved(_) | Work::Refused(_)
        )
    }

    /// The arm at work; `None` if all are, or none is.
    pub const fn arm(&self) -> Option<ArmIndex> {
        self.work.arm()
    }

    /// The result, once a solve has finished and until the next sample comes.
    ///
    /// # Errors
    /// Why the samples do not calibrate the robot.
    pub const fn result(&self) -> Option<Result<&StreamOutcome<T>, StreamRefusal>> {
        match &self.work {
            Work::Solved(outcome) => Some(Ok(outcome)),
            Work::Refused(refusal) => Some(Err(*refusal)),
            _ => None,
        }
    }

    /// The options that it was made with.
    pub const fn options(&self) -> &StreamOptions<T> {
        &self.calibrators.options
    }

    /// What the calibration assumes.
    pub const fn settings(&self) -> &Settings<T> {
        self.calibrators.arms.settings()
    }

    /// Samples that came, rejected ones included.
    pub const fn samples(&self) -> u64 {
        self.samples
    }

    /// What became of the samples at the gate, if there is one.
    pub const fn gate_counts(&self) -> Option<&GateCounts> {
        match &self.calibrators.gate {
            Some(gate) => Some(gate.counts()),
            None => None,
        }
    }

    /// What a run of rejections means, if there was one.
    pub const fn alarm(&self) -> Option<Alarm> {
        match &self.calibrators.gate {
            Some(gate) => gate.alarm(),
            None => None,
        }
    }
}
