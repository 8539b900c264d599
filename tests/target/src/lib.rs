//! What host and target run alike: the example's measurements, a fixture that takes the core
//! through all of its methods and writes down every bit that comes out, and random calibrations of
//! every kind. On the target also the board.

#![no_std]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]
#![allow(clippy::expect_used)] // of constants and simulated robots: a panic ends the run with a failure

#[cfg(target_os = "none")]
pub mod board;
pub mod cases;
pub mod fixture;
mod measurements;
mod record;
mod simulation;
mod stream;

pub use measurements::{SAMPLES, noise, nominal, samples};
pub use record::Scalar;
pub use simulation::{measurements_of, robot_near, tolerance};
