//! Panics and faults end the run under QEMU with a failure. Shared by all programs.

use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE};
use cortex_m_semihosting::hio;

/// Reports the cause, as far as that still works, and ends with a failure: a fault must not hang the run. A real board
/// would reset. Bypasses the log, which a fault may have interrupted.
pub(crate) fn fail(why: &str) -> ! {
    if let Ok(mut stream) = hio::hstderr() {
        let _ = stream.write_all(b"\nFAILED ");
        let _ = stream.write_all(why.as_bytes());
    }
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    fail("panic")
}

// `cortex-m-rt` requires the handlers to be `unsafe fn`; they do nothing unsafe.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    fail("hard fault: stack full?")
}

#[allow(unsafe_code)]
#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    fail("an exception without a handler")
}
