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

    /// Answers the gate's alarm: the run of rejected samples was wrong, and what was taken in before stays. It can be
    /// solved again.
    pub const fn acknowledge(&mut self) {
        if let Some(gate) = &mut self.calibrators.gate {
            gate.acknowledge();
        }
        if matches!(self.work, Work::Refused(StreamRefusal::Alarm(_))) {
            self.work = Work::Collecting;
        }
    }

    /// Drops all that came, for a robot that has changed: it is calibrated from the samples that come from now on, with
    /// the same robot before calibration, settings and options.
    pub fn begin_again(&mut self) {
        self.calibrators.begin_again();
        self.samples = 0;
        self.work = Work::Collecting;
        self.asked = false;
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

    /// What a run of rejections means, if there was one since the last was [acknowledged](Self::acknowledge).
    pub const fn alarm(&self) -> Option<Alarm> {
        match &self.calibrators.gate {
            Some(gate) => gate.alarm(),
            None => None,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::StreamCalibrator;
    use crate::calibration::{Progress, Settings, Solver, Tolerance};
    use crate::robot::{Robot, SymmetricRobot};
    use crate::samples::{Noise, Sample};
    use crate::stream::{Added, Alarm, Selection, StreamOptions, StreamRefusal, Verdict};

    const GATED: StreamOptions<f64> = StreamOptions {
        estimator: crate::stream::Estimator::Arms,
        selection: Selection::Gated { forgetting: None },
    };

    fn robot(forearm: f64) -> Robot<f64> {
        let robot = SymmetricRobot {
            base_radius: 194.0,
            platform_radius: 30.0,
            upper_arm: 260.0,
            forearm,
        };
        robot.robot().unwrap()
    }

    fn sample(robot: &Robot<f64>, k: u32) -> Sample<f64> {
        let t = f64::from(k);
        let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
        let position = robot.forward(&joints).unwrap();
        Sample { joints, position }
    }

    fn settings() -> Settings<f64> {
        Settings::default()
            .with_noise(Noise::new(0.02, 0.0).unwrap())
            .with_tolerance(Tolerance::new(0.5, 0.003).unwrap())
    }

    fn solved(stream: &mut StreamCalibrator<f64>) -> Result<f64, StreamRefusal> {
        stream.solve();
        while stream.step() == Progress::Working {}
        let outcome = stream.result().unwrap()?;
        Ok(outcome.robot().arms()[0].lb())
    }

    #[test]
    fn an_alarm_is_answered_and_a_changed_robot_calibrated_again() {
        let (nominal, truth, changed) = (robot(480.0), robot(480.4), robot(481.2));
        let mut stream = StreamCalibrator::new(&nominal, &settings(), &GATED);
        for k in 0..48 {
            let robot = if k < 40 { &truth } else { &changed };
            let added = stream.add(&sample(robot, k)).unwrap();
            assert_eq!(
                matches!(added, Added::Tested(Verdict::Rejected(_))),
                k >= 40
            );
        }
        let alarm = Alarm::RobotChanged { first: 40 };
        assert_eq!(solved(&mut stream), Err(StreamRefusal::Alarm(alarm)));
        // The run was wrong: what came before stays.
        stream.acknowledge();
        assert_eq!(stream.alarm(), None);
        assert!((solved(&mut stream).unwrap() - 480.4).abs() < 0.02);
        // Another run is another alarm.
        for k in 48..56 {
            stream.add(&sample(&changed, k)).unwrap();
        }
        assert_eq!(stream.alarm(), Some(Alarm::RobotChanged { first: 48 }));
        // The robot has changed.
        stream.begin_again();
        assert_eq!((stream.alarm(), stream.samples()), (None, 0));
        let mut new = StreamCalibrator::new(&nominal, &settings(), &GATED);
        for k in 0..40 {
            assert_eq!(
                stream.add(&sample(&changed, k)),
                new.add(&sample(&changed, k))
            );
        }
        let found = solved(&mut stream);
        assert_eq!(found, solved(&mut new));
        assert!((found.unwrap() - 481.2).abs() < 0.02);
    }

    /// Without a tolerance the gate wants an estimate at the twelfth sample.
    #[test]
    fn what_is_restored_was_not_asked_to_solve() {
        let (nominal, truth) = (robot(480.0), robot(480.4));
        let settings = Settings::default();
        let mut stream = StreamCalibrator::new(&nominal, &settings, &GATED);
        let mut bytes = [0; StreamCalibrator::<f64>::SNAPSHOT_BYTES];
        for k in 0..12 {
            if k == 11 {
                stream.snapshot(&mut bytes).unwrap();
            }
            stream.add(&sample(&truth, k)).unwrap();
        }
        stream.solve();
        stream.restore(&bytes).unwrap();
        stream.add(&sample(&truth, 11)).unwrap();
        while stream.step() == Progress::Working {}
        assert!(stream.result().is_none() && !stream.solving());
    }

    /// What the samples are kept in depends on robot and noise alone.
    #[test]
    fn samples_outlast_a_change_of_how_they_are_solved() {
        let (nominal, truth) = (robot(480.0), robot(480.4));
        let all = StreamOptions::default();
        let changed = [
            settings().with_iteration_limit(20),
            settings().with_solver(Solver::GaussNewton),
            settings().with_tolerance(Tolerance::new(0.8, 0.003).unwrap()),
            settings().with_tolerance(None),
        ];
        let mut stream = StreamCalibrator::new(&nominal, &settings(), &all);
        for k in 0..30 {
            stream.add(&sample(&truth, k)).unwrap();
        }
        let mut bytes = [0; StreamCalibrator::<f64>::SNAPSHOT_BYTES];
        stream.snapshot(&mut bytes).unwrap();
        for settings in changed {
            let mut restored = StreamCalibrator::new(&nominal, &settings, &all);
            restored.restore(&bytes).unwrap();
            assert_eq!(restored.samples(), 30);
            assert!((solved(&mut restored).unwrap() - 480.4).abs() < 0.02);
        }
        let noise = settings().with_noise(Noise::new(0.03, 0.0).unwrap());
        let mut other = StreamCalibrator::new(&nominal, &noise, &all);
        assert!(other.restore(&bytes).is_err());
    }
}
