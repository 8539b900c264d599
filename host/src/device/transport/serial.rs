use super::{Transport, received};
use serial2::SerialPort;
use std::io;
use std::path::Path;
use std::time::Duration;

/// A frame is sent within this, or the port is stuck.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

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
        port.set_write_timeout(WRITE_TIMEOUT)?;
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
