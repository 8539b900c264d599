//! The link to the controller, from the command line to the first answer.

use super::args::LinkArguments;
use crate::cli::failure::Failure;
use crate::device::{
    Board, Client, Emulation, Emulator, EmulatorError, FirmwareError, Number, Pace, Patience, Port,
    Serial, Tcp, Transport, build, check_firmware,
};
use delta_cal_protocol::{Identity, Scalar};
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const BAUD: u32 = 115_200;
/// So soon is Ctrl-C heeded.
const LOOK: Duration = Duration::from_millis(100);
/// An emulation on a busy computer can be slow.
const EMULATED: Duration = Duration::from_secs(2);

/// What is done with a controller, whatever type it computes in.
pub(super) trait Task {
    fn run<T: Number>(self, device: &mut Device) -> Result<(), Failure>;
}

/// A controller that has said who it is.
pub(super) struct Device {
    pub(super) client: Client<Link>,
    pub(super) identity: Identity,
    pub(super) port: Port,
    /// Of an emulated one.
    pub(super) pace: Option<Pace>,
}

/// The link that Ctrl-C breaks, so that whatever is under way ends in order.
pub(super) struct Link {
    kind: Kind,
    interrupted: Arc<AtomicBool>,
}

enum Kind {
    Plain(Box<dyn Transport>),
    Emulated(Emulator),
}

impl Kind {
    fn transport(&mut self) -> &mut dyn Transport {
        match self {
            Self::Plain(transport) => transport,
            Self::Emulated(emulator) => emulator,
        }
    }
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
        self.kind.transport().write(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let mut left = timeout;
        loop {
            self.check()?;
            let wait = left.min(LOOK);
            let count = self.kind.transport().read(buffer, wait)?;
            left = left.saturating_sub(wait);
            if count > 0 || left.is_zero() {
                return Ok(count);
            }
        }
    }
}

/// Does something with the controller at the port, and ends the link in order.
pub(super) fn with_device(link: &LinkArguments, task: impl Task) -> Result<(), Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    // Without a handler Ctrl-C ends the process at once, which is no worse than having none.
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed));
    let (port, kind) = open(link)?;
    let pace = pace(link);
    let patience = match kind {
        Kind::Plain(_) => Patience::default(),
        Kind::Emulated(_) => Patience {
            timeout: EMULATED,
            deadline: EMULATED * 20,
            ..Patience::default()
        },
    };
    let seed = getrandom::u64().map_err(|error| Failure::Device {
        cause: format!("the system has no random numbers: {error}"),
        remedy: String::new(),
    })?;
    let link = Link {
        kind,
        interrupted: Arc::clone(&interrupted),
    };
    let mut client = Client::new(link, patience, seed);
    let done = match client.identity() {
        Err(error) => (client, Err(error.into())),
        Ok(identity) => {
            let pace = matches!(port, Port::Emulated(_)).then_some(pace);
            let mut device = Device {
                client,
                identity,
                port,
                pace,
            };
            let result = match identity.scalar {
                Scalar::Single => task.run::<f32>(&mut device),
                Scalar::Double => task.run::<f64>(&mut device),
            };
            (device.client, result)
        }
    };
    let (client, result) = done;
    let link = client.into_transport();
    let ended = match link.kind {
        Kind::Plain(_) => Ok(()),
        Kind::Emulated(mut emulator) => {
            match emulator.ended(matches!(result, Err(Failure::Device { .. }))) {
                Some(cause) => Err(Failure::Device {
                    cause,
                    remedy: "that is a fault of the firmware".to_owned(),
                }),
                None => emulator.end().map_err(emulation_failed),
            }
        }
    };
    match (result, ended) {
        (Err(failure), _) if interrupted.load(Ordering::Relaxed) => Err(match failure {
            Failure::Device { remedy, .. } => Failure::Interrupted { remedy },
            failure => failure,
        }),
        // The link broke because the emulation ended.
        (Err(Failure::Device { .. }), Err(ended @ Failure::Device { .. })) => Err(ended),
        (Err(failure), _) => Err(failure),
        (Ok(()), ended) => ended,
    }
}

fn open(link: &LinkArguments) -> Result<(Port, Kind), Failure> {
    let Some(port) = &link.port else {
        return Err(Failure::Usage {
            cause: "which controller? --port is missing".to_owned(),
            remedy: "--port /dev/ttyACM0, tcp:HOST:PORT, emulate:m4 or emulate:m7".to_owned(),
        });
    };
    let emulated = matches!(port, Port::Emulated(_));
    let serial = matches!(port, Port::Serial(_));
    for (option, given, fits, with) in [
        ("--baud", link.baud.is_some(), serial, "a serial port"),
        (
            "--firmware",
            link.firmware.is_some(),
            emulated,
            "emulate:m4 or emulate:m7",
        ),
        ("--log", link.log, emulated, "emulate:m4 or emulate:m7"),
        (
            "--double",
            link.double,
            emulated,
            "emulate:m4 or emulate:m7",
        ),
        (
            "--flash",
            link.flash.is_some(),
            emulated,
            "emulate:m4 or emulate:m7",
        ),
    ] {
        if given && !fits {
            return Err(Failure::Usage {
                cause: format!("{option} has no meaning with --port {port}"),
                remedy: format!("leave it out; it goes with {with}"),
            });
        }
    }
    let kind = match port {
        Port::Serial(path) => {
            let serial = Serial::open(path, link.baud.unwrap_or(BAUD));
            Kind::Plain(Box::new(serial.map_err(|error| no_port(port, &error))?))
        }
        Port::Tcp(address) => {
            let tcp = Tcp::connect(address);
            Kind::Plain(Box::new(tcp.map_err(|error| no_port(port, &error))?))
        }
        Port::Emulated(board) => Kind::Emulated(emulate(link, *board)?),
    };
    Ok((port.clone(), kind))
}

fn no_port(port: &Port, error: &io::Error) -> Failure {
    let remedy = match (port, error.kind()) {
        (Port::Serial(_), io::ErrorKind::PermissionDenied) => {
            "on Linux, join the group that owns it: sudo usermod -aG dialout $USER, then log in again"
        }
        (Port::Serial(_), _) => {
            "check the name (ls /dev/ttyACM* /dev/ttyUSB*) and the cable; without a board: --port \
             emulate:m4"
        }
        _ => "check the address, and that the serial server runs",
    };
    Failure::Device {
        cause: format!("{port}: cannot be opened: {error}"),
        remedy: remedy.to_owned(),
    }
}

fn emulate(link: &LinkArguments, board: Board) -> Result<Emulator, Failure> {
    let firmware = firmware(link).map_err(|error| Failure::Device {
        cause: error.to_string(),
        remedy: error.remedy().to_owned(),
    })?;
    let emulation = Emulation {
        board,
        firmware,
        pace: pace(link),
        flash: link.flash.clone(),
        log: link.log,
    };
    Emulator::start(&emulation).map_err(emulation_failed)
}

fn pace(link: &LinkArguments) -> Pace {
    if link.double { Pace::Fast } else { Pace::Slow }
}

fn firmware(link: &LinkArguments) -> Result<PathBuf, FirmwareError> {
    match &link.firmware {
        Some(file) => check_firmware(file).map(|()| file.clone()),
        None => build(link.double, || {
            let _ = writeln!(anstream::stderr(), "Building the firmware (cargo build)");
        }),
    }
}

fn emulation_failed(error: EmulatorError) -> Failure {
    if let EmulatorError::Output(error) = error {
        return error.into();
    }
    Failure::Device {
        cause: error.to_string(),
        remedy: error.remedy().to_owned(),
    }
}
