//! The link to a controller, over a serial port or TCP, and the reasons why a request can fail.

use delta_cal::samples::SampleError;
use delta_cal_protocol::{Fault, VERSION};
use serial2::SerialPort;
use std::fmt;
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Time limit for connecting or for sending a frame.
const TIMEOUT: Duration = Duration::from_secs(5);

/// A link that carries bytes and may lose or damage them.
pub trait Transport {
    /// Sends all bytes.
    ///
    /// # Errors
    /// The link is gone.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Reads the bytes that have arrived, waiting up to `timeout` for the first; returns 0 if none arrived.
    ///
    /// # Errors
    /// The link is gone.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize>;

    /// The clock for deadlines. An in-memory link, where nothing takes time, may have its own.
    fn now(&self) -> Instant {
        Instant::now()
    }
}

/// The address of a controller: `/dev/ttyACM0`, `tcp:HOST:PORT`, or `tcp:PORT` on this computer. The protocol has no
/// authentication: whoever reaches the port can change the robot.
///
/// ```
/// use delta_cal_host::device::Port;
/// assert_eq!("tcp:4000".parse(), Ok(Port::Tcp("127.0.0.1:4000".into())));
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
            let (host, port) = address.rsplit_once(':').unwrap_or(("127.0.0.1", address));
            if host.is_empty() || port.parse::<u16>().is_err() {
                return Err("tcp: needs a host and a port number, as in tcp:192.168.0.7:4000");
            }
            return Ok(Self::Tcp(format!("{host}:{port}")));
        }
        if text.is_empty() {
            return Err("a port is needed: /dev/ttyACM0 or tcp:HOST:PORT");
        }
        Ok(Self::Serial(text.into()))
    }
}

impl Port {
    /// Opens a serial port at `baud`, for this program alone, with 8 data bits, no parity, one stop bit and no flow
    /// control, and discards bytes received earlier; or connects to the first address of a host that answers.
    ///
    /// # Errors
    /// The port or host does not exist, is in use or not permitted, does not support the rate, or does not answer.
    pub fn open(&self, baud: u32) -> io::Result<Link> {
        match self {
            Self::Serial(path) => {
                let mut port = SerialPort::open(path, baud)?;
                exclusively(&port)?;
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

/// Locks a serial port as minicom and picocom do: of two programs, each would take bytes from the other. Windows opens a
/// port only once.
fn exclusively(port: &SerialPort) -> io::Result<()> {
    #[cfg(unix)]
    {
        // The lock belongs to the open port, which the copy shares, and ends with it.
        let copy = std::os::fd::AsFd::as_fd(port).try_clone_to_owned()?;
        std::fs::File::from(copy)
            .try_lock()
            .map_err(|error| match error {
                std::fs::TryLockError::WouldBlock => {
                    io::Error::new(io::ErrorKind::ResourceBusy, "another program uses it")
                }
                std::fs::TryLockError::Error(error) => error,
            })?;
    }
    let _ = port;
    Ok(())
}

/// An open port.
#[derive(Debug)]
pub enum Link {
    /// A serial port.
    Serial(SerialPort),
    /// A TCP connection.
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
                // A zero timeout would mean none.
                let timeout = timeout.max(Duration::from_millis(1));
                stream.set_read_timeout(Some(timeout))?;
                stream.read(buffer)
            }
        })
    }
}

/// The result of reading a stream: 0 if nothing arrives within the timeout, an error at the end of the stream.
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

/// Why a request to a controller failed. Displayed as one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// The link is gone.
    #[error("{}", broken(.0))]
    Link(#[from] io::Error),
    /// Nothing arrives after this many requests.
    #[error("no answer to {0} requests")]
    NoAnswer(u32),
    /// Answers arrive, but after this many requests always damaged.
    #[error("only damaged answers to {0} requests in a row")]
    Unusable(u32),
    /// The controller speaks this other protocol version.
    #[error("the controller speaks version {0} of the protocol, delta-cal version {VERSION}")]
    OtherVersion(u8),
    /// An intact answer that is unknown or does not match the request.
    #[error("unexpected reply from the controller")]
    Unexpected,
    /// The controller refused the request.
    #[error("{}", fault_in_words(*.0))]
    Fault(Fault),
    /// The controller rejected the sample at this index, from 0.
    #[error("the controller refuses sample {number}: {1}", number = .0 + 1)]
    Sample(u32, SampleError),
    /// The controller lost this many sessions: it keeps restarting, or another program is calibrating it.
    #[error(
        "the controller lost the calibration {0} times: it keeps restarting, or another program is calibrating it"
    )]
    SessionsLost(u32),
    /// The solve does not finish.
    #[error("the controller did not finish solving")]
    SolveHangs,
    /// The results of the three arms are not those that the controller announced.
    #[error("the controller's result differs from the one that it announced")]
    OutcomeChanged,
    /// A change of parameters was requested; whether the controller uses them is unknown.
    #[error("{0}; the controller may use the new parameters")]
    Unconfirmed(#[source] Box<Self>),
    /// The parameters were applied, but the control loop does not use them: it does not turn, or the platform is where
    /// they cannot reach.
    #[error("the controller stored the new parameters but does not use them")]
    NotInUse,
    /// The controller's parameters are not a robot's geometry.
    #[error("these parameters do not describe a robot")]
    ImpossibleGeometry,
}

impl DeviceError {
    /// The error if the failed request may have changed the parameters.
    pub(super) fn unconfirmed(self) -> Self {
        match self {
            error @ (Self::Link(_) | Self::NoAnswer(_) | Self::Unusable(_)) => {
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
            Self::NoAnswer(_) => {
                "check that this is the controller's port, that its firmware runs, and --baud"
            }
            Self::Unusable(_) => "check the cable and --baud",
            Self::OtherVersion(_) | Self::Unexpected => {
                "use the delta-cal that belongs to the controller's firmware"
            }
            Self::SessionsLost(_) => {
                "check its power supply, and that no other program uses it; its parameters are unchanged"
            }
            Self::NotInUse => "look at its control loop with delta-cal device status",
            Self::Fault(Fault::OtherRobot) => {
                "its robot is the one that delta-cal device parameters --nominal writes"
            }
            Self::Fault(Fault::Unreachable) => {
                "move the platform to the middle, and repeat the command"
            }
            Self::Fault(Fault::OtherStore) => {
                "save them with the firmware that stored them (delta-cal device parameters), or discard them: \
                 delta-cal device revert --nominal"
            }
            Self::Fault(Fault::TooOften) => "wait a minute: each change wears its flash",
            Self::Fault(Fault::Region) => "correct its firmware: see docs/board.md",
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
        Fault::OtherRobot => {
            "not the controller's robot: an arm is not positive, a work point is out of reach, or positions \
             differ by more than a twentieth of the forearm"
        }
        Fault::Unreachable => "the robot cannot reach the point that the platform is at",
        Fault::OtherStore => "the controller keeps parameters of another firmware version or robot",
        Fault::TooOften => "too many changes of the controller's parameters",
        Fault::Region => "a flash region of the controller does not fit",
        _ => "the controller refused the request",
    }
}
