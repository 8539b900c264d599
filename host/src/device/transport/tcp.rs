use super::{Transport, received};
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// A TCP connection, to a serial server or to an emulator.
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
            match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
                Ok(stream) => return Self::of(stream),
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    /// A connection that is there already.
    ///
    /// # Errors
    /// The connection is gone.
    pub fn of(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
        Ok(Self(stream))
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
