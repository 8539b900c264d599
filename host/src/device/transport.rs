//! The link to a controller: bytes there and back, over a serial port or TCP.

use serial2::SerialPort;
use std::error::Error;
use std::fmt;
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
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

/// Why a text names no port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PortError {
    /// `tcp:` and not `HOST:PORT`.
    NoTcpPort,
    /// No text.
    Empty,
}

impl fmt::Display for PortError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NoTcpPort => "tcp: needs a host and a port number, as in tcp:192.168.0.7:4000",
            Self::Empty => "a port is needed: /dev/ttyACM0 or tcp:HOST:PORT",
        })
    }
}

impl Error for PortError {}

impl FromStr for Port {
    type Err = PortError;

    fn from_str(text: &str) -> Result<Self, PortError> {
        if let Some(address) = text.strip_prefix("tcp:") {
            return match address.rsplit_once(':') {
                Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => {
                    Ok(Self::Tcp(address.to_owned()))
                }
                _ => Err(PortError::NoTcpPort),
            };
        }
        if text.is_empty() {
            return Err(PortError::Empty);
        }
        Ok(Self::Serial(text.into()))
    }
}

/// A serial port: 8 data bits, no parity, one stop bit, no flow control.
#[derive(Debug)]
pub struct Serial(SerialPort);

impl Serial {
    /// Opens the port; what it had received before is dropped.
    ///
    /// # Errors
    /// There is none of this name, it is in use or not permitted, or the rate is not supported.
    pub fn open(name: &Path, baud: u32) -> io::Result<Self> {
        let mut port = SerialPort::open(name, baud)?;
        port.set_write_timeout(TIMEOUT)?;
        port.discard_input_buffer()?;
        Ok(Self(port))
    }
}

impl Transport for Serial {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.0.set_read_timeout(timeout)?;
        received(self.0.read(buffer))
    }
}

/// A TCP connection to a serial server or an emulator.
#[derive(Debug)]
pub struct Tcp(TcpStream);

impl Tcp {
    /// Connects to `HOST:PORT`; the first address that answers.
    ///
    /// # Errors
    /// No such host, or nobody answers there.
    pub fn connect(address: &str) -> io::Result<Self> {
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
        for address in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, TIMEOUT) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    stream.set_write_timeout(Some(TIMEOUT))?;
                    return Ok(Self(stream));
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

impl Transport for Tcp {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        // A timeout of zero would be none.
        let timeout = timeout.max(Duration::from_millis(1));
        self.0.set_read_timeout(Some(timeout))?;
        received(self.0.read(buffer))
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
