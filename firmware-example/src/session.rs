//! One calibration: adds samples, solves step by step, ends with an outcome or a refusal.

use crate::Number;
use crate::stream::Stream;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{AddError, Added, StreamRefusal};
use delta_cal::{ArmIndex, Progress, Robot, Sample};
use delta_cal_protocol::{ArmReport, Begin, Fault, GateStatus, Geometry, Phase, SampleMessage};
use nalgebra::Vector3;

/// The current calibration, if any. It is in static memory and takes up most of it.
#[derive(Debug)]
pub(crate) struct Session<T: Number> {
    /// The request that started it.
    begun: Option<Begin<T>>,
    stream: Option<Stream<T>>,
    /// The fingerprint of the calibrated robot, or the reason for refusal, once known.
    result: Option<Result<u32, StreamRefusal>>,
}

impl<T: Number> Session<T> {
    pub(crate) const fn none() -> Self {
        Self {
            begun: None,
            stream: None,
            result: None,
        }
    }

    /// Resumes the stored session. If that is impossible, there is no session.
    pub(crate) fn resume(
        &mut self,
        nominal: &Robot<T>,
        begin: &Begin<T>,
        snapshot: &[u8],
    ) -> Result<(), SnapshotError> {
        self.begin(nominal, begin)
            .map_err(|_| SnapshotError::Damaged)?;
        let restored = match &mut self.stream {
            Some(stream) => stream.restore(snapshot),
            None => Err(SnapshotError::Damaged),
        };
        if restored.is_err() {
            self.begun = None;
            self.stream = None;
        }
        restored
    }

    /// The session's number; 0 if there is none.
    pub(crate) const fn number(&self) -> u32 {
        match &self.begun {
            Some(begun) => begun.session,
            None => 0,
        }
    }

    /// Number of samples received, including rejected ones.
    pub(crate) fn samples(&self) -> u32 {
        self.stream.as_ref().map_or(0, |stream| {
            u32::try_from(stream.samples()).unwrap_or(u32::MAX)
        })
    }

    /// Starts a session without samples, unless the same session is already open: same number and settings.
    // Not inlined, here and below, so that consecutive stages share the stack.
    #[inline(never)]
    pub(crate) fn begin(&mut self, nominal: &Robot<T>, begin: &Begin<T>) -> Result<(), Fault> {
        if self.begun.as_ref() != Some(begin) {
            Stream::begin(&mut self.stream, nominal, begin)?;
            self.begun = Some(*begin);
            self.result = None;
            info!("session {=u32:08x} begun", begin.session);
        }
        Ok(())
    }

    /// Adds a sample exactly once.
    pub(crate) fn sample(&mut self, message: &SampleMessage<T>) -> Result<(), Fault> {
        self.check(message.session)?;
        let next = self.samples();
        if message.index > next {
            return Err(Fault::OutOfOrder { next });
        }
        let Some(stream) = &mut self.stream else {
            return Err(Fault::NoSession);
        };
        if message.index < next {
            return Ok(());
        }
        let [x, y, z] = message.position;
        let sample = Sample {
            joints: message.joints,
            position: Vector3::new(x, y, z),
        };
        let added = stream.add(&sample).map_err(|error| match error {
            AddError::Sample(error) => Fault::Sample(error),
            AddError::Busy => Fault::Busy,
        })?;
        if let (Some(alarm), Added::Tested(_)) = (stream.alarm(), &added) {
            warning!("session {=u32:08x}: {}", message.session, alarm);
        }
        self.result = None;
        Ok(())
    }

    /// Starts solving if all samples have arrived and no solve is in progress or finished.
    pub(crate) fn solve(&mut self, session: u32, samples: u32) -> Result<(), Fault> {
        self.check(session)?;
        let next = self.samples();
        if samples != next {
            return Err(Fault::OutOfOrder { next });
        }
        if let Some(stream) = &mut self.stream {
            stream.solve();
            self.note_result();
        }
        Ok(())
    }

    /// One bounded step; returns whether there is more to do.
    #[inline(never)]
    pub(crate) fn step(&mut self) -> bool {
        let Some(stream) = &mut self.stream else {
            return false;
        };
        if !stream.solving() {
            return false;
        }
        if stream.step() == Progress::Working {
            return true;
        }
        self.note_result();
        false
    }

    /// Stores the result of a solve, if one has finished.
    #[inline(never)]
    fn note_result(&mut self) {
        let finished = self.stream.as_ref().filter(|stream| stream.finished());
        let Some(stream) = finished.filter(|_| self.result.is_none()) else {
            return;
        };
        let result = stream
            .robot()
            .map(|robot| Geometry::of(&robot).fingerprint());
        match result {
            Ok(fingerprint) => info!(
                "session {=u32:08x}: solved, {=u32:08x}",
                self.number(),
                fingerprint
            ),
            Err(refusal) => warning!("session {=u32:08x}: refused, {}", self.number(), refusal),
        }
        self.result = Some(result);
    }

    /// The session in a state that can be stored: accepting samples, without a result.
    pub(crate) fn storable(&self) -> Option<(&Begin<T>, &Stream<T>)> {
        let (stream, begin) = (self.stream.as_ref()?, self.begun.as_ref()?);
        let storable = !stream.solving() && !stream.finished();
        storable.then_some((begin, stream))
    }

    pub(crate) fn phase(&self) -> Phase {
        let Some(stream) = &self.stream else {
            return Phase::Idle;
        };
        let samples = self.samples();
        match self.result {
            Some(Ok(fingerprint)) => Phase::Solved {
                samples,
                fingerprint,
            },
            Some(Err(refusal)) => Phase::CalibrationRefused { samples, refusal },
            _ if stream.solving() => Phase::Solving,
            _ => Phase::Collecting { samples },
        }
    }

    pub(crate) fn gate(&self) -> Option<GateStatus> {
        let stream = self.stream.as_ref()?;
        Some(GateStatus::new(stream.gate_counts()?, stream.alarm()))
    }

    /// The calibrated robot and its fingerprint.
    pub(crate) fn outcome(&self, session: u32) -> Result<(Robot<T>, u32), Fault> {
        let (stream, fingerprint) = self.solved(session)?;
        let robot = stream.robot().map_err(|_| Fault::NoOutcome)?;
        Ok((robot, fingerprint))
    }

    fn solved(&self, session: u32) -> Result<(&Stream<T>, u32), Fault> {
        self.check(session)?;
        match (&self.stream, self.result) {
            (Some(stream), Some(Ok(fingerprint))) => Ok((stream, fingerprint)),
            _ => Err(Fault::NoOutcome),
        }
    }

    #[inline(never)]
    pub(crate) fn report(&self, session: u32, index: ArmIndex) -> Result<ArmReport<T>, Fault> {
        let (stream, _) = self.solved(session)?;
        let arm = stream.arm(index).map_err(|_| Fault::NoOutcome)?;
        Ok(ArmReport::new(index, &arm))
    }

    const fn check(&self, session: u32) -> Result<(), Fault> {
        if session == 0 || session != self.number() {
            return Err(Fault::NoSession);
        }
        Ok(())
    }
}
