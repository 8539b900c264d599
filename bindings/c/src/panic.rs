//! The panic handler Rust requires in an image without a standard library. It is unreachable, which its tests verify.

use core::panic::PanicInfo;

#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    loop {}
}
