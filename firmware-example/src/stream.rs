//! A session's calibrator, for the estimator chosen at the start of the session.

use delta_cal::calibration::{ArmOutcome, Estimator as _, Ikm, Joint, Progress, Settings};
use delta_cal::samples::AddError;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{Added, Alarm, GateCounts, Selection, StreamCalibrator, StreamRefusal};
use delta_cal::{ArmIndex, Real, Robot, Sample};
use delta_cal_protocol::{Begin, Estimator, Fault};

/// As large as the joint calibrator. A firmware with a single estimator holds that calibrator directly.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // in static memory either way
pub(crate) enum Stream<T: Real> {
    Arms(StreamCalibrator<T, Ikm>),
    Joint(StreamCalibrator<T, Joint>),
}

macro_rules! either {
    ($stream:expr, $own:ident => $body:expr) => {
        match $stream {
            Stream::Arms($own) => $body,
            Stream::Joint($own) => $body,
        }
    };
}

impl<T: Real> Stream<T> {
    /// Maximum size of a snapshot, bytes.
    pub(crate) const SNAPSHOT_BYTES: usize = StreamCalibrator::<T, Joint>::SNAPSHOT_BYTES;

    #[inline(never)]
    pub(crate) fn begin(
        place: &mut Option<Self>,
        nominal: &Robot<T>,
        begin: &Begin<T>,
    ) -> Result<(), Fault> {
        let (settings, selection) = begin.calibrator()?;
        match begin.estimator {
            Estimator::Arms => Self::arms(place, nominal, &settings, &selection),
            Estimator::Joint => Self::joint(place, nominal, &settings, &selection),
        }
        Ok(())
    }

    // Separate, or the stack would hold both calibrators at once.
    #[inline(never)]
    fn arms(
        place: &mut Option<Self>,
        nominal: &Robot<T>,
        settings: &Settings<T>,
        selection: &Selection<T>,
    ) {
        *place = Some(Self::Arms(StreamCalibrator::new(
            nominal, settings, selection,
        )));
    }

    #[inline(never)]
    fn joint(
        place: &mut Option<Self>,
        nominal: &Robot<T>,
        settings: &Settings<T>,
        selection: &Selection<T>,
    ) {
        *place = Some(Self::Joint(StreamCalibrator::new(
            nominal, settings, selection,
        )));
    }

    pub(crate) fn add(&mut self, sample: &Sample<T>) -> Result<Added<T>, AddError> {
        either!(self, own => own.add(sample))
    }

    pub(crate) fn solve(&mut self) {
        // A refusal is stored for the request of the robot.
        let _ = either!(self, own => own.solve());
    }

    pub(crate) fn step(&mut self) -> Progress {
        either!(self, own => own.step())
    }

    pub(crate) const fn solving(&self) -> bool {
        either!(self, own => own.solving())
    }

    pub(crate) const fn finished(&self) -> bool {
        either!(self, own => own.finished())
    }

    /// The calibrated robot.
    #[inline(never)]
    pub(crate) fn robot(&self) -> Result<Robot<T>, StreamRefusal> {
        match self {
            Self::Arms(own) => own.outcome().map(|outcome| outcome.robot),
            Self::Joint(own) => own.outcome().map(|outcome| outcome.robot),
        }
    }

    #[inline(never)]
    pub(crate) fn arm(&self, arm: ArmIndex) -> Result<ArmOutcome<T>, StreamRefusal> {
        match self {
            Self::Arms(own) => own.outcome().map(|outcome| Ikm::arm(outcome, arm)),
            Self::Joint(own) => own.outcome().map(|outcome| outcome.arm(arm)),
        }
    }

    pub(crate) const fn samples(&self) -> u64 {
        either!(self, own => own.samples())
    }

    pub(crate) const fn gate_counts(&self) -> Option<&GateCounts> {
        either!(self, own => own.gate_counts())
    }

    pub(crate) const fn alarm(&self) -> Option<Alarm> {
        either!(self, own => own.alarm())
    }

    pub(crate) fn snapshot<'a>(&self, bytes: &'a mut [u8]) -> Result<&'a [u8], SnapshotError> {
        either!(self, own => own.snapshot(bytes))
    }

    pub(crate) fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        either!(self, own => own.restore(bytes))
    }
}
