//! What all programs share under QEMU: flash that survives a reset, and the timer of the control loop.

use super::fail;
use core::mem::MaybeUninit;
use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use delta_cal_controller::{ParameterFlash, StreamFlash};
use delta_cal_firmware_example::TURNS_A_SECOND;

/// Clock frequency of the core and its timers, Hz.
pub(crate) const CLOCK: u32 = 25_000_000;
/// Ticks from one turn of the control loop to the next.
pub(crate) const TICKS_A_TURN: u32 = CLOCK / TURNS_A_SECOND;

/// Stands for two regions of flash: memory that survives a reset.
#[repr(C)] // the next firmware finds it in the same place
pub(crate) struct Flash {
    mark: u32,
    pub(crate) parameters: ParameterFlash,
    pub(crate) samples: StreamFlash,
}

/// Marks memory initialised since power-on.
const MARK: u32 = 0x64_63_61_6c;

/// Takes the core and the flash, once.
pub(crate) fn take() -> (Peripherals, &'static mut Flash) {
    #[allow(unsafe_code)] // the attribute that places it
    #[unsafe(link_section = ".storage")]
    static mut FLASH: MaybeUninit<Flash> = MaybeUninit::uninit();
    let Some(core) = Peripherals::take() else {
        fail("started twice")
    };
    // SAFETY: the peripherals are taken once, so this is reached once. Any bits are a valid `Flash`.
    #[allow(unsafe_code)]
    let flash = unsafe { &mut *(&raw mut FLASH).cast::<Flash>() };
    if flash.mark != MARK {
        flash.parameters.bytes.fill(0xff);
        flash.samples.bytes.fill(0xff);
        flash.mark = MARK;
    }
    (core, flash)
}

/// Interrupts at every turn of the control loop from now on.
pub(crate) fn start_turns(timer: &mut SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICKS_A_TURN - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}
