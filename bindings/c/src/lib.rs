//! The core's calibration as a C library: `include/delta_cal.h` is the interface, `docs/c.md` the manual.
//!
//! Every object is in the caller's memory, behind a tag that identifies it. No function allocates, calls back or
//! panics; a function that refuses writes only its status and the reason.
//!
//! The folder `scalar` is compiled twice, for `f32` and for `f64`. The header is generated from these files,
//! documentation included: `tests/it/header.rs`.

#![cfg_attr(target_os = "none", no_std)]

pub mod error;
pub mod kind;
pub mod library;
mod memory;
pub mod plain;
pub mod status;

pub mod double;
pub mod single;

pub use memory::{Held, HeldMut, In, New, Out, Pointer};

/// The panic handler Rust requires in an image without a standard library. It is unreachable, which its tests verify.
#[cfg(all(feature = "panic-handler", target_os = "none"))]
#[panic_handler]
fn panicked(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
