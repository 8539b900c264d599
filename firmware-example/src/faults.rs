//! Panics and faults end the run under QEMU with a failure; on a real board they would reset it.

use core::fmt::{self, Write as _};
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug::{self, EXIT_FAILURE};
use cortex_m_semihosting::hio;

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

/// Reports the cause, as far as that still works, and ends with a failure: a fault must not hang the run. Bypasses the
/// log, which a fault may have interrupted.
pub(crate) fn fail(why: fmt::Arguments<'_>) -> ! {
    if let Ok(mut stream) = hio::hstderr() {
        let _ = writeln!(stream, "\nFAILED {why}");
    }
    loop {
        debug::exit(EXIT_FAILURE);
    }
}
