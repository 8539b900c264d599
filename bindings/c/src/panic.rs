//! What Rust demands of an image without a standard library. No path leads here; its tests look.

use core::panic::PanicInfo;

#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    loop {}
}
