//! Calibration of a stream in bounded steps, with gating and forgetting.

use super::gate::{Gate, GateCounts, Innovation, Verdict};
use super::options::Selection;
use crate::calibration::limits::MOST_REJECTED;
use crate::calibration::{Calibrator, Estimator, Parts, Progress, Refusal, Samples, Settings};
use crate::robot::{ArmIndex, Robot};
use crate::samples::{Sample, SampleError};
use crate::snapshot::{SnapshotError, longest, read, write};
use crate::state::{Reader, State, Writer};
use crate::{Busy, Real, SettingError};
use core::mem::MaybeUninit;

/// Identifies a stream's snapshots, with the number of its calibrator: 1 for separate arms, 2 for joint.
const KIND: u8 = 4;

/// A [`Calibrator`] for a stream of samples, with a gate or forgetting. It runs the steps of all three in the right
/// order. Controller and host run the same code, so both accept and reject the same samples and compute the same bits.
///
/// ```
/// use delta_cal::calibration::Joint;
/// use delta_cal::{Noise, Progress, Sample, Settings, SymmetricRobot, Tolerance};
/// use delta_cal::stream::{Selection, StreamCalibrator, Verdict};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let nominal = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
/// let truth = SymmetricRobot { upper_arm: 260.4, ..nominal }.robot()?;
/// let settings = Settings::default().with_noise(Noise::new(0.02, 0.0)?).with_tolerance(Tolerance::new(0.5, 0.003)?);
/// let gated = Selection { gated: true, forgetting: None };
/// let mut stream = StreamCalibrator::<_, Joint>::new(&nominal.robot()?, &settings, &gated);
/// for k in 0..40 {
///     let t = f64::from(k);
///     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     let mut position = truth.forward(&joints)?;
///     if k == 30 {
///         position.x += 5.0; // the reflector slipped
///     }
///     let verdict = stream.add(&Sample { joints, position })?;
///     assert_eq!(matches!(verdict, Verdict::Rejected(_)), k == 30);
///     // Without a stated noise or tolerance, the gate first needs an estimate.
///     while stream.step() == Progress::Working {}
/// }
/// stream.solve()?;
/// while stream.step() == Progress::Working {} // between the cycles of a control loop
/// let outcome = stream.outcome()?;
/// // The platform's position, to within the noise.
/// let joints = [0.1, 0.2, -0.3];
/// assert!((outcome.robot.forward(&joints)? - truth.forward(&joints)?).norm() < 0.02);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct StreamCalibrator<T: Real, E: Estimator> {
    calibrator: Calibrator<T, E>,
    selection: Selection<T>,
    gated: Option<Gated<T, E>>,
    samples: u64,
    work: Work,
    /// Whether to solve as soon as the gate's estimate is finished.
    asked: bool,
}

/// The gate, and the samples of the separate arms if the calibrator does not hold these itself.
#[derive(Debug, Clone)]
struct Gated<T: Real, E: Estimator> {
    gate: Gate<T>,
    beside: <E as Parts>::Beside<T>,
}

#[derive(Debug, Clone, Copy)]
enum Work {
    Collecting,
    /// An estimate for the gate. The first step of each kind of work starts it.
    Estimate,
    Estimating,
    /// So many arms of it are the gate's.
    Adopting(usize),
    /// The solve that was requested.
    Solve,
    Solving,
    Solved,
    Refused(Refusal),
}

impl<T: Real, E: Estimator> StreamCalibrator<T, E> {
    /// Without samples; `robot`: uncalibrated, the nominal of the tolerance and the start of the iteration.
    #[inline(always)]
    pub fn new(robot: &Robot<T>, settings: &Settings<T>, selection: &Selection<T>) -> Self {
        Self {
            calibrator: Calibrator::new(robot, settings),
            selection: *selection,
            gated: selection.gated.then(|| Gated {
                gate: Gate::new(robot, settings),
                beside: E::beside(robot, settings),
            }),
            samples: 0,
            work: Work::Collecting,
            asked: false,
        }
    }

    /// The same in its place, whatever the caller's optimisation makes of the value.
    pub fn new_in<'a>(
        place: &'a mut MaybeUninit<Self>,
        robot: &Robot<T>,
        settings: &Settings<T>,
        selection: &Selection<T>,
    ) -> &'a mut Self {
        place.write(Self::new(robot, settings, selection))
    }

    /// Adds one sample, after testing it if there is a gate. Discards the outcome of earlier samples, unless this one is
    /// rejected.
    ///
    /// With a gate, some work is left after it: an arm takes in its samples, and its prediction is linearised anew. One
    /// [`step`](Self::step) after each sample does that; otherwise the next `add` does it first, with the same results,
    /// and takes up to twice as long.
    ///
    /// # Errors
    /// An invalid number, or a solve in progress; nothing has changed.
    pub fn add(&mut self, sample: &Sample<T>) -> Result<Verdict<T>, SampleError> {
        self.check_idle()?;
        let forgetting = self.selection.forgetting;
        let mut work = Work::Collecting;
        // Handed on as it is returned: where size counts, a copy of it takes as long as a whole test.
        let verdict = match &mut self.gated {
            None => {
                match &forgetting {
                    Some(forgetting) => self.calibrator.add_forgetting(sample, forgetting)?,
                    None => self.calibrator.add(sample)?,
                }
                Ok(Verdict::Ungated)
            }
            Some(Gated { gate, beside }) => {
                let (arms, others) = E::arms(&mut self.calibrator.samples, beside);
                let verdict = T::gate_add(gate, arms, sample, forgetting.as_ref());
                match (&verdict, others, &forgetting) {
                    (Err(_), ..) => return verdict,
                    (Ok(Verdict::Rejected(_)), ..) => work = self.work,
                    (_, None, _) => {}
                    (_, Some(own), None) => own.push(sample),
                    (_, Some(own), Some(forgetting)) => own.push_forgetting(sample, forgetting),
                }
                if let Work::Collecting = work {
                    self.calibrator.stop();
                    if gate.wants_estimate() {
                        work = Work::Estimate;
                    }
                }
                verdict
            }
        };
        self.samples = self.samples.saturating_add(1);
        self.work = work;
        verdict
    }

    /// Starts a solve unless one is in progress or finished. If the gate's estimate is being solved, the solve follows
    /// it. The work itself is done by [`step`](Self::step).
    ///
    /// # Errors
    /// The gate's reason for not solving, which discards an earlier outcome: an alarm until it is
    /// [acknowledged](Self::acknowledge), or too many rejections. The refusal already known for these samples.
    pub fn solve(&mut self) -> Result<(), Refusal> {
        match self.work {
            Work::Estimate | Work::Estimating | Work::Adopting(_) => self.asked = true,
            Work::Solve | Work::Solving => {}
            Work::Collecting | Work::Solved | Work::Refused(_) => {
                if let Some(refusal) = self.rejected_too_many() {
                    self.work = Work::Refused(refusal);
                }
                match self.work {
                    Work::Refused(refusal) => return Err(refusal),
                    Work::Collecting => self.work = Work::Solve,
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Answers the gate's alarm, and excuses all rejections so far: solving is possible again.
    ///
    /// Without forgetting, the run of rejected samples was wrong, and earlier samples stay. If the robot itself has
    /// changed, call [`reset`](Self::reset). With forgetting the robot may change: an alarm's answer discards the earlier
    /// samples, which would otherwise reject the changed robot's for ever, and the gate begins again, as when new. Its
    /// statistics and [`samples`](Self::samples) go on.
    pub fn acknowledge(&mut self) {
        let begins_again = self.alarm().is_some() && self.selection.forgetting.is_some();
        if let Some(Gated { gate, .. }) = &mut self.gated {
            gate.acknowledge();
        }
        if begins_again {
            self.begin_again();
        }
        if let Work::Refused(
            Refusal::RobotChanged { .. }
            | Refusal::EarlySamplesWrong { .. }
            | Refusal::TooManyRejected { .. },
        ) = self.work
        {
            self.work = Work::Collecting;
        }
    }

    /// Discards everything received, for a robot that has changed: as new, for the same uncalibrated robot, settings and
    /// selection, and with the same width of the gate.
    pub fn reset(&mut self) {
        if let Some(Gated { gate, .. }) = &mut self.gated {
            gate.counts = GateCounts::default();
        }
        self.begin_again();
        self.samples = 0;
    }

    fn begin_again(&mut self) {
        self.calibrator.reset();
        if let Some(Gated { gate, beside }) = &mut self.gated {
            let (arms, _) = E::arms(&mut self.calibrator.samples, beside);
            arms.reset();
            gate.begin_again(arms);
        }
        self.work = Work::Collecting;
        self.asked = false;
    }

    /// Aborts a solve and discards the outcome. The samples stay. An estimate of the gate that is aborted is solved again
    /// at the next sample.
    pub fn stop(&mut self) {
        self.calibrator.stop();
        self.work = Work::Collecting;
        self.asked = false;
    }

    fn check_idle(&self) -> Result<(), Busy> {
        if self.solving() { Err(Busy) } else { Ok(()) }
    }

    /// The gate's reason for not solving.
    fn rejected_too_many(&self) -> Option<Refusal> {
        let Gated { gate, .. } = self.gated.as_ref()?;
        if let Some(alarm) = gate.alarm {
            return Some(alarm);
        }
        let (taken, rejected) = gate.unexcused();
        let samples = taken.saturating_add(rejected);
        (rejected.saturating_mul(MOST_REJECTED) > samples)
            .then_some(Refusal::TooManyRejected { rejected, samples })
    }

    /// One bounded step of the pending work. After the last step of a solve there is an outcome; after the last step of
    /// an estimate for the gate, the next sample can be added. A step after each sample also relieves the next
    /// [`add`](Self::add) of what the gate has left to do.
    pub fn step(&mut self) -> Progress {
        if !self.catch_up() {
            self.advance();
        }
        if self.solving() {
            Progress::Working
        } else {
            Progress::Finished
        }
    }

    /// What the gate has left to do after a sample; returns whether there was any. It comes before all other work, so
    /// that the results are the same at whatever call it is done.
    fn catch_up(&mut self) -> bool {
        let forgetting = self.selection.forgetting;
        let Some(Gated { gate, beside }) = &mut self.gated else {
            return false;
        };
        let (arms, _) = E::arms(&mut self.calibrator.samples, beside);
        T::gate_catch_up(gate, arms, forgetting.as_ref())
    }

    fn advance(&mut self) {
        self.work = match self.work {
            Work::Estimate => match self.calibrator.solve() {
                Ok(()) => Work::Estimating,
                Err(_) => self.end_estimate(),
            },
            Work::Adopting(arms) => self.adopt(arms),
            Work::Solve => match self.calibrator.solve() {
                Ok(()) => Work::Solving,
                Err(refusal) => Work::Refused(refusal),
            },
            Work::Estimating if self.calibrator.step() == Progress::Finished => Work::Adopting(0),
            Work::Solving if self.calibrator.step() == Progress::Finished => Work::Solved,
            work => work,
        };
        if !self.solving() && core::mem::take(&mut self.asked) {
            // A refusal is stored for the outcome.
            let _ = self.solve();
        }
    }

    /// The gate continues, with or without a new estimate.
    fn end_estimate(&mut self) -> Work {
        self.calibrator.stop();
        if let Some(Gated { gate, .. }) = &mut self.gated {
            gate.needed = gate.needed.saturating_mul(2);
        }
        Work::Collecting
    }

    /// One arm a step: it is linearised anew.
    fn adopt(&mut self, arms: usize) -> Work {
        let robot = self.calibrator.outcome().map(E::robot).cloned();
        let (Some(gated), Ok(robot), Some(arm)) = (&mut self.gated, robot, ArmIndex::ALL.get(arms))
        else {
            return self.end_estimate();
        };
        let (samples, _) = E::arms(&mut self.calibrator.samples, &mut gated.beside);
        gated.gate.adopt(samples, *arm, robot.arm(*arm));
        Work::Adopting(arms + 1)
    }

    /// Whether work is pending; until it is done, no sample is accepted.
    pub const fn solving(&self) -> bool {
        matches!(
            self.work,
            Work::Estimate | Work::Estimating | Work::Adopting(_) | Work::Solve | Work::Solving
        )
    }

    /// Whether a requested solve has finished and no sample was added since: there is an outcome or a refusal.
    pub const fn finished(&self) -> bool {
        matches!(self.work, Work::Solved | Work::Refused(_))
    }

    /// The calibrated robot, until the next sample is added.
    ///
    /// # Errors
    /// Why the samples do not calibrate the robot; [`Refusal::Unfinished`] before the last step.
    pub fn outcome(&self) -> Result<&E::Outcome<T>, Refusal> {
        match self.work {
            Work::Refused(refusal) => Err(refusal),
            Work::Solved => self.calibrator.outcome(),
            _ => Err(Refusal::Unfinished),
        }
    }

    /// Which samples count.
    pub const fn selection(&self) -> &Selection<T> {
        &self.selection
    }

    /// What the calibration assumes.
    pub fn settings(&self) -> &Settings<T> {
        self.calibrator.settings()
    }

    /// Number of samples received, including rejected ones.
    pub const fn samples(&self) -> u64 {
        self.samples
    }

    /// Sets the width of the gate in σ; initially [`SUSPECTED`](crate::calibration::limits::SUSPECTED). Does nothing
    /// without a gate.
    ///
    /// # Errors
    /// A number that is not finite and positive.
    pub fn set_sigmas(&mut self, sigmas: T) -> Result<(), SettingError> {
        match &mut self.gated {
            Some(Gated { gate, .. }) => gate.set_sigmas(sigmas),
            None => Ok(()),
        }
    }

    /// The innovation of a sample in each arm, without adding or counting it.
    ///
    /// # Errors
    /// The verdict on a sample that cannot be tested: [`Verdict::Ungated`], [`Verdict::NoEstimate`] or
    /// [`Verdict::NoNoise`].
    pub fn innovations(&self, sample: &Sample<T>) -> Result<[Innovation<T>; 3], Verdict<T>> {
        let Gated { gate, .. } = self.gated.as_ref().ok_or(Verdict::Ungated)?;
        let samples = &self.calibrator.samples;
        gate.innovations(samples.nominal_arms(), samples.settings(), sample)
    }

    /// The gate's statistics, if there is a gate.
    pub const fn gate_counts(&self) -> Option<&GateCounts> {
        match &self.gated {
            Some(Gated { gate, .. }) => Some(&gate.counts),
            None => None,
        }
    }

    /// The meaning of a run of rejections, if there was one since the last [acknowledgement](Self::acknowledge):
    /// [`Refusal::RobotChanged`] or [`Refusal::EarlySamplesWrong`].
    pub const fn alarm(&self) -> Option<Refusal> {
        match &self.gated {
            Some(Gated { gate, .. }) => gate.alarm,
            None => None,
        }
    }
}

impl<T: Real, E: Estimator> State<T> for StreamCalibrator<T, E> {
    const BYTES: usize = <u64 as State<T>>::BYTES
        + <E as Parts>::Samples::<T>::BYTES
        + <E as Parts>::Beside::<T>::BYTES
        + Gate::<T>::BYTES;

    fn save(&self, to: &mut Writer<'_>) {
        State::<T>::save(&self.samples, to);
        self.calibrator.samples.save(to);
        if let Some(Gated { gate, beside }) = &self.gated {
            beside.save(to);
            gate.save(to);
        }
    }

    fn load(&mut self, from: &mut Reader<'_>) {
        State::<T>::load(&mut self.samples, from);
        self.calibrator.samples.load(from);
        if let Some(Gated { gate, beside }) = &mut self.gated {
            beside.load(from);
            gate.load(from);
            gate.displace(self.calibrator.samples.nominal_arms());
        }
        self.stop();
    }

    fn accepts(&self, bytes: &[u8]) -> bool {
        let of_samples = <u64 as State<T>>::BYTES + <E as Parts>::Samples::<T>::BYTES;
        let Some((own, rest)) = bytes.split_at_checked(of_samples) else {
            return false;
        };
        let own = own.get(<u64 as State<T>>::BYTES..).unwrap_or_default();
        self.calibrator.samples.accepts(own)
            && match &self.gated {
                None => rest.is_empty(),
                Some(Gated { gate, beside }) => rest
                    .split_at_checked(<E as Parts>::Beside::<T>::BYTES)
                    .is_some_and(|(of_beside, of_gate)| {
                        beside.accepts(of_beside) && gate.accepts(of_gate)
                    }),
            }
    }
}

impl<T: Real, E: Estimator> StreamCalibrator<T, E> {
    /// Size of the largest [`snapshot`](Self::snapshot), bytes.
    pub const SNAPSHOT_BYTES: usize = longest::<T, Self>();

    /// Writes the state of the stream into `bytes`, which must hold [`SNAPSHOT_BYTES`](Self::SNAPSHOT_BYTES), and
    /// returns the part used. Outcomes are not included: they are solved again.
    ///
    /// # Errors
    /// [`SnapshotError::BufferTooShort`]; [`SnapshotError::Busy`] during a solve.
    pub fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        self.check_idle()?;
        write(KIND + E::NUMBER, self.fingerprint(), self, bytes)
    }

    /// Replaces the state of this stream by that of a [`snapshot`](Self::snapshot) of the same robot, noise and
    /// selection, and with a gate of the same tolerance. From then on this stream gives bit-identical results to the
    /// original.
    ///
    /// # Errors
    /// Damaged bytes, or a snapshot of something else; [`SnapshotError::Busy`] during a solve. The stream is unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        self.check_idle()?;
        read(KIND + E::NUMBER, self.fingerprint(), self, bytes)
    }

    fn fingerprint(&self) -> u32 {
        let mut fingerprint = self.calibrator.marked();
        self.selection.mark(&mut fingerprint);
        if let Some(Gated { gate, .. }) = &self.gated {
            let [arm, ..] = self.calibrator.samples.nominal_arms();
            let drive = arm.arm().drive();
            self.settings().mark_prior(drive, &mut fingerprint);
            fingerprint.number(gate.sigmas);
        }
        fingerprint.finish()
    }
}
