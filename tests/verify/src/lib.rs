//! What the checks and the tests share: building for the bare target, running under QEMU.

#![forbid(unsafe_code)]

pub mod firmware;
