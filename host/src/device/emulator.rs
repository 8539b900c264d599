//! A board that QEMU emulates, as a link.

mod build;
mod flash;
mod monitor;

pub use build::{FirmwareError, build, check as check_firmware};
pub use flash::FlashError;

use super::transport::{Board, Tcp, Transport};
use crate::files::output::OutputError;
use flash::{FlashFile, SaveError};
use monitor::Monitor;
use std::error::Error;
use std::fmt;
use std::io::{self, Read};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::NamedTempFile;

const QEMU: &str = "qemu-system-arm";
/// Decodes `defmt` from standard input.
const LOG_DECODER: &str = "defmt-print";
/// It connects within some ten milliseconds.
const STARTS_WITHIN: Duration = Duration::from_secs(20);
/// From closing its connections to its end.
const ENDS_WITHIN: Duration = Duration::from_secs(1);
const LOOK: Duration = Duration::from_millis(5);

/// How much emulated time an instruction takes, whatever it would take on a real core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// 64 ns, about what a slow part takes: a calibration spans some ten turns of the control loop.
    Slow,
    /// 8 ns, so that the loop keeps its pace in `f64` computed by software.
    Fast,
}

impl Pace {
    /// The logarithm to the base 2 of its nanoseconds.
    const fn shift(self) -> u32 {
        match self {
            Self::Slow => 6,
            Self::Fast => 3,
        }
    }

    /// How many instructions fit into the time of so many timer ticks; `None` without a timer.
    pub fn instructions(self, ticks: u32, ticks_a_second: u32) -> Option<u64> {
        let nanoseconds = (u64::from(ticks) * 1_000_000_000).checked_div(ticks_a_second.into())?;
        Some(nanoseconds >> self.shift())
    }
}

/// What is emulated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emulation {
    /// The board.
    pub board: Board,
    /// The firmware, an ELF file.
    pub firmware: PathBuf,
    /// How fast it runs.
    pub pace: Pace,
    /// The controller's flash is read from this file, if it is there, and written to it at the end.
    pub flash: Option<PathBuf>,
    /// Whether the firmware's log is decoded and printed to standard error.
    pub log: bool,
}

/// Why nothing is emulated.
#[derive(Debug)]
pub enum EmulatorError {
    /// QEMU is not installed.
    Missing,
    /// QEMU cannot be started, or does not connect.
    Start(io::Error),
    /// QEMU ended at once.
    Ended(String),
    /// The program that decodes the log is not installed.
    NoLog(io::Error),
    /// The file of the controller's flash.
    Flash(FlashError),
    /// The flash could not be read at the end.
    FlashLost(io::Error),
    /// Its file could not be written at the end.
    Output(OutputError),
}

impl From<FlashError> for EmulatorError {
    fn from(error: FlashError) -> Self {
        Self::Flash(error)
    }
}

impl fmt::Display for EmulatorError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => write!(formatter, "the emulator {QEMU} is not installed"),
            Self::Start(error) => write!(formatter, "{QEMU} does not start: {error}"),
            Self::Ended(said) => write!(formatter, "{QEMU} ended at once: {said}"),
            Self::NoLog(error) => {
                write!(formatter, "the log cannot be shown: {LOG_DECODER}: {error}")
            }
            Self::Flash(error) => error.fmt(formatter),
            Self::FlashLost(error) => {
                write!(formatter, "the emulated flash cannot be read: {error}")
            }
            Self::Output(error) => error.fmt(formatter),
        }
    }
}

impl Error for EmulatorError {}

impl EmulatorError {
    /// What to do next.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Missing => {
                "install it: apt-get install qemu-system-arm (macOS: brew install qemu)"
            }
            Self::Start(_) | Self::Ended(_) => "check that the firmware is one for this board",
            Self::NoLog(_) => "install its decoder: cargo install defmt-print; or leave out --log",
            Self::Flash(error) => error.remedy(),
            Self::FlashLost(_) | Self::Output(_) => "the file of --flash is as it was before",
        }
    }
}

/// A running emulation and the link to its serial port. Ends with it.
#[derive(Debug)]
pub struct Emulator {
    link: Tcp,
    monitor: Monitor,
    flash: Option<FlashFile>,
    process: Process,
    /// Ends by itself after QEMU, with the last line of the log.
    _log: Option<Log>,
    /// The firmware with the flash's content, as long as QEMU may read it.
    _firmware: Option<NamedTempFile>,
}

/// A child that does not outlive its owner.
#[derive(Debug)]
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program that decodes the log.
#[derive(Debug)]
struct Log(Child);

impl Log {
    /// Starts it; the log is to be written to the second.
    fn start(firmware: &Path) -> Result<(Self, Stdio), EmulatorError> {
        let mut child = Command::new(LOG_DECODER)
            .arg("-e")
            .arg(firmware)
            .stdin(Stdio::piped())
            .stdout(io::stderr())
            .spawn()
            .map_err(EmulatorError::NoLog)?;
        let input = child.stdin.take().map_or_else(Stdio::null, Stdio::from);
        Ok((Self(child), input))
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        let _ = self.0.wait();
    }
}

impl Emulator {
    /// Starts QEMU, which connects to this process: no port is guessed.
    ///
    /// # Errors
    /// QEMU is missing or does not start; a flash file that is not one.
    pub fn start(emulation: &Emulation) -> Result<Self, EmulatorError> {
        let (flash, programmed) = match &emulation.flash {
            None => (None, None),
            Some(file) => {
                let (flash, programmed) = FlashFile::prepare(file, &emulation.firmware)?;
                (Some(flash), programmed)
            }
        };
        let firmware = programmed
            .as_ref()
            .map_or(emulation.firmware.as_path(), NamedTempFile::path);
        let (serial, monitor) = (listen()?, listen()?);
        let (log, output) = if emulation.log {
            let (log, output) = Log::start(&emulation.firmware)?;
            (Some(log), output)
        } else {
            (None, Stdio::null())
        };
        let mut command = Command::new(QEMU);
        command
            .args(["-machine", machine(emulation.board)])
            .args("-nographic -semihosting-config enable=on,target=native".split(' '))
            .args(["-icount", &format!("shift={}", emulation.pace.shift())])
            .args(["-serial", &connect_to(&serial)?])
            .args(["-monitor", &connect_to(&monitor)?])
            .arg("-kernel")
            .arg(firmware)
            .stdin(Stdio::null())
            .stdout(output)
            .stderr(Stdio::piped());
        // Ctrl-C is for this process, which then ends the emulation in order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let spawned = command.spawn();
        // With it goes this process's end of the log, which so ends with QEMU.
        drop(command);
        let mut process = Process(spawned.map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => EmulatorError::Missing,
            _ => EmulatorError::Start(error),
        })?);
        let monitor = accept(&monitor, &mut process)?;
        let serial = accept(&serial, &mut process)?;
        Ok(Self {
            link: Tcp::of(serial).map_err(EmulatorError::Start)?,
            monitor: Monitor::new(monitor),
            flash,
            process,
            _log: log,
            _firmware: programmed,
        })
    }

    /// Ends the emulation; the flash is written to its file first.
    ///
    /// # Errors
    /// The flash could not be read or its file not be written.
    pub fn end(mut self) -> Result<(), EmulatorError> {
        let Some(flash) = &self.flash else {
            return Ok(());
        };
        flash.save(&mut self.monitor).map_err(|error| match error {
            SaveError::Memory(error) => EmulatorError::FlashLost(error),
            SaveError::File(error) => EmulatorError::Output(error),
        })
    }

    /// How the emulated controller ended, if it did by itself.
    ///
    /// A link that just broke is the first sign of it: then `link_broke` lets it wait for the end.
    pub fn ended(&mut self, link_broke: bool) -> Option<String> {
        let start = Instant::now();
        let status = loop {
            match self.process.0.try_wait().ok()? {
                Some(status) => break status,
                None if link_broke && start.elapsed() < ENDS_WITHIN => std::thread::sleep(LOOK),
                None => return None,
            }
        };
        let said = last_words(&mut self.process);
        Some(format!(
            "the emulated controller stopped ({status}): {said}"
        ))
    }
}

impl Transport for Emulator {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.link.write(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.link.read(buffer, timeout)
    }
}

const fn machine(board: Board) -> &'static str {
    match board {
        Board::M4 => "mps2-an386",
        Board::M7 => "mps2-an500",
    }
}

fn listen() -> Result<TcpListener, EmulatorError> {
    let listener = TcpListener::bind(("127.0.0.1", 0)).map_err(EmulatorError::Start)?;
    listener
        .set_nonblocking(true)
        .map_err(EmulatorError::Start)?;
    Ok(listener)
}

fn connect_to(listener: &TcpListener) -> Result<String, EmulatorError> {
    let address = listener.local_addr().map_err(EmulatorError::Start)?;
    // Without a delay: an answer goes out byte by byte, and must not wait for acknowledgements.
    Ok(format!("tcp:{address},nodelay=on"))
}

fn accept(listener: &TcpListener, process: &mut Process) -> Result<TcpStream, EmulatorError> {
    let start = Instant::now();
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream
                    .set_nonblocking(false)
                    .map_err(EmulatorError::Start)?;
                return Ok(stream);
            }
            Err(error) if error.kind() != io::ErrorKind::WouldBlock => {
                return Err(EmulatorError::Start(error));
            }
            Err(_) => {}
        }
        if process.0.try_wait().is_ok_and(|status| status.is_some()) {
            return Err(EmulatorError::Ended(last_words(process)));
        }
        if start.elapsed() > STARTS_WITHIN {
            return Err(EmulatorError::Start(io::ErrorKind::TimedOut.into()));
        }
        std::thread::sleep(LOOK);
    }
}

/// The last line of what a process that has ended said.
fn last_words(process: &mut Process) -> String {
    let mut said = Vec::new();
    if let Some(mut stderr) = process.0.stderr.take() {
        let _ = stderr.read_to_end(&mut said);
    }
    let said = String::from_utf8_lossy(&said);
    let last = said.lines().rfind(|line| !line.trim().is_empty());
    last.unwrap_or("without a word").trim().to_owned()
}
