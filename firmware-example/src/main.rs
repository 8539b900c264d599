//! The firmware: a controller whose control loop never stops while it recalibrates its robot.
//!
//! ```text
//! cargo build --profile firmware -p delta-cal-firmware-example --features board --target thumbv7em-none-eabihf
//! qemu-system-arm -machine mps2-an386 -nographic -monitor none \
//!     -serial tcp:127.0.0.1:PORT,server=on,wait=on,nodelay=on \
//!     -semihosting-config enable=on,target=native -icount shift=6 \
//!     -kernel target/thumbv7em-none-eabihf/firmware/delta-cal-firmware-example > LOG
//! ```
//!
//! One program for a Cortex-M4F (`mps2-an386`) and a Cortex-M7 (`mps2-an500`). The log is in `defmt` format. For
//! another board, only `board.rs` changes. On a host, only the library is built.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod faults;
#[cfg(target_os = "none")]
mod firmware;

/// The firmware's scalar type.
#[cfg(all(target_os = "none", not(feature = "double")))]
type Number = f32;
#[cfg(all(target_os = "none", feature = "double"))]
type Number = f64;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("The firmware is built with --target thumbv7em-none-eabihf.");
}
