//! The calibration of a stream in bounded steps, with gate and forgetting.

use super::gate::{Alarm, Gate, GateCounts, Verdict};
use super::options::{
    AddError, Added, Estimator, Selection, StreamOptions, StreamOutcome, StreamRefusal,
};
use crate::Real;
use crate::calibration::limits::MOST_REJECTED;
use crate::calibration::{
    Calibrator, JointCalibrator, JointSolver, Progress, Refusal, RobotOutcome, RobotSolver,
    Settings,
};
use crate::robot::{ArmIndex, Robot};
use crate::samples::{Sample, SampleError};
use crate::snapshot::{Kind, Reader, SnapshotError, State, Writer, longest, read, write};

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

#[derive(Debug, Clone, Copy)]
#[allow(clippy::large_enum_variant)] // no allocation
enum Work<T: Real> {
    Collecting,
    /// The gate wants an estimate. The first step of each kind of work prepares its solver.
    Estimate,
    Estimating(RobotSolver<T>),
    /// All samples have come.
    Solve,
    /// No sample waits any more.
    Begin,
    Arms(RobotSolver<T>),
    Joint(JointSolver<T>),
    Solved(StreamOutcome<T>),
    Refused(StreamRefusal),
}

impl<T: Real> Work<T> {
    const fn arm(&self) -> Option<ArmIndex> {
        match self {
            Self::Estimating(solver) | Self::Arms(solver) => Some(solver.arm()),
            _ => None,
        }
    }

    /// One step. A refusal ends the work; if it was the gate's estimate that was refused, the gate goes on without one.
    fn step(&mut self, calibrators: &mut Calibrators<T>) {
        let done = match self {
            Self::Collecting | Self::Solved(_) | Self::Refused(_) => Ok(()),
            Self::Estimate => {
                self.estimate(calibrators);
                Ok(())
            }
            Self::Estimating(_) => {
                self.go_on_estimating(calibrators);
                Ok(())
            }
            Self::Solve => {
                self.flush(calibrators);
                Ok(())
            }
            Self::Begin => self.begin(calibrators),
            Self::Arms(_) => self.go_on_with_arms(calibrators),
            Self::Joint(_) => self.go_on_jointly(calibrators),
        };
        if let Err(refusal) = done {
            *self = Self::Refused(refusal);
        }
    }

    // Not inlined, here and below: what is done one after the other shares the stack.
    #[inline(never)]
    fn estimate(&mut self, calibrators: &mut Calibrators<T>) {
        *self = match RobotSolver::new(&mut calibrators.arms) {
            Ok(solver) => Self::Estimating(solver),
            Err(_) => Self::Collecting,
        };
    }

    #[inline(never)]
    fn go_on_estimating(&mut self, calibrators: &mut Calibrators<T>) {
        let Self::Estimating(solver) = self else {
            return;
        };
        let finished = match solver.step(&calibrators.arms) {
            Ok(Progress::Working) => return,
            finished => finished,
        };
        if let (Ok(_), Ok(outcome), Some(gate)) =
            (finished, solver.outcome(), &mut calibrators.gate)
        {
            gate.adopt(&mut calibrators.arms, &outcome);
        }
        *self = Self::Collecting;
    }

    #[inline(never)]
    fn flush(&mut self, calibrators: &mut Calibrators<T>) {
        // Here already: with the begin of its solve it would be the longest of all steps.
        if let Some(joint) = &mut calibrators.joint {
            joint.flush();
        }
        *self = Self::Begin;
    }

    fn begin(&mut self, calibrators: &mut Calibrators<T>) -> Result<(), StreamRefusal> {
        match &mut calibrators.joint {
            Some(joint) => self.begin_jointly(joint),
            None => self.begin_with_arms(&mut calibrators.arms),
        }
    }

    #[inline(never)]
    fn begin_jointly(&mut self, joint: &mut JointCalibrator<T>) -> Result<(), StreamRefusal> {
        *self = Self::Joint(JointSolver::new(joint)?);
        Ok(())
    }

    #[inline(never)]
    fn begin_with_arms(&mut self, arms: &mut Calibrator<T>) -> Result<(), StreamRefusal> {
        *self = Self::Arms(RobotSolver::new(arms)?);
        Ok(())
    }

    #[inline(never)]
    fn go_on_with_arms(&mut self, calibrators: &Calibrators<T>) -> Result<(), StreamRefusal> {
        let Self::Arms(solver) = self else {
            return Ok(());
        };
        if let Some(outcome) = finished(solver, &calibrators.arms)? {
            *self = Self::Solved(StreamOutcome::Arms(outcome));
        }
        Ok(())
    }

    #[inline(never)]
    fn go_on_jointly(&mut self, calibrators: &Calibrators<T>) -> Result<(), StreamRefusal> {
        let (Self::Joint(solver), Some(joint)) = (&mut *self, &calibrators.joint) else {
            return Ok(());
        };
        if solver.step(joint) == Progress::Finished {
            *self = Self::Solved(StreamOutcome::Joint(solver.outcome(joint)?));
        }
        Ok(())
    }
}

fn finished<T: Real>(
    solver: &mut RobotSolver<T>,
    calibrator: &Calibrator<T>,
) -> Result<Option<RobotOutcome<T>>, Refusal> {
    Ok(match solver.step(calibrator)? {
        Progress::Working => None,
        Progress::Finished => Some(solver.outcome()?),
    })
}

#[derive(Debug, Clone, Copy)]
struct Calibrators<T: Real> {
    options: StreamOptions<T>,
    /// Empty where nothing needs it.
    arms: Calibrator<T>,
    joint: Option<JointCalibrator<T>>,
    /// What tests the samples, if anything does.
    gate: Option<Gate<T>>,
}

impl<T: Real> Calibrators<T> {
    #[inline(never)]
    fn new(robot: &Robot<T>, settings: &Settings<T>, options: &StreamOptions<T>) -> Self {
        let mut arms = Calibrator::new(robot, settings);
        let gate = match options.selection {
            Selection::All { .. } => None,
            Selection::Gated { forgetting } => {
                let gate = Gate::new(&mut arms);
                Some(match forgetting {
                    Some(forgetting) => gate.with_forgetting(forgetting),
                    None => gate,
                })
            }
        };
        Self {
            options: *options,
            arms,
            joint: match options.estimator {
                Estimator::Arms => None,
                Estimator::Joint => Some(JointCalibrator::new(robot, settings)),
            },
            gate,
        }
    }

    /// As before the first sample.
    #[inline(never)]
    fn begin_again(&mut self) {
        let (settings, options) = (*self.arms.settings(), self.options);
        *self = Self::new(&self.arms.robot(), &settings, &options);
    }

    /// What became of the sample, and whether the gate wants an estimate before the next.
    fn add(&mut self, sample: &Sample<T>) -> Result<(Added<T>, bool), SampleError> {
        let forgetting = self.options.forgetting();
        let (added, wants_estimate) = match &mut self.gate {
            None => {
                if self.joint.is_none() {
                    match &forgetting {
                        Some(forgetting) => self.arms.add_forgetting(sample, forgetting)?,
                        None => self.arms.add(sample)?,
                    }
                }
                (Added::Taken, false)
            }
            Some(gate) => {
                let verdict = gate.add(&mut self.arms, sample)?;
                (Added::Tested(verdict), gate.wants_estimate())
            }
        };
        if let Some(joint) = &mut self.joint
            && !matches!(added, Added::Tested(Verdict::Rejected(_)))
        {
            match &forgetting {
                Some(forgetting) => joint.add_forgetting(sample, forgetting)?,
                None => joint.add(sample)?,
            }
        }
        Ok((added, wants_estimate))
    }
}

impl<T: Real> State<T> for Calibrators<T> {
    const BYTES: usize = Calibrator::<T>::BYTES + JointCalibrator::<T>::BYTES + Gate::<T>::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        self.arms.save(to);
        if let Some(joint) = &self.joint {
            joint.save(to);
        }
        if let Some(gate) = &self.gate {
            gate.save(to);
        }
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        self.arms.load(from);
        if let Some(joint) = &mut self.joint {
            joint.load(from);
        }
        if let Some(gate) = &mut self.gate {
            gate.load(from);
            gate.displace(&self.arms);
        }
    }
}

impl<T: Real> State<T> for StreamCalibrator<T> {
    const BYTES: usize = <u64 as State<T>>::BYTES + Calibrators::<T>::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        State::<T>::save(&self.samples, to);
        self.calibrators.save(to);
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        State::<T>::load(&mut self.samples, from);
        self.calibrators.load(from);
        self.work = Work::Collecting;
        self.asked = false;
    }
}

impl<T: Real> StreamCalibrator<T> {
    /// How many bytes a [`snapshot`](Self::snapshot) takes at most.
    pub const SNAPSHOT_BYTES: usize = longest::<T, Self>();

    /// Writes what the stream has seen into `bytes`, of which there must be [`SNAPSHOT_BYTES`](Self::SNAPSHOT_BYTES), and
    /// returns the part that was written. Results are not part of it: they are solved again.
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; [`SnapshotError::Busy`] while something is being solved.
    pub fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        if self.solving() {
            return Err(SnapshotError::Busy);
        }
        write(Kind::Stream, self.fingerprint(), self, bytes)
    }

    /// Puts what a [`snapshot`](Self::snapshot) holds in place of what this stream has seen. It must be of the same
    /// robot, noise and options, and with a gate of the same tolerance. A solve that was asked for is none any more. From then on this stream gives the same results as the one that the snapshot is
    /// of, bit by bit.
    ///
    /// # Errors
    /// Bytes that are damaged, or a snapshot of something else; the stream is unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        read(Kind::Stream, self.fingerprint(), self, bytes)
    }

    fn fingerprint(&self) -> u32 {
        let mut fingerprint = self.calibrators.arms.marked();
        self.calibrators.options.mark(&mut fingerprint);
        if self.calibrators.gate.is_some() {
            Gate::mark(&self.calibrators.arms, &mut fingerprint);
        }
        fingerprint.finish()
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

    /// By how much the platform is off.
    fn solved(
        stream: &mut StreamCalibrator<f64>,
        truth: &Robot<f64>,
    ) -> Result<f64, StreamRefusal> {
        stream.solve();
        while stream.step() == Progress::Working {}
        let outcome = stream.result().unwrap()?;
        let at = |robot: &Robot<f64>| robot.forward(&[0.1, 0.2, -0.3]).unwrap();
        Ok((at(outcome.robot()) - at(truth)).norm())
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
        assert_eq!(
            solved(&mut stream, &truth),
            Err(StreamRefusal::Alarm(alarm))
        );
        // The run was wrong: what came before stays.
        stream.acknowledge();
        assert_eq!(stream.alarm(), None);
        assert!(solved(&mut stream, &truth).unwrap() < 0.02);
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
        let found = solved(&mut stream, &changed);
        assert_eq!(found, solved(&mut new, &changed));
        assert!(found.unwrap() < 0.02);
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
            assert!(solved(&mut restored, &truth).unwrap() < 0.02);
        }
        let noise = settings().with_noise(Noise::new(0.03, 0.0).unwrap());
        let mut other = StreamCalibrator::new(&nominal, &noise, &all);
        assert!(other.restore(&bytes).is_err());
    }
}
