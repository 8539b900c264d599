use std::error::Error;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Where a controller is: `/dev/ttyACM0`, `tcp:HOST:PORT`, `emulate:m4` or `emulate:m7`.
///
/// ```
/// use delta_cal_host::device::{Board, Port};
/// assert_eq!("emulate:m7".parse(), Ok(Port::Emulated(Board::M7)));
/// assert_eq!("tcp:10.0.0.7:4000".parse(), Ok(Port::Tcp("10.0.0.7:4000".into())));
/// assert_eq!("/dev/ttyACM0".parse(), Ok(Port::Serial("/dev/ttyACM0".into())));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Port {
    /// A serial port.
    Serial(PathBuf),
    /// `HOST:PORT`.
    Tcp(String),
    /// A board that QEMU emulates, with the example's firmware.
    Emulated(Board),
}

/// A board that QEMU emulates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// `mps2-an386`: a Cortex-M4F.
    M4,
    /// `mps2-an500`: a Cortex-M7.
    M7,
}

impl fmt::Display for Port {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => path.display().fmt(formatter),
            Self::Tcp(address) => write!(formatter, "tcp:{address}"),
            Self::Emulated(Board::M4) => formatter.write_str("emulate:m4"),
            Self::Emulated(Board::M7) => formatter.write_str("emulate:m7"),
        }
    }
}

/// Why a text names no port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PortError {
    /// `emulate:` and another board.
    UnknownBoard,
    /// `tcp:` and not `HOST:PORT`.
    NoTcpPort,
    /// No text.
    Empty,
}

impl fmt::Display for PortError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::UnknownBoard => "the boards that can be emulated are emulate:m4 and emulate:m7",
            Self::NoTcpPort => {
                "after tcp: come a host and a port number, as in tcp:192.168.0.7:4000"
            }
            Self::Empty => {
                "a port is needed: /dev/ttyACM0, tcp:HOST:PORT, emulate:m4 or emulate:m7"
            }
        })
    }
}

impl Error for PortError {}

impl FromStr for Port {
    type Err = PortError;

    fn from_str(text: &str) -> Result<Self, PortError> {
        if let Some(board) = text.strip_prefix("emulate:") {
            return match board {
                "m4" => Ok(Self::Emulated(Board::M4)),
                "m7" => Ok(Self::Emulated(Board::M7)),
                _ => Err(PortError::UnknownBoard),
            };
        }
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
