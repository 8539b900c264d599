//! The link to the controller, from the command line to the first answer.

use super::{DeviceArguments, LinkArguments};
use crate::cli::failure::Failure;
use crate::device::{Client, Number, Patience, Port, Transport};
use delta_cal_protocol::{Identity, Scalar};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const BAUD: u32 = 115_200;
/// So soon is Ctrl-C heeded.
const LOOK: Duration = Duration::from_millis(100);

/// What is done with a controller, whatever type it computes in.
pub(super) trait Task {
    fn run<T: Number>(self, device: &mut Device<'_>) -> Result<(), Failure>;
}

/// A controller that has said who it is.
pub(super) struct Device<'a> {
    pub(super) client: Client<Link>,
    pub(super) identity: Identity,
    pub(super) port: Port,
    /// Where the report goes as JSON.
    pub(super) json: Option<&'a Path>,
}

/// The link that Ctrl-C breaks, so that whatever is under way ends in order.
pub(super) struct Link {
    transport: Box<dyn Transport>,
    interrupted: Arc<AtomicBool>,
}

impl Link {
    fn check(&self) -> io::Result<()> {
        if self.interrupted.load(Ordering::Relaxed) {
            Err(io::ErrorKind::Interrupted.into())
        } else {
            Ok(())
        }
    }
}

impl Transport for Link {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.check()?;
        self.transport.write(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let mut left = timeout;
        loop {
            self.check()?;
            let wait = left.min(LOOK);
            let count = self.transport.read(buffer, wait)?;
            left = left.saturating_sub(wait);
            if count > 0 || left.is_zero() {
                return Ok(count);
            }
        }
    }
}

/// Does something with the controller at the port.
pub(super) fn with_device(arguments: &DeviceArguments, task: impl Task) -> Result<(), Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    // Without a handler Ctrl-C ends the process at once, which is no worse than having none.
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed));
    let (port, transport) = open(&arguments.link)?;
    let seed = getrandom::u64().map_err(|error| Failure::Device {
        cause: format!("the system has no random numbers: {error}"),
        remedy: String::new(),
    })?;
    let link = Link {
        transport,
        interrupted: Arc::clone(&interrupted),
    };
    let mut client = Client::new(link, Patience::default(), seed);
    let identity = client.identity().map_err(Failure::from);
    let done = identity.and_then(|identity| {
        let mut device = Device {
            client,
            identity,
            port,
            json: arguments.json.as_deref(),
        };
        match identity.scalar {
            Scalar::Single => task.run::<f32>(&mut device),
            Scalar::Double => task.run::<f64>(&mut device),
        }
    });
    done.map_err(|failure| match failure {
        Failure::Device { remedy, .. } if interrupted.load(Ordering::Relaxed) => {
            Failure::Interrupted { remedy }
        }
        failure => failure,
    })
}

fn open(arguments: &LinkArguments) -> Result<(Port, Box<dyn Transport>), Failure> {
    let Some(port) = &arguments.port else {
        return Err(Failure::Usage {
            cause: "which controller? --port is missing".to_owned(),
            remedy: "--port /dev/ttyACM0 or --port tcp:HOST:PORT".to_owned(),
        });
    };
    if matches!(port, Port::Tcp(_)) && arguments.baud.is_some() {
        return Err(Failure::Usage {
            cause: format!("--baud has no meaning with --port {port}"),
            remedy: "leave it out; it goes with a serial port".to_owned(),
        });
    }
    let transport = port.open(arguments.baud.unwrap_or(BAUD));
    let transport = transport.map_err(|error| no_port(port, &error))?;
    Ok((port.clone(), transport))
}

fn no_port(port: &Port, error: &io::Error) -> Failure {
    let remedy = match (port, error.kind()) {
        (Port::Serial(_), io::ErrorKind::PermissionDenied) => {
            "on Linux, join the group that owns it: sudo usermod -aG dialout $USER, then log in again"
        }
        (Port::Serial(_), _) => "check the name (ls /dev/ttyACM* /dev/ttyUSB*) and the cable",
        (Port::Tcp(_), _) => "check the address, and that the serial server runs",
    };
    Failure::Device {
        cause: format!("{port}: cannot be opened: {error}"),
        remedy: remedy.to_owned(),
    }
}
