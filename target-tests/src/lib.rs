//! What host and target run alike: the example's measurements and a fixture that takes the core
//! through all of its methods and writes down every bit that comes out.

#![no_std]
#![forbid(unsafe_code)]
#![allow(clippy::expect_used)] // of the fixture's own constants: a panic ends the run with a failure

pub mod fixture;
mod measurements;
mod record;

pub use measurements::{SAMPLES, noise, nominal, samples};
pub use record::Scalar;
