//! The dialogue of a calibration: samples in, solve, outcome out, applied.

use super::client::{Client, unexpected};
use super::convert::geometry;
use super::error::DeviceError;
use super::number::Number;
use super::sending::Sending;
use super::solution::{ACROSS, Solution};
use super::transport::Transport;
use delta_cal::stream::{Added, StreamRefusal};
use delta_cal::{ArmIndex, Robot};
use delta_cal_protocol::{
    Adopt, ArmReport, CovarianceBlock, Fault, ParameterSet, Parameters, Phase, Request, Response,
    Status,
};

/// So often is a calibration begun again after the controller forgot it.
const SESSIONS: u32 = 5;
/// Looks at whether the control loop has switched.
const LOOKS_AT_SWITCH: u32 = 50;

/// How far it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// So many samples are taken in.
    Taken(usize),
    /// The controller is at work on this arm, or on all together.
    Solving(Option<ArmIndex>),
    /// The controller forgot everything; it begins again.
    BegunAgain,
}

/// A calibration that the controller has finished, one way or the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Finished<T> {
    /// Its session.
    pub session: u32,
    /// What came out.
    pub result: Result<Solution<T>, StreamRefusal>,
    /// What became of each measurement; `None` where the controller restarted before it could say so.
    pub added: Vec<Option<Added<T>>>,
    /// What was in use before the first sample, and is to be replaced.
    pub parameters_before: Parameters<T>,
    /// The controller before the first sample.
    pub status_before: Status<T>,
    /// The controller with the result.
    pub status_after: Status<T>,
}

/// Why a session does not go on.
enum Broken {
    /// The controller does not know it any more.
    Lost,
    Error(DeviceError),
}

impl From<DeviceError> for Broken {
    fn from(error: DeviceError) -> Self {
        match error {
            DeviceError::Fault(Fault::NoSession) => Self::Lost,
            other => Self::Error(other),
        }
    }
}

/// Sends the measurements and waits for what the controller makes of them. If the controller restarts meanwhile, goes on with
/// what it has stored, or begins again.
///
/// # Errors
/// A link that does not work, a row that is not taken, a controller that restarts over and
/// over. A calibration that is refused is no error.
pub fn calibrate<T: Number, L: Transport>(
    client: &mut Client<L>,
    sending: &Sending<T>,
    progress: &mut dyn FnMut(Step),
) -> Result<Finished<T>, DeviceError> {
    for _ in 0..SESSIONS {
        match session(client, sending, progress) {
            Ok(finished) => return Ok(finished),
            Err(Broken::Lost) => progress(Step::BegunAgain),
            Err(Broken::Error(error)) => return Err(error),
        }
    }
    Err(DeviceError::SessionsLost { sessions: SESSIONS })
}

fn session<T: Number, L: Transport>(
    client: &mut Client<L>,
    sending: &Sending<T>,
    progress: &mut dyn FnMut(Step),
) -> Result<Finished<T>, Broken> {
    let session = client.new_session();
    match client.ask(&sending.begin(session))? {
        Response::Taken {
            session: open,
            next: 0,
            ..
        } if open == session => {}
        Response::Taken { .. } => return Err(Broken::Lost),
        other => return Err(unexpected(&other).into()),
    }
    // Not before: a controller that restarts in between counts from zero again.
    let status_before: Status<T> = client.status()?;
    if status_before.session != session {
        return Err(Broken::Lost);
    }
    let parameters_before = client.parameters(ParameterSet::Current)?;
    let mut added = Vec::new();
    // Each round ends with a restart of the controller, which has kept some of the samples.
    for _ in 0..SESSIONS {
        send(client, session, sending, &mut added, progress)?;
        let Some(status_after) = solve(client, session, &mut added, progress)? else {
            continue;
        };
        let result = match status_after.phase {
            Phase::CalibrationRefused { refusal, .. } => Err(refusal),
            Phase::Solved { fingerprint, .. } => match solution(client, session, sending) {
                Ok(solution) if solution.fingerprint() == fingerprint => Ok(solution),
                Ok(_) => return Err(Broken::Error(DeviceError::OutcomeChanged)),
                Err(Broken::Error(DeviceError::Fault(Fault::NoOutcome))) => continue,
                Err(broken) => return Err(broken),
            },
            _ => return Err(Broken::Lost),
        };
        return Ok(Finished {
            session,
            result,
            added,
            parameters_before,
            status_before,
            status_after,
        });
    }
    Err(Broken::Lost)
}

/// Sends the measurements that the controller does not have yet. After a restart it asks again for those that it has lost.
fn send<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    sending: &Sending<T>,
    added: &mut Vec<Option<Added<T>>>,
    progress: &mut dyn FnMut(Step),
) -> Result<(), Broken> {
    let (mut restarts, mut looks) = (0, 0);
    while let Some(row) = sending.row(session, added.len()) {
        progress(Step::Taken(added.len()));
        let index = u32::try_from(added.len()).unwrap_or(u32::MAX);
        match client.ask(&row)? {
            Response::Taken {
                session: open,
                next,
                last,
            } if open == session && next == index.saturating_add(1) => added.push(last),
            Response::Fault(Fault::OutOfOrder { next }) if next < index && restarts < SESSIONS => {
                restarts += 1;
                added.truncate(next as usize);
            }
            Response::Taken { .. } | Response::Fault(Fault::OutOfOrder { .. }) => {
                return Err(Broken::Lost);
            }
            // The gate's estimate is solved first.
            Response::Fault(Fault::Busy) if looks < client.patience().looks => {
                looks += 1;
                std::thread::sleep(client.patience().pause);
            }
            Response::Fault(Fault::NoSession) => return Err(Broken::Lost),
            Response::Fault(fault) => return Err(Broken::Error(sending.fault(added.len(), fault))),
            other => return Err(unexpected(&other).into()),
        }
    }
    progress(Step::Taken(sending.count()));
    Ok(())
}

/// Starts the solve and waits for its end; `None` if the controller restarted and lacks samples or the result.
fn solve<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    added: &mut Vec<Option<Added<T>>>,
    progress: &mut dyn FnMut(Step),
) -> Result<Option<Status<T>>, Broken> {
    let samples = u32::try_from(added.len()).unwrap_or(u32::MAX);
    let mut request = Request::Solve { session, samples };
    for _ in 0..client.patience().looks {
        let status = match client.ask(&request)? {
            Response::Status(status) => status,
            Response::Fault(Fault::OutOfOrder { next }) if next < samples => {
                added.truncate(next as usize);
                return Ok(None);
            }
            Response::Fault(Fault::OutOfOrder { .. }) => return Err(Broken::Lost),
            other => return Err(unexpected(&other).into()),
        };
        if status.session != session {
            return Err(Broken::Lost);
        }
        match status.phase {
            Phase::Solved { .. } | Phase::CalibrationRefused { .. } => return Ok(Some(status)),
            Phase::Solving { arm } => progress(Step::Solving(arm)),
            Phase::Collecting { .. } => return Ok(None),
            _ => return Err(Broken::Lost),
        }
        std::thread::sleep(client.patience().pause);
        request = Request::Status;
    }
    Err(Broken::Error(DeviceError::SolveHangs))
}

fn solution<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    sending: &Sending<T>,
) -> Result<Solution<T>, Broken> {
    let [first, second, third] = ArmIndex::ALL;
    let arms = [
        outcome(client, session, first)?,
        outcome(client, session, second)?,
        outcome(client, session, third)?,
    ];
    let across = if sending.is_joint() {
        let [one, two, three] = ACROSS;
        Some([
            covariance(client, session, one)?,
            covariance(client, session, two)?,
            covariance(client, session, three)?,
        ])
    } else {
        None
    };
    let places = if sending.has_places() {
        match client.ask(&Request::Places { session })? {
            Response::Places(places) => Some(places),
            other => return Err(unexpected(&other).into()),
        }
    } else {
        None
    };
    Ok(Solution {
        arms,
        across,
        places,
    })
}

fn outcome<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    arm: ArmIndex,
) -> Result<ArmReport<T>, Broken> {
    match client.ask(&Request::Outcome { session, arm })? {
        Response::Outcome(report) if report.arm == arm => Ok(report),
        other => Err(unexpected(&other).into()),
    }
}

fn covariance<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    (rows, columns): (ArmIndex, ArmIndex),
) -> Result<CovarianceBlock<T>, Broken> {
    let request = Request::Covariance {
        session,
        rows,
        columns,
    };
    match client.ask(&request)? {
        Response::Covariance(block) if (block.rows, block.columns) == (rows, columns) => Ok(block),
        other => Err(unexpected(&other).into()),
    }
}

/// Applies a result that was looked at, and reads back that the control loop uses it. If the
/// controller has restarted since, calibrates again: the same samples give the same result.
///
/// # Errors
/// As [`calibrate`]; a controller that cannot store the result, or does not use it, or uses others by
/// now than [`Finished::parameters_before`]; [`DeviceError::Unconfirmed`].
pub fn apply<T: Number, L: Transport>(
    client: &mut Client<L>,
    sending: &Sending<T>,
    calibration: &Finished<T>,
) -> Result<Parameters<T>, DeviceError> {
    let Ok(solution) = &calibration.result else {
        return Err(DeviceError::Fault(Fault::NoOutcome));
    };
    let fingerprint = solution.fingerprint();
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
        // A controller that applied it and restarted before it had answered uses it already.
        if let Ok(parameters) = in_use(client, fingerprint) {
            return Ok(parameters);
        }
        let again = calibrate(client, sending, &mut |_| {}).map_err(DeviceError::unconfirmed)?;
        if !again
            .result
            .is_ok_and(|solution| solution.fingerprint() == fingerprint)
        {
            return Err(DeviceError::OutcomeChanged);
        }
        session = again.session;
    }
    Err(DeviceError::SessionsLost { sessions: SESSIONS })
}

/// Lets a controller use the geometry of a robot that was calibrated elsewhere, in place of the parameters of generation
/// `from`, and reads back that the control loop uses it.
///
/// # Errors
/// A robot that is none in the controller's numbers, a controller that cannot store it, or does not use it, or uses others
/// by now than those of `from`; [`DeviceError::Unconfirmed`].
pub fn adopt<T: Number, L: Transport>(
    client: &mut Client<L>,
    robot: &Robot<f64>,
    from: u32,
) -> Result<Parameters<T>, DeviceError> {
    let geometry = geometry(robot)?;
    match client.change(&Request::<T>::Adopt(Adopt { from, geometry }))? {
        Response::Parameters(_) => in_use(client, geometry.fingerprint()),
        other => Err(unexpected(&other)),
    }
}

/// The current parameters after a change, once the control loop uses them, if they are the expected
/// ones.
///
/// # Errors
/// As [`Client::ask`]; [`DeviceError::NotInUse`], [`DeviceError::Unconfirmed`].
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
    Err(DeviceError::NotInUse {
        origin: parameters.origin,
    })
}
