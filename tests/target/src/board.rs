//! The board under QEMU: console, end of the run, faults; counting instructions and stack.

mod counter;
mod stack;

pub use counter::{Counter, Overflow};
pub use stack::stack_of;

use core::fmt::{self, Write};
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};

/// Runs the program with the console and ends the emulation with its result.
pub fn run(program: impl FnOnce(&mut Console) -> fmt::Result) -> ! {
    let result = Console::open().and_then(|mut console| {
        program(&mut console)?;
        console.flush()
    });
    exit(if result.is_ok() {
        EXIT_SUCCESS
    } else {
        EXIT_FAILURE
    })
}

/// Standard output of the emulator. Collects what is written: each semihosting call stops the
/// processor.
#[allow(missing_debug_implementations)] // of the stream
pub struct Console {
    stream: HostStream,
    buffer: [u8; 1024],
    length: usize,
}

impl Console {
    fn open() -> Result<Self, fmt::Error> {
        Ok(Self {
            stream: hio::hstdout().map_err(|()| fmt::Error)?,
            buffer: [0; 1024],
            length: 0,
        })
    }

    fn flush(&mut self) -> fmt::Result {
        let (full, _) = self.buffer.split_at(self.length);
        self.stream.write_all(full).map_err(|()| fmt::Error)?;
        self.length = 0;
        Ok(())
    }
}

impl Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut rest = text.as_bytes();
        while !rest.is_empty() {
            if self.length == self.buffer.len() {
                self.flush()?;
            }
            let (_, free) = self.buffer.split_at_mut(self.length);
            let (now, later) = rest.split_at(rest.len().min(free.len()));
            free[..now.len()].copy_from_slice(now);
            self.length += now.len();
            rest = later;
        }
        Ok(())
    }
}

#[panic_handler]
fn panicked(info: &PanicInfo<'_>) -> ! {
    fail(format_args!("{info}"))
}

// `cortex-m-rt` requires these two to be `unsafe fn`; neither does anything unsafe.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    fail(format_args!("hard fault: {frame:?}"))
}

#[allow(unsafe_code)]
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    fail(format_args!("exception {number} has no handler"))
}

/// Says why, as far as that still works, and ends with a failure: a fault must not hang the run.
fn fail(why: fmt::Arguments<'_>) -> ! {
    if let Ok(mut stream) = hio::hstdout() {
        let _ = writeln!(stream, "\nFAILED {why}");
    }
    exit(EXIT_FAILURE)
}

fn exit(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}
