//! One calibration: samples in, solved step by step, an outcome or a refusal.

use crate::Number;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{AddError, Added, StreamCalibrator, StreamOutcome};
use delta_cal::{ArmIndex, Progress, Robot, RobotOutcome, Sample};
use delta_cal_protocol::{
    ArmReport, Begin, CovarianceBlock, Fault, GateStatus, Phase, SampleMessage, fingerprint,
};
use nalgebra::Vector3;

/// The calibration that is under way, if any. Lies in static memory: it is most of the firmware's.
#[derive(Debug)]
pub(crate) struct Session<T: Number> {
    /// What it was begun with.
    begin: Option<Begin<T>>,
    stream: Option<StreamCalibrator<T>>,
    /// What became of the last sample.
    last: Option<Added<T>>,
    /// Of the outcome, once there is one.
    fingerprint: Option<u32>,
}

impl<T: Number> Session<T> {
    pub(crate) const fn none() -> Self {
        Self {
            begin: None,
            stream: None,
            last: None,
            fingerprint: None,
        }
    }

    /// Goes on with the session that was stored. If that is not possible, there is no session.
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
            self.begin = None;
            self.stream = None;
        }
        restored
    }

    /// 0 without one.
    pub(crate) const fn number(&self) -> u32 {
        match &self.begin {
            Some(begin) => begin.session,
            None => 0,
        }
    }

    /// Samples that came, rejected and held-out ones included.
    pub(crate) fn samples(&self) -> u32 {
        let samples = self.stream.as_ref().map_or(0, StreamCalibrator::samples);
        u32::try_from(samples).unwrap_or(u32::MAX)
    }

    /// What became of the last sample.
    pub(crate) const fn last(&self) -> Option<Added<T>> {
        self.last
    }

    /// Begins a session without samples, unless the same session is open already: with the same number and
    /// the same settings.
    pub(crate) fn begin(&mut self, nominal: &Robot<T>, begin: &Begin<T>) -> Result<(), Fault> {
        if self.begin.as_ref() != Some(begin) {
            self.renew(nominal, begin)?;
            self.begin = Some(*begin);
            self.last = None;
            self.fingerprint = None;
            info!("session {=u32:08x} begun", begin.session);
        }
        Ok(())
    }

    // Not inlined, here and below: what is done one after the other shares the stack.
    #[inline(never)]
    fn renew(&mut self, nominal: &Robot<T>, begin: &Begin<T>) -> Result<(), Fault> {
        self.stream = Some(begin.calibrator(nominal)?);
        Ok(())
    }

    /// Takes a sample in, once.
    pub(crate) fn sample(&mut self, message: &SampleMessage<T>) -> Result<(), Fault> {
        let next = self.samples();
        let stream = self.open(message.session)?;
        if message.index < next {
            return Ok(());
        }
        if message.index > next {
            return Err(Fault::OutOfOrder { next });
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
        let alarm = stream.alarm();
        if let (Some(alarm), Added::Tested(_)) = (alarm, &added) {
            warning!("session {=u32:08x}: {}", message.session, alarm);
        }
        self.last = Some(added);
        self.fingerprint = None;
        Ok(())
    }

    /// Starts solving, if all samples have come and that is not under way or done.
    pub(crate) fn solve(&mut self, session: u32, samples: u32) -> Result<(), Fault> {
        let next = self.samples();
        let stream = self.open(session)?;
        if samples != next {
            return Err(Fault::OutOfOrder { next });
        }
        stream.solve();
        Ok(())
    }

    /// One bounded step; whether there is more to do.
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
        match stream.result() {
            Some(Ok(outcome)) => {
                let fingerprint = fingerprint(&outcome.robot().parameters());
                self.fingerprint = Some(fingerprint);
                info!(
                    "session {=u32:08x}: solved, {=u32:08x}",
                    self.number(),
                    fingerprint
                );
            }
            Some(Err(refusal)) => {
                warning!("session {=u32:08x}: refused, {}", self.number(), refusal);
            }
            None => {}
        }
        false
    }

    /// The session as it can be stored: it takes in samples, and has no result.
    pub(crate) fn storable(&self) -> Option<(&Begin<T>, &StreamCalibrator<T>)> {
        let stream = self.stream.as_ref();
        let stream = stream.filter(|stream| !stream.solving() && stream.result().is_none())?;
        Some((self.begin.as_ref()?, stream))
    }

    pub(crate) fn phase(&self) -> Phase {
        let Some(stream) = &self.stream else {
            return Phase::Idle;
        };
        let samples = self.samples();
        match (stream.result(), self.fingerprint) {
            (Some(Ok(_)), Some(fingerprint)) => Phase::Solved {
                samples,
                fingerprint,
            },
            (Some(Err(refusal)), _) => Phase::CalibrationRefused { samples, refusal },
            _ if stream.solving() => Phase::Solving { arm: stream.arm() },
            _ => Phase::Collecting { samples },
        }
    }

    pub(crate) fn gate(&self) -> Option<GateStatus> {
        let stream = self.stream.as_ref()?;
        Some(GateStatus {
            counts: *stream.gate_counts()?,
            alarm: stream.alarm(),
        })
    }

    /// The calibrated robot and its fingerprint.
    pub(crate) fn outcome(&self, session: u32) -> Result<(&StreamOutcome<T>, u32), Fault> {
        if session == 0 || session != self.number() {
            return Err(Fault::NoSession);
        }
        let result = self.stream.as_ref().and_then(StreamCalibrator::result);
        match (result, self.fingerprint) {
            (Some(Ok(outcome)), Some(fingerprint)) => Ok((outcome, fingerprint)),
            _ => Err(Fault::NoOutcome),
        }
    }

    #[inline(never)]
    pub(crate) fn report(&self, session: u32, index: ArmIndex) -> Result<ArmReport<T>, Fault> {
        let (outcome, _) = self.outcome(session)?;
        let arm = match outcome {
            StreamOutcome::Arms(RobotOutcome {
                arms: [first, second, third],
                ..
            }) => match index {
                ArmIndex::First => *first,
                ArmIndex::Second => *second,
                ArmIndex::Third => *third,
            },
            StreamOutcome::Joint(outcome) => outcome.arm(index),
        };
        let validations = self.stream.as_ref().and_then(StreamCalibrator::validations);
        Ok(ArmReport::new(index, &arm, validations))
    }

    /// A block of a joint outcome's covariance.
    #[inline(never)]
    pub(crate) fn covariance(
        &self,
        session: u32,
        rows: ArmIndex,
        columns: ArmIndex,
    ) -> Result<CovarianceBlock<T>, Fault> {
        match self.outcome(session)? {
            (StreamOutcome::Joint(outcome), _) => Ok(CovarianceBlock::new(outcome, rows, columns)),
            (StreamOutcome::Arms(_), _) => Err(Fault::NoOutcome),
        }
    }

    fn open(&mut self, session: u32) -> Result<&mut StreamCalibrator<T>, Fault> {
        if session == 0 || session != self.number() {
            return Err(Fault::NoSession);
        }
        self.stream.as_mut().ok_or(Fault::NoSession)
    }
}
