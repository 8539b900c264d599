//! Measuring the stack.

use core::ptr::{read_volatile, write_volatile};

/// What the free stack is painted with.
const PAINT: u32 = 0xa5c3_5a3c;
/// How much of it; more use than this shows as exactly this.
const PAINTED: usize = 48 * 1024;

/// What this function's own callees may take while they paint and look. Work that takes less shows
/// as taking this much.
const MARGIN: usize = 256;

/// Bytes of stack that `work` uses, its own frame included: the free stack is painted, and the
/// deepest word that has changed counts. What a frame reserves at its very end and never
/// writes does not show.
#[inline(never)]
pub fn stack_of(work: &mut dyn FnMut()) -> usize {
    // This function's own frame lies above.
    let pointer = cortex_m::register::msp::read() as usize & !3;
    let top = pointer - MARGIN;
    let bottom = top - PAINTED;
    paint(bottom, top);
    work();
    pointer - lowest_changed(bottom, top)
}

// Both read and write the free part of the stack, which belongs to nobody: it begins below what
// they use themselves, and ends far from the stack's end (the linker script gives it 112 KiB;
// beyond it the access faults).
// Loops without iterators, whose calls need more than the margin where the compiler does not inline them.
#[allow(unsafe_code)]
fn paint(bottom: usize, top: usize) {
    let mut address = bottom;
    while address < top {
        unsafe { write_volatile(address as *mut u32, PAINT) };
        address += size_of::<u32>();
    }
}

#[allow(unsafe_code)] // as above
fn lowest_changed(bottom: usize, top: usize) -> usize {
    let mut address = bottom;
    while address < top && unsafe { read_volatile(address as *const u32) } == PAINT {
        address += size_of::<u32>();
    }
    address
}
