//! One calibration: adds samples, solves step by step, ends with an outcome or a refusal.

use crate::Number;
use delta_cal::calibration::{ArmOutcome, Estimator, Ikm, Joint};
use delta_cal::samples::SampleError;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::StreamCalibrator;
use delta_cal::{ArmIndex, Progress, Real, Refusal, Robot, Sample};
use delta_cal_protocol::{
    ArmReport, Begin, Estimator as Chosen, Fault, GateStatus, Geometry, Phase, SampleMessage,
};
use nalgebra::Vector3;

/// The calibrator of the estimator chosen at the start, as large as the joint calibrator. A firmware with a single
/// estimator holds that calibrator directly.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // in static memory either way
enum Stream<T: Real> {
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
    fn begin<E: Estimator>(
        place: &mut Option<Self>,
        variant: impl Fn(StreamCalibrator<T, E>) -> Self,
        nominal: &Robot<T>,
        begin: &Begin<T>,
    ) -> Result<(), Fault> {
        let (settings, selection) = begin.calibrator()?;
        *place = Some(variant(StreamCalibrator::new(
            nominal, &settings, &selection,
        )));
        Ok(())
    }

    const fn finished(&self) -> bool {
        either!(self, own => own.finished())
    }

    /// The calibrated robot.
    fn robot(&self) -> Result<Robot<T>, Refusal> {
        either!(self, own => own.outcome().map(|outcome| outcome.robot.clone()))
    }

    fn arm(&self, arm: ArmIndex) -> Result<ArmOutcome<T>, Refusal> {
        match self {
            Self::Arms(own) => own.outcome().map(|outcome| Ikm::arm(outcome, arm)),
            Self::Joint(own) => own.outcome().map(|outcome| outcome.arm(arm)),
        }
    }
}

/// The current calibration, if any. It is in static memory and takes up most of it.
#[derive(Debug)]
pub(crate) struct Session<T: Number> {
    /// The request that started it.
    begun: Option<Begin<T>>,
    stream: Option<Stream<T>>,
}

impl<T: Number> Session<T> {
    pub(crate) const fn none() -> Self {
        Self {
            begun: None,
            stream: None,
        }
    }

    /// Resumes the stored session. If that is impossible, there is no session.
    pub(crate) fn resume(
        &mut self,
        nominal: &Robot<T>,
        begin: &Begin<T>,
        snapshot: &[u8],
    ) -> Result<(), SnapshotError> {
        let begun = self.begin(nominal, begin);
        let restored = match &mut self.stream {
            Some(stream) if begun.is_ok() => either!(stream, own => own.restore(snapshot)),
            _ => Err(SnapshotError::Damaged),
        };
        if restored.is_err() {
            self.begun = None;
            self.stream = None;
        }
        restored
    }

    /// The session's number; 0 if there is none.
    pub(crate) fn number(&self) -> u32 {
        self.begun.as_ref().map_or(0, |begun| begun.session)
    }

    /// Number of samples received, including rejected ones.
    pub(crate) fn samples(&self) -> u32 {
        self.stream.as_ref().map_or(0, |stream| {
            u32::try_from(either!(stream, own => own.samples())).unwrap_or(u32::MAX)
        })
    }

    /// Starts a session without samples, unless the same session is already open: same number and settings.
    pub(crate) fn begin(&mut self, nominal: &Robot<T>, begin: &Begin<T>) -> Result<(), Fault> {
        if self.begun.as_ref() != Some(begin) {
            match begin.estimator {
                Chosen::Arms => Stream::begin(&mut self.stream, Stream::Arms, nominal, begin)?,
                Chosen::Joint => Stream::begin(&mut self.stream, Stream::Joint, nominal, begin)?,
            }
            self.begun = Some(*begin);
            log!(info, "session {=u32:08x} begun", begin.session);
        }
        Ok(())
    }

    /// Adds a sample exactly once.
    pub(crate) fn sample(&mut self, message: &SampleMessage<T>) -> Result<(), Fault> {
        let next = self.samples();
        let stream = self.of(message.session)?;
        if message.index > next {
            return Err(Fault::OutOfOrder { next });
        }
        if message.index < next {
            return Ok(());
        }
        let [x, y, z] = message.position;
        let sample = Sample {
            joints: message.joints,
            position: Vector3::new(x, y, z),
        };
        either!(stream, own => own.add(&sample)).map_err(|error| match error {
            SampleError::Busy(_) => Fault::Busy,
            error => Fault::Sample(error),
        })?;
        if let Some(alarm) = either!(stream, own => own.alarm()) {
            log!(warn, "session {=u32:08x}: {}", message.session, alarm);
        }
        Ok(())
    }

    /// Starts solving if all samples have arrived and no solve is in progress or finished.
    pub(crate) fn solve(&mut self, session: u32, samples: u32) -> Result<(), Fault> {
        let next = self.samples();
        let stream = self.of(session)?;
        if samples != next {
            return Err(Fault::OutOfOrder { next });
        }
        if let Err(refusal) = either!(stream, own => own.solve()) {
            log!(warn, "session {=u32:08x}: refused, {}", session, refusal);
        }
        Ok(())
    }

    /// One bounded step; returns whether there is more to do.
    pub(crate) fn step(&mut self) -> bool {
        let Some(stream) = &mut self.stream else {
            return false;
        };
        if stream.finished() {
            return false;
        }
        let working = either!(stream, own => own.step()) == Progress::Working;
        if !working && stream.finished() {
            log!(info, "session {=u32:08x}: solve finished", self.number());
        }
        working
    }

    /// Whether samples are being added or solved.
    pub(crate) fn calibrating(&self) -> bool {
        self.stream
            .as_ref()
            .is_some_and(|stream| !stream.finished())
    }

    /// What started the session, if it can be stored: it accepts samples and has no result.
    pub(crate) fn storable(&self) -> Option<&Begin<T>> {
        let stream = self.stream.as_ref()?;
        let storable = !either!(stream, own => own.solving()) && !stream.finished();
        self.begun.as_ref().filter(|_| storable)
    }

    /// Writes the samples; the number of bytes.
    pub(crate) fn snapshot(&self, bytes: &mut [u8]) -> Option<usize> {
        let written = either!(self.stream.as_ref()?, own => own.snapshot(bytes));
        Some(written.ok()?.len())
    }

    pub(crate) fn phase(&self) -> Phase {
        let Some(stream) = &self.stream else {
            return Phase::Idle;
        };
        let samples = self.samples();
        if either!(stream, own => own.solving()) {
            return Phase::Solving;
        }
        if !stream.finished() {
            return Phase::Collecting { samples };
        }
        match stream.robot() {
            Ok(robot) => Phase::Solved {
                samples,
                fingerprint: Geometry::of(&robot).fingerprint(),
            },
            Err(refusal) => Phase::CalibrationRefused { samples, refusal },
        }
    }

    pub(crate) fn gate(&self) -> Option<GateStatus> {
        let stream = self.stream.as_ref()?;
        either!(stream, own => Some(GateStatus::new(own.gate_counts()?, own.alarm())))
    }

    /// The calibrated robot.
    pub(crate) fn outcome(&mut self, session: u32) -> Result<Robot<T>, Fault> {
        let stream = self.of(session)?;
        stream.robot().map_err(|_| Fault::NoOutcome)
    }

    pub(crate) fn report(&mut self, session: u32, index: ArmIndex) -> Result<ArmReport<T>, Fault> {
        let stream = self.of(session)?;
        let arm = stream.arm(index).map_err(|_| Fault::NoOutcome)?;
        Ok(ArmReport::new(index, &arm))
    }

    /// The calibrator of the session with this number.
    fn of(&mut self, session: u32) -> Result<&mut Stream<T>, Fault> {
        let number = self.number();
        let stream = self.stream.as_mut().filter(|_| session == number);
        stream.ok_or(Fault::NoSession)
    }
}
