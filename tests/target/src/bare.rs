//! Programs under QEMU: their console, the end of the run, and counting instructions and stack.

use core::fmt::{self, Write};
use core::ptr::{read_volatile, write_volatile};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
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

/// At 64 ns an instruction (`-icount shift=6`) and 40 ns a tick of 25 MHz: eight ticks for five
/// instructions.
const TICKS: u32 = 8;
const INSTRUCTIONS: u32 = 5;
const RELOAD: u32 = 0x00ff_ffff;

/// Counts instructions with the `SysTick` timer, to within one.
#[allow(missing_debug_implementations)] // of the timer
pub struct Counter {
    timer: SYST,
    /// Ticks of counting nothing.
    overhead: u32,
}

/// The work took more instructions than the timer can count: ten million.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overflow;

impl Counter {
    /// Takes the timer. `None` if it is taken, or if it does not count instructions: a delay loop
    /// of two a turn shows that.
    pub fn start() -> Option<Self> {
        let mut timer = cortex_m::Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        let mut counter = Self { timer, overhead: 0 };
        counter.overhead = counter.ticks(|| {}).ok()?;
        let turns = 200_000_u32;
        let counted = counter.count(|| cortex_m::asm::delay(turns)).ok()?;
        (counted.abs_diff(2 * turns) < 10).then_some(counter)
    }

    /// Instructions of one call.
    ///
    /// # Errors
    /// [`Overflow`].
    pub fn count(&mut self, work: impl FnOnce()) -> Result<u32, Overflow> {
        let ticks = self.ticks(work)?.saturating_sub(self.overhead);
        Ok((ticks * INSTRUCTIONS + TICKS / 2) / TICKS)
    }

    #[inline]
    fn ticks(&mut self, work: impl FnOnce()) -> Result<u32, Overflow> {
        self.timer.clear_current();
        // The first tick reloads the timer; only then is a wrap an overflow.
        while SYST::get_current() == 0 {}
        let _ = self.timer.has_wrapped();
        let start = SYST::get_current();
        work();
        let end = SYST::get_current();
        if self.timer.has_wrapped() || end > start {
            return Err(Overflow);
        }
        Ok(start - end)
    }
}

/// What the free stack is painted with.
const PAINT: u32 = 0xa5c3_5a3c;
/// How much of it, if there is so much; more use than this shows as exactly this.
const PAINTED: usize = 48 * 1024;

/// What this function's own callees may take while they paint and look. Work that takes less shows
/// as taking this much.
const MARGIN: usize = 256;

/// Bytes of stack that `work` uses, its own frame included: the free stack is painted, and the
/// deepest word that has changed counts. What a frame reserves at its very end and never
/// writes does not show.
#[inline(never)]
pub fn stack_of(work: &mut dyn FnMut()) -> usize {
    // This function's own frame lies above.
    let pointer = cortex_m::register::msp::read() as usize & !3;
    let top = pointer - MARGIN;
    let bottom = (top - PAINTED).max(stack_end());
    paint(bottom, top);
    work();
    pointer - lowest_changed(bottom, top)
}

#[allow(unsafe_code)] // names what the linker script defines
fn stack_end() -> usize {
    unsafe extern "C" {
        static _stack_end: u8;
    }
    // SAFETY: its address alone is taken.
    let end = &raw const _stack_end;
    end as usize
}

// Both read and write the free part of the stack, which belongs to nobody: it begins below what
// they use themselves, and ends far from the stack's end (the linker script gives it 112 KiB;
// beyond it the access faults).
// Loops without iterators, whose calls need more than the margin where the compiler does not inline them.
#[allow(unsafe_code)]
fn paint(bottom: usize, top: usize) {
    let mut address = bottom;
    while address < top {
        unsafe { write_volatile(address as *mut u32, PAINT) };
        address += size_of::<u32>();
    }
}

#[allow(unsafe_code)] // as above
fn lowest_changed(bottom: usize, top: usize) -> usize {
    let mut address = bottom;
    while address < top && unsafe { read_volatile(address as *const u32) } == PAINT {
        address += size_of::<u32>();
    }
    address
}
