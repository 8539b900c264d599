use core::ptr::{read_volatile, write_volatile};

/// What the free stack is painted with.
const PAINT: u32 = 0xa5c3_5a3c;
/// How much of it; more use than this shows as exactly this.
const PAINTED: usize = 48 * 1024;

/// Bytes of stack that `work` uses, its own frame included: the free stack is painted, and the
/// deepest word that has changed counts. What a frame reserves at its very end and never
/// writes does not show.
#[inline(never)]
pub fn stack_of(work: &mut dyn FnMut()) -> usize {
    // This function's own frame lies above.
    let top = cortex_m::register::msp::read() as usize & !3;
    let bottom = top - PAINTED;
    paint(bottom, top);
    work();
    top - lowest_changed(bottom, top)
}

// Reads and writes the free part of the stack, which belongs to nobody: nothing is called between
// reading the stack pointer and the last write, and the region is far from the stack's end (the
// linker script gives it 112 KiB; beyond it the access faults).
#[allow(unsafe_code)]
#[inline(always)]
fn paint(bottom: usize, top: usize) {
    for address in (bottom..top).step_by(size_of::<u32>()) {
        unsafe { write_volatile(address as *mut u32, PAINT) };
    }
}

#[allow(unsafe_code)] // as above
#[inline(always)]
fn lowest_changed(bottom: usize, top: usize) -> usize {
    (bottom..top)
        .step_by(size_of::<u32>())
        .find(|address| unsafe { read_volatile(*address as *const u32) } != PAINT)
        .unwrap_or(top)
}
