//! One calibration: samples in, solved step by step, an outcome or a refusal.

use crate::Number;
use delta_cal::calibration::Start;
use delta_cal::{
    ArmIndex, Calibrator, Noise, Progress, Refusal, Robot, RobotOutcome, RobotSolver, Sample,
    Settings, Tolerance,
};
use delta_cal_protocol::{ArmReport, Begin, Fault, Phase, SampleMessage, fingerprint};
use nalgebra::Vector3;

/// The calibration that is under way, if any. Lies in static memory: it is most of the firmware's.
#[derive(Debug)]
pub(crate) struct Session<T: Number> {
    /// What it was begun with.
    begin: Option<Begin<T>>,
    calibrator: Option<Calibrator<T>>,
    samples: u32,
    work: Work<T>,
}

/// What comes after the samples.
#[derive(Debug)]
#[allow(clippy::large_enum_variant)] // no allocation
enum Work<T: Number> {
    Collecting,
    /// The first step prepares the solver.
    Asked,
    Solving(RobotSolver<T>),
    Solved {
        outcome: RobotOutcome<T>,
        fingerprint: u32,
    },
    Refused(Refusal),
}

impl<T: Number> Session<T> {
    pub(crate) const fn none() -> Self {
        Self {
            begin: None,
            calibrator: None,
            samples: 0,
            work: Work::Collecting,
        }
    }

    /// 0 without one.
    pub(crate) const fn number(&self) -> u32 {
        match &self.begin {
            Some(begin) => begin.session,
            None => 0,
        }
    }

    /// Starts again without samples, unless it is the open session that is asked for: of the same number,
    /// and with the same settings.
    pub(crate) fn begin(&mut self, nominal: &Robot<T>, begin: &Begin<T>) -> Result<u32, Fault> {
        if begin.session == 0 {
            return Err(Fault::Settings);
        }
        if self.begin.as_ref() != Some(begin) {
            let settings = settings(begin)?;
            self.begin = Some(*begin);
            self.samples = 0;
            self.work = Work::Collecting;
            self.renew(nominal, &settings);
            info!("session {=u32:08x}: {}", begin.session, settings);
        }
        Ok(self.samples)
    }

    // Not inlined, here and below: what is done one after the other shares the stack.
    #[inline(never)]
    fn renew(&mut self, nominal: &Robot<T>, settings: &Settings<T>) {
        self.calibrator = Some(Calibrator::new(nominal, settings));
    }

    /// Takes a sample in, once; as many as were taken in so far.
    pub(crate) fn sample(&mut self, message: &SampleMessage<T>) -> Result<u32, Fault> {
        let next = self.samples;
        let solving = self.solving();
        let calibrator = self.open(message.session)?;
        if message.index < next {
            return Ok(next);
        }
        if message.index > next {
            return Err(Fault::OutOfOrder { next });
        }
        if solving {
            return Err(Fault::Busy);
        }
        let [x, y, z] = message.position;
        calibrator
            .add(&Sample {
                joints: message.joints,
                position: Vector3::new(x, y, z),
            })
            .map_err(Fault::Sample)?;
        self.samples = next.saturating_add(1);
        // An outcome of fewer samples is none of these.
        self.work = Work::Collecting;
        Ok(self.samples)
    }

    /// Starts solving, unless that has been done with these samples.
    pub(crate) fn solve(&mut self, session: u32, samples: u32) -> Result<(), Fault> {
        self.open(session)?;
        if samples != self.samples {
            return Err(Fault::OutOfOrder { next: self.samples });
        }
        if matches!(self.work, Work::Collecting) {
            info!("session {=u32:08x}: solving {} samples", session, samples);
            self.work = Work::Asked;
        }
        Ok(())
    }

    /// One bounded step; whether there is more to do.
    #[inline(never)]
    pub(crate) fn step(&mut self) -> bool {
        let Some(calibrator) = &mut self.calibrator else {
            return false;
        };
        let progress = match &mut self.work {
            Work::Asked => prepare(calibrator, &mut self.work),
            Work::Solving(solver) => advance(calibrator, solver),
            Work::Collecting | Work::Solved { .. } | Work::Refused(_) => return false,
        };
        match progress {
            Ok(Progress::Working) => return true,
            Ok(Progress::Finished) => self.finish(),
            Err(refusal) => self.refuse(refusal),
        }
        false
    }

    #[inline(never)]
    fn finish(&mut self) {
        let Work::Solving(solver) = &self.work else {
            return;
        };
        match solver.outcome() {
            Err(refusal) => self.refuse(refusal),
            Ok(outcome) => {
                for (arm, index) in outcome.arms.iter().zip(ArmIndex::ALL) {
                    info!(
                        "session {=u32:08x}: {} solved, {} iterations, condition {}, residual {}",
                        self.number(),
                        index,
                        arm.iterations,
                        arm.condition,
                        arm.residual_rms
                    );
                }
                let fingerprint = fingerprint(&outcome.robot.parameters());
                self.work = Work::Solved {
                    outcome,
                    fingerprint,
                };
            }
        }
    }

    fn refuse(&mut self, refusal: Refusal) {
        warning!("session {=u32:08x}: refused, {}", self.number(), refusal);
        self.work = Work::Refused(refusal);
    }

    /// Whether the solver is at work.
    pub(crate) const fn solving(&self) -> bool {
        matches!(self.work, Work::Asked | Work::Solving(_))
    }

    pub(crate) const fn phase(&self) -> Phase {
        if self.begin.is_none() {
            return Phase::Idle;
        }
        let samples = self.samples;
        match &self.work {
            Work::Collecting => Phase::Collecting { samples },
            Work::Asked => Phase::Solving {
                arm: ArmIndex::First,
            },
            Work::Solving(solver) => Phase::Solving { arm: solver.arm() },
            Work::Solved { fingerprint, .. } => Phase::Solved {
                samples,
                fingerprint: *fingerprint,
            },
            Work::Refused(refusal) => Phase::CalibrationRefused {
                samples,
                refusal: *refusal,
            },
        }
    }

    /// The calibrated robot and its fingerprint.
    pub(crate) fn outcome(&self, session: u32) -> Result<(&RobotOutcome<T>, u32), Fault> {
        if session == 0 || session != self.number() {
            return Err(Fault::NoSession);
        }
        match &self.work {
            Work::Solved {
                outcome,
                fingerprint,
            } => Ok((outcome, *fingerprint)),
            _ => Err(Fault::NoOutcome),
        }
    }

    #[inline(never)]
    pub(crate) fn report(&self, session: u32, index: ArmIndex) -> Result<ArmReport<T>, Fault> {
        let (outcome, _) = self.outcome(session)?;
        let [first, second, third] = &outcome.arms;
        let arm = match index {
            ArmIndex::First => first,
            ArmIndex::Second => second,
            ArmIndex::Third => third,
        };
        let [prior_share] = arm.prior_share.data.0;
        Ok(ArmReport {
            arm: index,
            parameters: arm.arm.parameters(),
            covariance: arm.covariance.map(|covariance| covariance.data.0),
            residual_rms: arm.residual_rms,
            estimated_noise: arm.estimated_noise,
            degrees_of_freedom: arm.degrees_of_freedom,
            samples: arm.samples,
            iterations: arm.iterations,
            termination: arm.termination,
            start: arm.start,
            condition: arm.condition,
            prior_share,
        })
    }

    fn open(&mut self, session: u32) -> Result<&mut Calibrator<T>, Fault> {
        if session == 0 || session != self.number() {
            return Err(Fault::NoSession);
        }
        self.calibrator.as_mut().ok_or(Fault::NoSession)
    }
}

#[inline(never)]
fn prepare<T: Number>(
    calibrator: &mut Calibrator<T>,
    work: &mut Work<T>,
) -> Result<Progress, Refusal> {
    *work = Work::Solving(RobotSolver::new(calibrator)?);
    Ok(Progress::Working)
}

#[inline(never)]
fn advance<T: Number>(
    calibrator: &Calibrator<T>,
    solver: &mut RobotSolver<T>,
) -> Result<Progress, Refusal> {
    solver.step(calibrator)
}

fn settings<T: Number>(begin: &Begin<T>) -> Result<Settings<T>, Fault> {
    let tolerance = begin
        .tolerance
        .map(|(length, angle)| Tolerance::new(length, angle))
        .transpose()
        .map_err(|_| Fault::Settings)?;
    let noise = begin
        .noise
        .map(|(position, joint)| Noise::new(position, joint))
        .transpose()
        .map_err(|_| Fault::Settings)?;
    Ok(Settings::default()
        .with_noise(noise)
        .with_tolerance(tolerance)
        .with_start(if begin.without_guess {
            Start::Free
        } else {
            Start::Nominal
        }))
}
