//! What host and target run alike: the example's measurements, a fixture that takes the core
//! through all of its methods and writes down every bit that comes out, and random calibrations of
//! every kind. On the target also what counts
//! instructions and stack.

#![no_std]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]
#![allow(clippy::expect_used)] // of constants and simulated robots: a panic ends the run with a failure

#[cfg(target_os = "none")]
pub mod bare;
pub mod cases;
// Those of the example, so that a fault ends the run here as well.
#[cfg(target_os = "none")]
#[path = "../../../firmware-example/src/faults.rs"]
mod faults;
pub mod fixture;
#[cfg(feature = "linear")]
pub mod linear;
mod measurements;
mod stream;

#[cfg(target_os = "none")]
pub use bare::{Counter, Overflow, stack_of};
pub use fixture::Scalar;
pub use measurements::{SAMPLES, measurements_of, noise, nominal, robot_near, samples, tolerance};

/// The program that writes a text: to the console of the target, or to the host's standard output.
#[macro_export]
macro_rules! program {
    ($write:path) => {
        #[cfg(target_os = "none")]
        #[cortex_m_rt::entry]
        fn main() -> ! {
            $crate::bare::run(|console| $write(console))
        }

        #[cfg(not(target_os = "none"))]
        fn main() -> core::fmt::Result {
            let mut lines = String::new();
            $write(&mut lines)?;
            print!("{lines}");
            Ok(())
        }
    };
}
