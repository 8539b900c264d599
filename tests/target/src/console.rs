//! Programs under QEMU: their console, and the end of the run.

use core::fmt::{self, Write};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};

/// Runs the program with the console and ends the emulation with its result. What it wrote before a failure is shown.
pub fn run(program: impl FnOnce(&mut Console) -> fmt::Result) -> ! {
    let result = Console::open().and_then(|mut console| {
        let done = program(&mut console);
        console.flush().and(done)
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

fn exit(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}
