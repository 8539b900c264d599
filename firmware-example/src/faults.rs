//! Panics and faults end the run under QEMU with a failure; on a real board they would reset it. Shared by all programs.

use super::fail;
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};

#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    fail("panic")
}

// `cortex-m-rt` requires it to be `unsafe fn`; it does nothing unsafe.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    fail("hard fault: stack full?")
}
