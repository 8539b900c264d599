//! The dialogue of a calibration: send samples, solve, read the outcome, apply it.

use super::Number;
use super::client::{Client, Patience, unexpected};
use super::link::{DeviceError, Transport};
use delta_cal::{ArmIndex, Refusal, Robot, Sample};
use delta_cal_protocol::{
    ArmReport, Begin, ControlLoop, Fault, Geometry, ParameterSet, Parameters, Phase, Request,
    Response, SampleMessage, Status,
};

/// How often a calibration is started over if the controller loses it, and goes on after a restart.
const SESSIONS: u32 = 5;
/// Polls of a control loop that does not turn, and seconds of its turns, within which it switches.
const STILL: u32 = 50;
const LONGEST_SWITCH: u32 = 60;

/// The result for each arm, or the refusal.
pub type Outcome<T> = Result<[ArmReport<T>; 3], Refusal>;

/// A calibration that the controller has finished, accepted or refused.
#[derive(Debug, Clone, PartialEq)]
pub struct Finished<T> {
    /// Its session number.
    pub session: u32,
    /// The result for each arm, or the refusal.
    pub result: Outcome<T>,
    /// The parameters in use before the first sample, which the result is to replace.
    pub parameters_before: Parameters<T>,
    /// The controller's status before the first sample.
    pub status_before: Status<T>,
    /// The controller's status with the result.
    pub status_after: Status<T>,
}

impl<T: Number> Finished<T> {
    /// The calibrated robot's geometry.
    ///
    /// # Errors
    /// The controller refused the calibration.
    pub fn geometry(&self) -> Result<Geometry<T>, Refusal> {
        self.result.as_ref().map(geometry).map_err(|own| *own)
    }

    /// The control loop during the calibration: counters start at the first sample, not at the controller's start. If
    /// it has restarted since, at the restart.
    pub fn control_loop(&self) -> ControlLoop<T> {
        let [before, after] = [&self.status_before, &self.status_after].map(|own| &own.control);
        if after.turns < before.turns {
            return *after;
        }
        ControlLoop {
            turns: after.turns - before.turns,
            late: after.late.wrapping_sub(before.late),
            stops: after.stops.wrapping_sub(before.stops),
            ..*after
        }
    }
}

fn geometry<T: Number>(arms: &[ArmReport<T>; 3]) -> Geometry<T> {
    let transmissions = arms.map(|arm| arm.transmission);
    let inexact = transmissions.iter().any(Option::is_some);
    Geometry {
        arms: arms.map(|arm| arm.parameters),
        transmissions: inexact.then(|| transmissions.map(|own| own.unwrap_or([T::ZERO; 5]))),
    }
}

/// The controller no longer knows the session.
const LOST: DeviceError = DeviceError::Fault(Fault::NoSession);

/// Sends samples and waits for the controller's result; `progress` receives the number of samples taken. If the
/// controller restarts meanwhile, continues from what it has stored, or starts over.
///
/// # Errors
/// An unusable link, a rejected sample, a controller that keeps restarting. A refused calibration is not an error.
pub fn calibrate<T: Number, L: Transport>(
    client: &mut Client<L>,
    begin: &Begin<T>,
    samples: &[Sample<T>],
    progress: &mut dyn FnMut(usize),
) -> Result<Finished<T>, DeviceError> {
    for _ in 0..SESSIONS {
        match session(client, begin, samples, progress) {
            Ok(finished) => return Ok(finished),
            Err(DeviceError::Fault(Fault::NoSession)) => {}
            Err(error) => return Err(error),
        }
    }
    Err(DeviceError::SessionsLost(SESSIONS))
}

fn session<T: Number, L: Transport>(
    client: &mut Client<L>,
    begin: &Begin<T>,
    samples: &[Sample<T>],
    progress: &mut dyn FnMut(usize),
) -> Result<Finished<T>, DeviceError> {
    let session = client.new_session();
    let begin = Begin { session, ..*begin };
    match client.ask(&Request::Begin(begin))? {
        Response::Taken {
            session: open,
            next,
        } if (open, next) == (session, 0) => {}
        Response::Taken { .. } => return Err(LOST),
        other => return Err(unexpected(&other)),
    }
    // Not earlier: a controller that restarts in between counts from zero again.
    let status_before: Status<T> = client.status()?;
    if status_before.session != session {
        return Err(LOST);
    }
    let parameters_before = client.parameters(ParameterSet::Current)?;
    let (result, status_after) = solved(client, session, samples, progress)?;
    Ok(Finished {
        session,
        result,
        parameters_before,
        status_before,
        status_after,
    })
}

/// Sends the samples, starts the solve and waits for its result. A controller that has restarted keeps some of the
/// samples and no result: it gets those that it lost again, and solves again.
fn solved<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    samples: &[Sample<T>],
    progress: &mut dyn FnMut(usize),
) -> Result<(Outcome<T>, Status<T>), DeviceError> {
    let Patience {
        looks: most, pause, ..
    } = *client.patience();
    let (mut taken, mut solving) = (0, false);
    let (mut restarts, mut looks) = (0, 0);
    while restarts <= SESSIONS {
        progress(taken as usize);
        let sample = samples.get(taken as usize);
        let request = match sample {
            Some(sample) => Request::Sample(SampleMessage {
                session,
                index: taken,
                joints: sample.joints,
                position: sample.position.data.0[0],
            }),
            None if solving => Request::Status,
            None => Request::Solve {
                session,
                samples: taken,
            },
        };
        match (sample, client.ask(&request)?) {
            (
                Some(_),
                Response::Taken {
                    session: open,
                    next,
                },
            ) if (open, next) == (session, taken.saturating_add(1)) => {
                (taken, looks) = (next, 0);
            }
            (_, Response::Fault(Fault::OutOfOrder { next })) if next < taken => {
                restarts += 1;
                (taken, solving) = (next, false);
            }
            // The gate's estimate is solved first.
            (Some(_), Response::Fault(Fault::Busy)) if looks < most => {
                looks += 1;
                std::thread::sleep(pause);
            }
            (Some(_), Response::Fault(Fault::Sample(error))) => {
                return Err(DeviceError::Sample(taken, error));
            }
            (None, Response::Status(status)) if status.session == session => match status.phase {
                Phase::Solving if looks >= most => return Err(DeviceError::SolveHangs),
                Phase::Solving => {
                    looks += 1;
                    solving = true;
                    std::thread::sleep(pause);
                }
                Phase::CalibrationRefused { refusal, .. } => return Ok((Err(refusal), status)),
                Phase::Solved { fingerprint, .. } => {
                    if let Some(arms) = outcome(client, session, fingerprint)? {
                        return Ok((Ok(arms), status));
                    }
                    restarts += 1;
                    solving = false;
                }
                Phase::Collecting { .. } => {
                    restarts += 1;
                    solving = false;
                }
                _ => return Err(LOST),
            },
            (Some(_), Response::Taken { .. })
            | (_, Response::Fault(Fault::OutOfOrder { .. }))
            | (None, Response::Status(_)) => return Err(LOST),
            (_, other) => return Err(unexpected(&other)),
        }
    }
    Err(LOST)
}

/// The results of the three arms; `None` if the controller no longer has them.
fn outcome<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    fingerprint: u32,
) -> Result<Option<[ArmReport<T>; 3]>, DeviceError> {
    let mut arms = Vec::with_capacity(3);
    for arm in ArmIndex::ALL {
        match client.ask(&Request::Outcome { session, arm })? {
            Response::Outcome(report) if report.arm == arm => arms.push(report),
            Response::Fault(Fault::NoOutcome) => return Ok(None),
            other => return Err(unexpected(&other)),
        }
    }
    match <[ArmReport<T>; 3]>::try_from(arms) {
        Ok(arms) if geometry(&arms).fingerprint() == fingerprint => Ok(Some(arms)),
        _ => Err(DeviceError::OutcomeChanged),
    }
}

/// Applies a result and confirms that the control loop uses it. If the controller has restarted meanwhile, calibrates
/// again: the same samples give the same result.
///
/// # Errors
/// Same as [`calibrate`]; also a controller that cannot store the result, does not use it, or no longer uses
/// [`Finished::parameters_before`]; [`DeviceError::Unconfirmed`].
pub fn apply<T: Number, L: Transport>(
    client: &mut Client<L>,
    begin: &Begin<T>,
    samples: &[Sample<T>],
    calibration: &Finished<T>,
) -> Result<Parameters<T>, DeviceError> {
    let Ok(result) = calibration.geometry() else {
        return Err(DeviceError::Fault(Fault::NoOutcome));
    };
    let fingerprint = result.fingerprint();
    let mut session = calibration.session;
    for _ in 0..SESSIONS {
        let request = Request::<T>::Apply {
            session,
            fingerprint,
            from: calibration.parameters_before.generation,
        };
        match client.change(&request)? {
            Response::Parameters(_) => return in_use(client, fingerprint),
            Response::Fault(Fault::NoSession | Fault::NoOutcome) => {}
            other => return Err(unexpected(&other)),
        }
        // A controller that restarted after applying the result, but before answering, uses it already.
        if let Ok(parameters) = in_use(client, fingerprint) {
            return Ok(parameters);
        }
        let again =
            calibrate(client, begin, samples, &mut |_| {}).map_err(DeviceError::unconfirmed)?;
        if again.geometry().map(|geometry| geometry.fingerprint()) != Ok(fingerprint) {
            return Err(DeviceError::OutcomeChanged);
        }
        session = again.session;
    }
    Err(DeviceError::SessionsLost(SESSIONS))
}

/// Makes a controller use the geometry of a robot calibrated elsewhere, in place of the parameters of generation
/// `from`, and confirms that the control loop uses it.
///
/// # Errors
/// A robot that is invalid in the controller's number type, a controller that cannot store it, does not use it, or no
/// longer uses the parameters of `from`; [`DeviceError::Unconfirmed`].
pub fn adopt<T: Number, L: Transport>(
    client: &mut Client<L>,
    robot: &Robot<f64>,
    from: u32,
) -> Result<Parameters<T>, DeviceError> {
    let robot = robot.cast::<T>();
    let geometry = Geometry::of(&robot.map_err(|_| DeviceError::ImpossibleGeometry)?);
    match client.change(&Request::<T>::Adopt { from, geometry })? {
        Response::Parameters(_) => in_use(client, geometry.fingerprint()),
        other => Err(unexpected(&other)),
    }
}

/// The current parameters after a change, as soon as the control loop uses them, if they are those expected.
///
/// # Errors
/// Same as [`Client::ask`]; also [`DeviceError::NotInUse`] and [`DeviceError::Unconfirmed`].
pub fn in_use<T: Number, L: Transport>(
    client: &mut Client<L>,
    expected: u32,
) -> Result<Parameters<T>, DeviceError> {
    let parameters: Parameters<T> = client
        .parameters(ParameterSet::Current)
        .map_err(DeviceError::unconfirmed)?;
    let (mut first, mut last, mut still) = (None, None, 0);
    // The loop's turns are the clock: only the controller knows how long a blend takes.
    while parameters.geometry.fingerprint() == expected && still < STILL {
        let control = client
            .status::<T>()
            .map_err(DeviceError::unconfirmed)?
            .control;
        if control.fingerprint == expected {
            return Ok(parameters);
        }
        let turns = control
            .turns
            .wrapping_sub(*first.get_or_insert(control.turns));
        if turns > control.turns_a_second.saturating_mul(LONGEST_SWITCH) {
            break;
        }
        let turned = last.replace(control.turns) != Some(control.turns);
        still = if turned { 0 } else { still + 1 };
        std::thread::sleep(client.patience().pause);
    }
    Err(DeviceError::NotInUse)
}
