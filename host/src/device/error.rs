use delta_cal::observations::ObservationError;
use delta_cal::samples::SampleError;
use delta_cal_protocol::{Fault, Origin, VERSION};
use std::error::Error;
use std::fmt;
use std::io;

/// Why a controller did not do what was asked. Displayed as one line.
#[derive(Debug)]
#[non_exhaustive]
pub enum DeviceError {
    /// The link is gone.
    Link(io::Error),
    /// Nothing comes back.
    NoAnswer {
        /// So often was it asked.
        attempts: u32,
    },
    /// Something comes back, and never whole.
    Unusable {
        /// So often was it asked.
        attempts: u32,
    },
    /// The controller speaks another version of the protocol.
    OtherVersion {
        /// Which.
        spoken: u8,
    },
    /// An answer is whole and says nothing that is known here.
    Unreadable,
    /// An answer is none to what was asked.
    Unexpected,
    /// A request does not fit a frame.
    RequestTooLarge,
    /// The controller refused the request.
    Fault(Fault),
    /// The controller does not take this row.
    Row {
        /// Which, counted from 0.
        index: usize,
        /// Why.
        error: RowError,
    },
    /// The controller has no memory for so many observations.
    TooManyRows {
        /// How many there are.
        rows: usize,
        /// How many it has memory for.
        capacity: u32,
    },
    /// The controller restarts over and over, or somebody else is calibrating it.
    SessionsLost {
        /// So many times was it begun.
        sessions: u32,
    },
    /// The solve does not come to an end.
    SolveHangs,
    /// The three arms' results are not those that the controller had announced.
    OutcomeChanged,
    /// The controller was asked for other parameters, and whether it uses them is not known.
    Unconfirmed(Box<Self>),
    /// The parameters were applied, and the controller does not use them.
    NotInUse {
        /// Where those come from that it uses.
        origin: Origin,
    },
    /// The controller has no robot: its parameters are not a geometry.
    ImpossibleGeometry,
    /// A figure of the controller's result is not a number, or negative where none can be.
    ImpossibleOutcome,
}

/// Why a controller does not take a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowError {
    /// A position or a joint angle is impossible.
    Sample(SampleError),
    /// An observation is not usable.
    Observation(ObservationError),
}

impl fmt::Display for RowError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sample(error) => error.fmt(formatter),
            Self::Observation(error) => error.fmt(formatter),
        }
    }
}

impl From<io::Error> for DeviceError {
    fn from(error: io::Error) -> Self {
        Self::Link(error)
    }
}

impl DeviceError {
    /// What an error means once the controller was asked for other parameters.
    pub(super) fn unconfirmed(self) -> Self {
        match self {
            error @ (Self::Link(_) | Self::NoAnswer { .. } | Self::Unusable { .. }) => {
                Self::Unconfirmed(Box::new(error))
            }
            error => error,
        }
    }

    /// What to do next.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Unconfirmed(_) => {
                "delta-cal device --port PORT status says which parameters are in use; to give the same \
                 command again does no harm"
            }
            Self::Link(error) if error.kind() == io::ErrorKind::Interrupted => {
                "the controller keeps its parameters: it was not asked for others"
            }
            Self::Link(_) => "check the cable and the supply, then start again: nothing was lost",
            Self::NoAnswer { .. } => {
                "check that this is the controller's port, that its firmware runs, and --baud"
            }
            Self::Unusable { .. } => "check the cable and --baud",
            Self::OtherVersion { .. } | Self::Unreadable | Self::Unexpected => {
                "use the delta-cal that belongs to the controller's firmware"
            }
            Self::SessionsLost { .. } => {
                "check its supply, and that nobody else talks to it; the parameters are unchanged"
            }
            Self::Fault(Fault::Store) => {
                "the parameters in use are unchanged; the controller's flash may be worn or full"
            }
            Self::Fault(Fault::OtherParameters { .. }) => {
                "somebody else changed them meanwhile: look at them and start again"
            }
            Self::Fault(Fault::NoOutcome) => "calibrate it first",
            Self::Fault(Fault::UnknownRequest) => {
                "load newer firmware into the controller, or use delta-cal calibrate"
            }
            Self::TooManyRows { .. } => {
                "leave out rows of poses that are close to others, or use delta-cal calibrate, which takes any number"
            }
            Self::Fault(Fault::TooManyUnknowns { .. }) => {
                "use fewer planes and points, or delta-cal calibrate, which has room for 48 unknowns"
            }
            _ => "start again; if it stays so, restart the controller",
        }
    }
}

impl fmt::Display for DeviceError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                formatter.write_str("the link was closed from the other side")
            }
            Self::Link(error) => write!(formatter, "the link broke: {error}"),
            Self::NoAnswer { attempts } => {
                write!(formatter, "no answer, asked {attempts} times")
            }
            Self::Unusable { attempts } => write!(
                formatter,
                "what comes back is damaged, {attempts} times in a row"
            ),
            Self::OtherVersion { spoken } => write!(
                formatter,
                "the controller speaks version {spoken} of the protocol, delta-cal version {VERSION}"
            ),
            Self::Unreadable => formatter.write_str("the controller's answer is not understood"),
            Self::Unexpected => {
                formatter.write_str("the controller's answer is none to what was asked")
            }
            Self::RequestTooLarge => formatter.write_str("the request does not fit a frame"),
            Self::Row { index, error } => write!(formatter, "sample {}: {error}", index + 1),
            Self::TooManyRows { rows, capacity } => write!(
                formatter,
                "{rows} rows, and the controller has memory for {capacity}"
            ),
            Self::Fault(Fault::TooManyUnknowns { capacity }) => write!(
                formatter,
                "the planes and points have more than the {capacity} unknowns that the controller has memory \
                 for: three a plane, three a point and one for an offset"
            ),
            Self::Fault(fault) => formatter.write_str(fault_in_words(*fault)),
            Self::SessionsLost { sessions } => write!(
                formatter,
                "the controller forgot the calibration {sessions} times: it restarts, or somebody \
                 else calibrates it"
            ),
            Self::Unconfirmed(error) => write!(
                formatter,
                "{error}; the controller had been asked for other parameters and may use them"
            ),
            Self::SolveHangs => formatter.write_str("the controller does not finish solving"),
            Self::OutcomeChanged => {
                formatter.write_str("the controller's results are not those that it announced")
            }
            Self::NotInUse { .. } => {
                formatter.write_str("the controller does not use the parameters that it applied")
            }
            Self::ImpossibleGeometry => {
                formatter.write_str("the controller's parameters are not the geometry of a robot")
            }
            Self::ImpossibleOutcome => {
                formatter.write_str("the controller's result holds figures that no result has")
            }
        }
    }
}

const fn fault_in_words(fault: Fault) -> &'static str {
    match fault {
        Fault::Damaged => "the controller received a damaged frame",
        Fault::UnknownVersion { .. } => "the controller speaks another version of the protocol",
        Fault::UnknownRequest => "the controller does not know the request",
        Fault::NoSession => "the controller forgot the calibration: it restarted",
        Fault::OutOfOrder { .. } => "the controller missed a sample",
        Fault::Sample(_) => "the controller does not take a sample",
        Fault::Settings => {
            "the controller does not take the tolerance, the noise, or the number of --held-out or --forget"
        }
        Fault::Busy => "the controller is solving",
        Fault::NoOutcome => "the controller has no result to apply or to go back to",
        Fault::OtherParameters { .. } => {
            "the controller's parameters are no longer those that were looked at"
        }
        Fault::OtherKind => "the controller's session is for another kind of measurement",
        Fault::Store => "the controller could not store the parameters",
        _ => "the controller refused the request",
    }
}

impl Error for DeviceError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Link(error) => Some(error),
            Self::Unconfirmed(error) => Some(error),
            _ => None,
        }
    }
}
