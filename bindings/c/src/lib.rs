//! The core's calibration as a library for C: `include/delta_cal.h` is the interface, `docs/c.md` the manual.
//!
//! Every object lies in memory of the caller, behind a tag that says what it is. No function allocates, calls back or
//! panics; whatever a function refuses, it writes nothing but its status and the reason.
//!
//! The folder `scalar` is compiled twice, for `f32` and for `f64`. The header is made from these files, documentation
//! included: `tests/header`.

#![cfg_attr(target_os = "none", no_std)]

pub mod error;
pub mod kind;
pub mod library;
mod memory;
#[cfg(all(feature = "panic-handler", target_os = "none"))]
mod panic;
pub mod plain;
pub mod status;

pub mod double;
pub mod single;

pub use memory::{Held, HeldMut, In, Many, New, Out};
