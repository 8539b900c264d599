//! One calibration: samples in, solved step by step, an outcome or a refusal.

use crate::Number;
use crate::observing::Observing;
use delta_cal::snapshot::SnapshotError;
use delta_cal::stream::{AddError, Added, StreamCalibrator, StreamOutcome, StreamRefusal};
use delta_cal::{ArmIndex, Progress, Robot, RobotOutcome, Sample};
use delta_cal_protocol::{
    ArmReport, Begin, BeginObservations, CovarianceBlock, Fault, GateStatus, Geometry,
    ObservationMessage, Phase, Places, SampleMessage,
};
use nalgebra::Vector3;

/// The calibration that is under way, if any. Lies in static memory: it is most of the firmware's.
#[derive(Debug)]
pub(crate) struct Session<T: Number> {
    /// What it was begun with.
    begun: Option<Begun<T>>,
    work: Work<T>,
    /// What became of the last sample.
    last: Option<Added<T>>,
    /// Of the outcome, once there is one.
    fingerprint: Option<u32>,
}

/// The request that a session was begun with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Begun<T> {
    Samples(Begin<T>),
    Observations(BeginObservations<T>),
}

impl<T> Begun<T> {
    const fn session(&self) -> u32 {
        match self {
            Self::Samples(begin) => begin.session,
            Self::Observations(begin) => begin.session,
        }
    }
}

/// In one place: a session is of one kind.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // no allocation
enum Work<T: Number> {
    None,
    Samples(StreamCalibrator<T>),
    Observations(Observing<T>),
}

impl<T: Number> Session<T> {
    pub(crate) const fn none() -> Self {
        Self {
            begun: None,
            work: Work::None,
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
        self.begin(nominal, &Begun::Samples(*begin))
            .map_err(|_| SnapshotError::Damaged)?;
        let restored = match &mut self.work {
            Work::Samples(stream) => stream.restore(snapshot),
            _ => Err(SnapshotError::Damaged),
        };
        if restored.is_err() {
            self.begun = None;
            self.work = Work::None;
        }
        restored
    }

    /// 0 without one.
    pub(crate) const fn number(&self) -> u32 {
        match &self.begun {
            Some(begun) => begun.session(),
            None => 0,
        }
    }

    /// Samples that came, rejected and held-out ones included, or observations.
    pub(crate) fn samples(&self) -> u32 {
        match &self.work {
            Work::None => 0,
            Work::Samples(stream) => u32::try_from(stream.samples()).unwrap_or(u32::MAX),
            Work::Observations(rows) => u32::try_from(rows.count()).unwrap_or(u32::MAX),
        }
    }

    /// What became of the last sample.
    pub(crate) const fn last(&self) -> Option<Added<T>> {
        self.last
    }

    /// Begins a session without samples, unless the same session is open already: with the same number and
    /// the same settings.
    pub(crate) fn begin(&mut self, nominal: &Robot<T>, begun: &Begun<T>) -> Result<(), Fault> {
        if self.begun.as_ref() != Some(begun) {
            match begun {
                Begun::Samples(begin) => self.renew(nominal, begin)?,
                Begun::Observations(begin) => self.renew_observations(nominal, begin)?,
            }
            self.begun = Some(*begun);
            self.last = None;
            self.fingerprint = None;
            info!("session {=u32:08x} begun", begun.session());
        }
        Ok(())
    }

    // Not inlined, here and below: what is done one after the other shares the stack.
    #[inline(never)]
    fn renew(&mut self, nominal: &Robot<T>, begin: &Begin<T>) -> Result<(), Fault> {
        self.work = Work::Samples(begin.calibrator(nominal)?);
        Ok(())
    }

    #[inline(never)]
    fn renew_observations(
        &mut self,
        nominal: &Robot<T>,
        begin: &BeginObservations<T>,
    ) -> Result<(), Fault> {
        self.work = Work::Observations(Observing::new(nominal, begin)?);
        Ok(())
    }

    /// Takes a sample in, once.
    pub(crate) fn sample(&mut self, message: &SampleMessage<T>) -> Result<(), Fault> {
        let here = self.expected(message.session, message.index);
        let Work::Samples(stream) = &mut self.work else {
            here?;
            return Err(Fault::OtherKind);
        };
        if !here? {
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
        let alarm = stream.alarm();
        if let (Some(alarm), Added::Tested(_)) = (alarm, &added) {
            warning!("session {=u32:08x}: {}", message.session, alarm);
        }
        self.last = Some(added);
        self.fingerprint = None;
        Ok(())
    }

    /// Takes an observation in, once.
    pub(crate) fn observation(&mut self, message: &ObservationMessage<T>) -> Result<(), Fault> {
        let here = self.expected(message.session, message.index);
        let Work::Observations(rows) = &mut self.work else {
            here?;
            return Err(Fault::OtherKind);
        };
        if !here? {
            return Ok(());
        }
        rows.add(message)?;
        self.last = Some(Added::Taken);
        self.fingerprint = None;
        Ok(())
    }

    /// Whether the row with this index is the next one; it is not if it has come already.
    fn expected(&self, session: u32, index: u32) -> Result<bool, Fault> {
        self.check(session)?;
        let next = self.samples();
        if index > next {
            return Err(Fault::OutOfOrder { next });
        }
        Ok(index == next)
    }

    /// Starts solving, if all samples have come and that is not under way or done.
    pub(crate) fn solve(&mut self, session: u32, samples: u32) -> Result<(), Fault> {
        self.check(session)?;
        let next = self.samples();
        if samples != next {
            return Err(Fault::OutOfOrder { next });
        }
        match &mut self.work {
            Work::None => {}
            Work::Samples(stream) => stream.solve(),
            Work::Observations(rows) => rows.solve(),
        }
        Ok(())
    }

    fn solving(&self) -> bool {
        match &self.work {
            Work::None => false,
            Work::Samples(stream) => stream.solving(),
            Work::Observations(rows) => rows.solving(),
        }
    }

    /// One bounded step; whether there is more to do.
    #[inline(never)]
    pub(crate) fn step(&mut self) -> bool {
        if !self.solving() {
            return false;
        }
        let working = match &mut self.work {
            Work::None => false,
            Work::Samples(stream) => stream.step() == Progress::Working,
            Work::Observations(rows) => !rows.step(),
        };
        if working {
            return true;
        }
        match self.result() {
            Some(Ok(outcome)) => {
                let fingerprint = Geometry::of(outcome.robot()).fingerprint();
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

    fn result(&self) -> Option<Result<&StreamOutcome<T>, StreamRefusal>> {
        match &self.work {
            Work::None => None,
            Work::Samples(stream) => stream.result(),
            Work::Observations(rows) => Some(match rows.result()? {
                Ok(observed) => Ok(&observed.outcome),
                Err(refusal) => Err((*refusal).into()),
            }),
        }
    }

    /// The session as it can be stored: it takes in samples, and has no result.
    pub(crate) fn storable(&self) -> Option<(&Begin<T>, &StreamCalibrator<T>)> {
        let (Work::Samples(stream), Some(Begun::Samples(begin))) = (&self.work, &self.begun) else {
            return None;
        };
        let storable = !stream.solving() && stream.result().is_none();
        storable.then_some((begin, stream))
    }

    pub(crate) fn phase(&self) -> Phase {
        let samples = self.samples();
        let arm = match &self.work {
            Work::None => return Phase::Idle,
            Work::Samples(stream) => stream.arm(),
            Work::Observations(_) => None,
        };
        match (self.result(), self.fingerprint) {
            (Some(Ok(_)), Some(fingerprint)) => Phase::Solved {
                samples,
                fingerprint,
            },
            (Some(Err(refusal)), _) => Phase::CalibrationRefused { samples, refusal },
            _ if self.solving() => Phase::Solving { arm },
            _ => Phase::Collecting { samples },
        }
    }

    pub(crate) fn gate(&self) -> Option<GateStatus> {
        let Work::Samples(stream) = &self.work else {
            return None;
        };
        Some(GateStatus {
            counts: *stream.gate_counts()?,
            alarm: stream.alarm(),
        })
    }

    /// The calibrated robot and its fingerprint.
    pub(crate) fn outcome(&self, session: u32) -> Result<(&StreamOutcome<T>, u32), Fault> {
        self.check(session)?;
        match (self.result(), self.fingerprint) {
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
        let validations = match &self.work {
            Work::Samples(stream) => stream.validations(),
            _ => None,
        };
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

    /// Where the instruments are.
    pub(crate) fn places(&self, session: u32) -> Result<Places<T>, Fault> {
        self.check(session)?;
        match &self.work {
            Work::Observations(rows) => match rows.result() {
                Some(Ok(observed)) => Ok(observed.places),
                _ => Err(Fault::NoOutcome),
            },
            _ => Err(Fault::OtherKind),
        }
    }

    const fn check(&self, session: u32) -> Result<(), Fault> {
        if session == 0 || session != self.number() {
            return Err(Fault::NoSession);
        }
        Ok(())
    }
}
