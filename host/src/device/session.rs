//! The dialogue of a calibration: send samples, solve, read the outcome, apply it.

use super::Number;
use super::client::{Client, unexpected};
use super::link::{DeviceError, Transport};
use delta_cal::stream::StreamRefusal;
use delta_cal::{ArmIndex, Robot, Sample};
use delta_cal_protocol::{
    ArmReport, Begin, ControlLoop, Fault, Geometry, ParameterSet, Parameters, Phase, Request,
    Response, SampleMessage, Status,
};

/// How often a calibration is started over if the controller loses it.
const SESSIONS: u32 = 5;
/// Polls for the control loop to switch.
const LOOKS_AT_SWITCH: u32 = 50;

/// A calibration that the controller has finished, accepted or refused.
#[derive(Debug, Clone, PartialEq)]
pub struct Finished<T> {
    /// Its session number.
    pub session: u32,
    /// The result for each arm, or the refusal.
    pub result: Result<[ArmReport<T>; 3], StreamRefusal>,
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
    pub fn geometry(&self) -> Result<Geometry<T>, StreamRefusal> {
        self.result.as_ref().map(geometry).map_err(|own| *own)
    }

    /// The control loop during the calibration: counters start at the first sample, not at the controller's start.
    pub fn control_loop(&self) -> ControlLoop<T> {
        let [before, after] = [&self.status_before, &self.status_after].map(|own| &own.control);
        ControlLoop {
            turns: after.turns.wrapping_sub(before.turns),
            late: after.late.wrapping_sub(before.late),
            unreachable: after.unreachable.wrapping_sub(before.unreachable),
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
    let mut taken = 0;
    // Each round ends with a restart of the controller, which keeps some of the samples.
    for _ in 0..SESSIONS {
        send(client, session, samples, &mut taken, progress)?;
        let Some(status_after) = solve(client, session, &mut taken)? else {
            continue;
        };
        let result = match status_after.phase {
            Phase::CalibrationRefused { refusal, .. } => Err(refusal),
            Phase::Solved { fingerprint, .. } => match outcome(client, session) {
                Ok(arms) if geometry(&arms).fingerprint() == fingerprint => Ok(arms),
                Ok(_) => return Err(DeviceError::OutcomeChanged),
                Err(DeviceError::Fault(Fault::NoOutcome)) => continue,
                Err(broken) => return Err(broken),
            },
            _ => return Err(LOST),
        };
        return Ok(Finished {
            session,
            result,
            parameters_before,
            status_before,
            status_after,
        });
    }
    Err(LOST)
}

/// Sends the samples that the controller still lacks; it has the first `taken`. After a restart, sends those that it
/// lost again.
fn send<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    samples: &[Sample<T>],
    taken: &mut u32,
    progress: &mut dyn FnMut(usize),
) -> Result<(), DeviceError> {
    let (mut restarts, mut looks) = (0, 0);
    while let Some(sample) = samples.get(*taken as usize) {
        progress(*taken as usize);
        let index = *taken;
        let request = Request::Sample(SampleMessage {
            session,
            index,
            joints: sample.joints,
            position: sample.position.data.0[0],
        });
        match client.ask(&request)? {
            Response::Taken {
                session: open,
                next,
            } if (open, next) == (session, index.saturating_add(1)) => {
                *taken = next;
            }
            Response::Fault(Fault::OutOfOrder { next }) if next < index && restarts < SESSIONS => {
                restarts += 1;
                *taken = next;
            }
            Response::Taken { .. } | Response::Fault(Fault::OutOfOrder { .. }) => {
                return Err(LOST);
            }
            // The gate's estimate is solved first.
            Response::Fault(Fault::Busy) if looks < client.patience().looks => {
                looks += 1;
                std::thread::sleep(client.patience().pause);
            }
            Response::Fault(Fault::Sample(error)) => {
                return Err(DeviceError::Sample(index, error));
            }
            other => return Err(unexpected(&other)),
        }
    }
    progress(samples.len());
    Ok(())
}

/// Starts the solve and waits for it; `None` if the controller restarted and lacks samples or the result.
fn solve<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    taken: &mut u32,
) -> Result<Option<Status<T>>, DeviceError> {
    let samples = *taken;
    let mut request = Request::Solve { session, samples };
    for _ in 0..client.patience().looks {
        let status = match client.ask(&request)? {
            Response::Status(status) => status,
            Response::Fault(Fault::OutOfOrder { next }) if next < samples => {
                *taken = next;
                return Ok(None);
            }
            Response::Fault(Fault::OutOfOrder { .. }) => return Err(LOST),
            other => return Err(unexpected(&other)),
        };
        if status.session != session {
            return Err(LOST);
        }
        match status.phase {
            Phase::Solved { .. } | Phase::CalibrationRefused { .. } => return Ok(Some(status)),
            Phase::Solving => {}
            Phase::Collecting { .. } => return Ok(None),
            _ => return Err(LOST),
        }
        std::thread::sleep(client.patience().pause);
        request = Request::Status;
    }
    Err(DeviceError::SolveHangs)
}

fn outcome<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
) -> Result<[ArmReport<T>; 3], DeviceError> {
    let mut of = |arm| match client.ask(&Request::Outcome { session, arm })? {
        Response::Outcome(report) if report.arm == arm => Ok(report),
        other => Err(unexpected(&other)),
    };
    let [first, second, third] = ArmIndex::ALL;
    Ok([of(first)?, of(second)?, of(third)?])
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
    if parameters.geometry.fingerprint() == expected {
        for _ in 0..LOOKS_AT_SWITCH {
            let status = client.status::<T>().map_err(DeviceError::unconfirmed)?;
            if status.control.fingerprint == expected {
                return Ok(parameters);
            }
            std::thread::sleep(client.patience().pause);
        }
    }
    Err(DeviceError::NotInUse)
}
