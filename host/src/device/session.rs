//! The dialogue of a calibration: samples in, solve, outcome out, applied.

use super::client::{Client, unexpected};
use super::error::DeviceError;
use super::number::Number;
use super::transport::Transport;
use delta_cal::{ArmIndex, Refusal};
use delta_cal_protocol::fingerprint as fingerprint_of;
use delta_cal_protocol::{
    ArmReport, Begin, Fault, ParameterSet, Parameters, Phase, Request, Response, SampleMessage,
    Status,
};

/// So often is a calibration begun again after the controller forgot it.
const SESSIONS: u32 = 5;
/// Looks at whether the control loop has switched.
const LOOKS_AT_SWITCH: u32 = 50;

/// One measurement as it is sent: joint angles in radians, position in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement<T> {
    /// q₁, q₂, q₃ in radians.
    pub joints: [T; 3],
    /// Measured platform position, mm.
    pub position: [T; 3],
}

/// How a calibration is to be done; see [`Begin`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumptions<T> {
    /// One σ of the manufacturing tolerance: millimetres, radians.
    pub tolerance: Option<(T, T)>,
    /// One σ of position and joint angle in a measurement: millimetres, radians.
    pub noise: Option<(T, T)>,
    /// Start without a guess rather than from nominal.
    pub without_guess: bool,
}

/// How far it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// So many samples are taken in.
    Taken(usize),
    /// The controller is at work on this arm.
    Solving(ArmIndex),
    /// The controller forgot everything; it begins again.
    BegunAgain,
}

/// A calibration that the controller has finished, one way or the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finished<T> {
    /// Its session.
    pub session: u32,
    /// What came out.
    pub result: Result<[ArmReport<T>; 3], Refusal>,
    /// What was in use before the first sample, and is to be replaced.
    pub parameters_before: Parameters<T>,
    /// The controller before the first sample.
    pub status_before: Status<T>,
    /// The controller with the result.
    pub status_after: Status<T>,
}

/// The parameters of three arms' results.
pub fn parameters_of<T: Number>(arms: &[ArmReport<T>; 3]) -> [[T; 8]; 3] {
    arms.map(|arm| arm.parameters)
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

/// Sends the measurements and waits for what the controller makes of them. If the controller
/// restarts meanwhile, begins again.
///
/// # Errors
/// A link that does not work, a sample that is not taken, a controller that restarts over and
/// over. A calibration that is refused is no error.
pub fn calibrate<T: Number, L: Transport>(
    client: &mut Client<L>,
    assumptions: &Assumptions<T>,
    measurements: &[Measurement<T>],
    progress: &mut dyn FnMut(Step),
) -> Result<Finished<T>, DeviceError> {
    for _ in 0..SESSIONS {
        match session(client, assumptions, measurements, progress) {
            Ok(finished) => return Ok(finished),
            Err(Broken::Lost) => progress(Step::BegunAgain),
            Err(Broken::Error(error)) => return Err(error),
        }
    }
    Err(DeviceError::SessionsLost { sessions: SESSIONS })
}

fn session<T: Number, L: Transport>(
    client: &mut Client<L>,
    assumptions: &Assumptions<T>,
    measurements: &[Measurement<T>],
    progress: &mut dyn FnMut(Step),
) -> Result<Finished<T>, Broken> {
    let session = client.new_session();
    let begin = Request::Begin(Begin {
        session,
        tolerance: assumptions.tolerance,
        noise: assumptions.noise,
        without_guess: assumptions.without_guess,
    });
    taken(client, &begin, session, 0)?;
    // Not before: a controller that restarts in between counts from zero again.
    let status_before: Status<T> = client.status()?;
    if status_before.session != session {
        return Err(Broken::Lost);
    }
    let parameters_before = client.parameters(ParameterSet::Current)?;
    let mut samples = 0;
    for (index, measurement) in measurements.iter().enumerate() {
        progress(Step::Taken(index));
        let sample = Request::Sample(SampleMessage {
            session,
            index: samples,
            joints: measurement.joints,
            position: measurement.position,
        });
        samples += 1;
        match taken(client, &sample, session, samples) {
            Err(Broken::Error(DeviceError::Fault(Fault::Sample(error)))) => {
                return Err(DeviceError::Sample { index, error }.into());
            }
            other => other?,
        }
    }
    progress(Step::Taken(measurements.len()));
    let status_after = solve(client, session, samples, progress)?;
    let result = match status_after.phase {
        Phase::Solved {
            fingerprint: announced,
            ..
        } => {
            let [first, second, third] = ArmIndex::ALL;
            let arms = [
                outcome(client, session, first)?,
                outcome(client, session, second)?,
                outcome(client, session, third)?,
            ];
            if fingerprint_of(&parameters_of(&arms)) != announced {
                return Err(Broken::Error(DeviceError::OutcomeChanged));
            }
            Ok(arms)
        }
        Phase::CalibrationRefused { refusal, .. } => Err(refusal),
        _ => return Err(Broken::Lost),
    };
    Ok(Finished {
        session,
        result,
        parameters_before,
        status_before,
        status_after,
    })
}

/// Sends a request after which this session must have so many samples. With any other number it is
/// not this client's session, or the controller does not go on: both begin again.
fn taken<T: Number, L: Transport>(
    client: &mut Client<L>,
    request: &Request<T>,
    expected: u32,
    samples: u32,
) -> Result<(), Broken> {
    match client.ask(request)? {
        Response::Taken { session, next } if session == expected && next == samples => Ok(()),
        Response::Taken { .. } | Response::Fault(Fault::OutOfOrder { .. }) => Err(Broken::Lost),
        other => Err(unexpected(&other).into()),
    }
}

/// Starts the solve and waits for its end.
fn solve<T: Number, L: Transport>(
    client: &mut Client<L>,
    session: u32,
    samples: u32,
    progress: &mut dyn FnMut(Step),
) -> Result<Status<T>, Broken> {
    let mut request = Request::Solve { session, samples };
    for _ in 0..client.patience().looks {
        let status = match client.ask(&request)? {
            Response::Status(status) => status,
            other => return Err(unexpected(&other).into()),
        };
        if status.session != session {
            return Err(Broken::Lost);
        }
        match status.phase {
            Phase::Solved { .. } | Phase::CalibrationRefused { .. } => return Ok(status),
            Phase::Solving { arm } => progress(Step::Solving(arm)),
            _ => return Err(Broken::Lost),
        }
        std::thread::sleep(client.patience().pause);
        request = Request::Status;
    }
    Err(Broken::Error(DeviceError::SolveHangs))
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

/// Applies a result that was looked at, and reads back that the control loop uses it. If the
/// controller has restarted since, calibrates again: the same samples give the same result.
///
/// # Errors
/// As [`calibrate`]; a controller that cannot store the result, or does not use it, or uses others by
/// now than [`Finished::parameters_before`]; [`DeviceError::Unconfirmed`].
pub fn apply<T: Number, L: Transport>(
    client: &mut Client<L>,
    assumptions: &Assumptions<T>,
    measurements: &[Measurement<T>],
    calibration: &Finished<T>,
) -> Result<Parameters<T>, DeviceError> {
    let Ok(arms) = &calibration.result else {
        return Err(DeviceError::Fault(Fault::NoOutcome));
    };
    let fingerprint = fingerprint_of(&parameters_of(arms));
    let mut session = calibration.session;
    for _ in 0..SESSIONS {
        let request = Request::<T>::Apply {
            session,
            fingerprint,
            from: calibration.parameters_before.generation,
        };
        match client.change(&request)? {
            Response::Parameters(_) => return in_use(client, fingerprint),
            Response::Fault(Fault::NoSession) => {}
            other => return Err(unexpected(&other)),
        }
        // A controller that applied it and restarted before it had answered uses it already.
        if let Ok(parameters) = in_use(client, fingerprint) {
            return Ok(parameters);
        }
        let again = calibrate(client, assumptions, measurements, &mut |_| {})
            .map_err(DeviceError::unconfirmed)?;
        if !again
            .result
            .is_ok_and(|arms| fingerprint_of(&parameters_of(&arms)) == fingerprint)
        {
            return Err(DeviceError::OutcomeChanged);
        }
        session = again.session;
    }
    Err(DeviceError::SessionsLost { sessions: SESSIONS })
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
    if fingerprint_of(&parameters.arms) == expected {
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
