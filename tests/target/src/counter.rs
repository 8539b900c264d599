//! Counting instructions.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

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
