//! Information about the library.
#![allow(unsafe_code)] // naming a symbol

use crate::kind::{ALIGNMENT, VERSION, size_of_kind};
use crate::status::{self, Status};
use core::ffi::c_char;

/// The version of the library that is linked. Compare it with `DCAL_VERSION`, that of the header: before 1.0 both
/// must agree in major and minor.
#[unsafe(export_name = "dcal_version")]
pub extern "C" fn version() -> u32 {
    VERSION
}

/// How many bytes an object takes in this build of the library, its tag included; at most the size that the header
/// gives it. `kind` is one of `DCAL_ROBOT_F32` and so on; 0 for a number that is no kind.
#[unsafe(export_name = "dcal_size")]
pub extern "C" fn size(kind: i32) -> usize {
    size_of_kind(kind)
}

/// The alignment of every object, in bytes.
#[unsafe(export_name = "dcal_alignment")]
pub extern "C" fn alignment() -> usize {
    ALIGNMENT
}

/// A status in English, one sentence ended by a zero. The text lies in constant memory. Never NULL.
#[unsafe(export_name = "dcal_status_text")]
pub extern "C" fn status_text(status: Status) -> *const c_char {
    // The macro that generates the texts puts a space in front of each.
    let text = status::text(status).to_bytes_with_nul();
    text.strip_prefix(b" ").unwrap_or(text).as_ptr().cast()
}
