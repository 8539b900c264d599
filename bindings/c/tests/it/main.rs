//! The library as C sees it: the same bits as the core, every misuse refused, the header made from the source, and C
//! programs that calibrate on this machine and under QEMU.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(unsafe_code)] // in the place of C

mod calibrations;
mod errors;
mod fixture;
mod fkm;
mod header;
mod misuse;
mod place;
