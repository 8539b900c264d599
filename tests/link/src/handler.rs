//! What a surviving panic path would call.
#![allow(unsafe_code)] // naming a symbol, and calling one that nobody defines

use core::panic::PanicInfo;

unsafe extern "C" {
    fn a_panic_path_survives() -> !;
}

#[panic_handler]
fn panicked(_: &PanicInfo<'_>) -> ! {
    unsafe { a_panic_path_survives() }
}

/// Has a panic path: an index that the optimiser cannot know.
#[unsafe(no_mangle)]
extern "C" fn panics_on_purpose(numbers: &[u32; 4], index: usize) -> u32 {
    numbers[index]
}
