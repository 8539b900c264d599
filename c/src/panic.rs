//! What Rust demands of an image without a standard library. No path leads here; `cargo verify c` looks.

use core::panic::PanicInfo;

#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    loop {}
}
