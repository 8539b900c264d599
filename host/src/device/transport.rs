//! The link to a controller: bytes there and back, over a serial port, TCP or an emulator.

mod port;
mod serial;
mod tcp;

pub use port::{Board, Port, PortError};
pub use serial::Serial;
pub use tcp::Tcp;

use std::io;
use std::time::{Duration, Instant};

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

impl<L: Transport + ?Sized> Transport for &mut L {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).write(bytes)
    }
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        (**self).read(buffer, timeout)
    }
    fn now(&self) -> Instant {
        (**self).now()
    }
}

impl<L: Transport + ?Sized> Transport for Box<L> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).write(bytes)
    }
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        (**self).read(buffer, timeout)
    }
    fn now(&self) -> Instant {
        (**self).now()
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
