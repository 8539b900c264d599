//! The link to a controller: bytes there and back, over a serial port or TCP; and why a controller did not do what was
//! asked, in words.

use delta_cal::samples::SampleError;
use delta_cal_protocol::{Fault, VERSION};
use serial2::SerialPort;
use std::fmt;
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// A connection is made, or a frame sent, within this time, or the link is stuck.
const TIMEOUT: Duration = Duration::from_secs(5);

/// A link that carries bytes, and may lose or damage them.
pub trait Transport {
    /// Sends all of them.
    ///
    /// # Errors
    /// The link is gone.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Reads what has come, waiting up to `timeout` for the first byte; 0 if none came.
    ///
    /// # Errors
    /// The link is gone.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize>;

    /// The time by which deadlines are kept. A link in memory, where nothing takes time, may have its own.
    fn now(&self) -> Instant {
        Instant::now()
    }
}

/// Where a controller is: `/dev/ttyACM0` or `tcp:HOST:PORT`.
///
/// ```
/// use delta_cal_host::device::Port;
/// assert_eq!("tcp:10.0.0.7:4000".parse(), Ok(Port::Tcp("10.0.0.7:4000".into())));
/// assert_eq!("/dev/ttyACM0".parse(), Ok(Port::Serial("/dev/ttyACM0".into())));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Port {
    /// A serial port.
    Serial(PathBuf),
    /// `HOST:PORT`.
    Tcp(String),
}

impl fmt::Display for Port {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => path.display().fmt(formatter),
            Self::Tcp(address) => write!(formatter, "tcp:{address}"),
        }
    }
}

impl FromStr for Port {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, &'static str> {
        if let Some(address) = text.strip_prefix("tcp:") {
            return match address.rsplit_once(':') {
                Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => {
                    Ok(Self::Tcp(address.to_owned()))
                }
                _ => Err("tcp: needs a host and a port number, as in tcp:192.168.0.7:4000"),
            };
        }
        if text.is_empty() {
            return Err("a port is needed: /dev/ttyACM0 or tcp:HOST:PORT");
        }
        Ok(Self::Serial(text.into()))
    }
}

impl Port {
    /// Opens it: a serial port with 8 data bits, no parity, one stop bit and no flow control, where what was received
    /// before is dropped; or the first address of a host that answers. `baud` is a serial port's.
    ///
    /// # Errors
    /// There is no such port or host, it is in use or not permitted, the rate is not supported, or nobody answers.
    pub fn open(&self, baud: u32) -> io::Result<Link> {
        match self {
            Self::Serial(path) => {
                let mut port = SerialPort::open(path, baud)?;
                port.set_write_timeout(TIMEOUT)?;
                port.discard_input_buffer()?;
                Ok(Link::Serial(port))
            }
            Self::Tcp(address) => {
                let mut last = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
                for address in address.to_socket_addrs()? {
                    match TcpStream::connect_timeout(&address, TIMEOUT) {
                        Ok(stream) => {
                            stream.set_nodelay(true)?;
                            stream.set_write_timeout(Some(TIMEOUT))?;
                            return Ok(Link::Tcp(stream));
                        }
                        Err(error) => last = error,
                    }
                }
                Err(last)
            }
        }
    }
}

/// A port that is open.
#[derive(Debug)]
pub enum Link {
    /// A serial port.
    Serial(SerialPort),
    /// A connection.
    Tcp(TcpStream),
}

impl Transport for Link {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Serial(port) => port.write_all(bytes),
            Self::Tcp(stream) => stream.write_all(bytes),
        }
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        received(match self {
            Self::Serial(port) => {
                port.set_read_timeout(timeout)?;
                port.read(buffer)
            }
            Self::Tcp(stream) => {
                // A timeout of zero would be none.
                let timeout = timeout.max(Duration::from_millis(1));
                stream.set_read_timeout(Some(timeout))?;
                stream.read(buffer)
            }
        })
    }
}

/// The result of a stream's read: nothing within the timeout is 0, the stream's end an error.
fn received(result: io::Result<usize>) -> io::Result<usize> {
    match result {
        Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
            ) =>
        {
            Ok(0)
        }
        other => other,
    }
}

/// Why a controller did not do what was asked. Displayed as one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// The link is gone.
    #[error("{}", broken(.0))]
    Link(#[from] io::Error),
    /// Nothing comes back.
    #[error("no answer to {attempts} requests")]
    NoAnswer {
        /// So often was it asked.
        attempts: u32,
    },
    /// Something comes back, and never whole.
    #[error("only damaged answers to {attempts} requests in a row")]
    Unusable {
        /// So often was it asked.
        attempts: u32,
    },
    /// The controller speaks another version of the protocol.
    #[error("the controller speaks version {spoken} of the protocol, delta-cal version {VERSION}")]
    OtherVersion {
        /// Which.
        spoken: u8,
    },
    /// An answer is whole, and not understood, or not to what was asked.
    #[error("unexpected reply from the controller")]
    Unexpected,
    /// The controller refused the request.
    #[error("{}", fault_in_words(*.0))]
    Fault(Fault),
    /// The controller does not take this sample.
    #[error("the controller refuses sample {}: {error}", index + 1)]
    Sample {
        /// Which, counted from 0.
        index: u32,
        /// Why.
        error: SampleError,
    },
    /// The controller restarts over and over, or somebody else is calibrating it.
    #[error(
        "the controller lost the calibration {sessions} times: it restarts, or another program calibrates it"
    )]
    SessionsLost {
        /// So many times was it begun.
        sessions: u32,
    },
    /// The solve does not come to an end.
    #[error("the controller does not finish solving")]
    SolveHangs,
    /// The three arms' results are not those that the controller had announced.
    #[error("the controller's result is not the one that it announced")]
    OutcomeChanged,
    /// The controller was asked for other parameters, and whether it uses them is not known.
    #[error("{0}; the controller may use the new parameters")]
    Unconfirmed(#[source] Box<Self>),
    /// The parameters were applied, and the controller does not use them.
    #[error("the controller stored the new parameters and does not use them")]
    NotInUse,
    /// The controller has no robot: its parameters are not a geometry.
    #[error("these parameters are not a robot's")]
    ImpossibleGeometry,
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
                "delta-cal device --port PORT status shows which parameters are in use; repeating the command \
                 does no harm"
            }
            Self::Link(_) => "check the cable and the supply, then repeat the command",
            Self::NoAnswer { .. } => {
                "check that this is the controller's port, that its firmware runs, and --baud"
            }
            Self::Unusable { .. } => "check the cable and --baud",
            Self::OtherVersion { .. } | Self::Unexpected => {
                "use the delta-cal that belongs to the controller's firmware"
            }
            Self::SessionsLost { .. } => {
                "check its supply, and that nobody else talks to it; its parameters are unchanged"
            }
            Self::Fault(Fault::Store) => {
                "its parameters are unchanged; its flash may be worn or full"
            }
            Self::Fault(Fault::OtherParameters { .. }) => {
                "look at them with delta-cal device status, and repeat the command"
            }
            Self::Fault(Fault::NoOutcome) => "calibrate it first",
            Self::Fault(Fault::UnknownRequest) => "load newer firmware into the controller",
            _ => "repeat the command; if the error stays, restart the controller",
        }
    }
}

fn broken(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => "the controller closed the link".to_owned(),
        _ => format!("the link broke: {error}"),
    }
}

const fn fault_in_words(fault: Fault) -> &'static str {
    match fault {
        Fault::Damaged => "the controller received a damaged frame",
        Fault::UnknownVersion { .. } => "the controller speaks another version of the protocol",
        Fault::UnknownRequest => "the controller does not know the request",
        Fault::NoSession => "the controller lost the calibration: it restarted",
        Fault::OutOfOrder { .. } => "the controller missed a sample",
        Fault::Sample(_) => "the controller refuses a sample",
        Fault::Settings => "the controller refuses the tolerance or the noise",
        Fault::Busy => "the controller is solving",
        Fault::NoOutcome => "the controller has no result",
        Fault::OtherParameters { .. } => "the controller's parameters changed meanwhile",
        Fault::Store => "the controller could not store the parameters",
        Fault::Geometry(_) => "the controller does not accept the robot",
        _ => "the controller refused the request",
    }
}
