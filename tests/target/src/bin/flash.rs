//! A firmware that does nothing but calibrate, arm by arm. Built only to be looked at.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../firmware.rs"]
mod firmware;

#[cfg(target_os = "none")]
use delta_cal::calibration::Ikm as Chosen;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("Only its size counts: build it with --target thumbv7em-none-eabihf.");
}
