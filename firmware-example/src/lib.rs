//! A Delta controller that recalibrates its own robot: everything except the board.
//!
//! Two activities run concurrently. The [`ControlLoop`] turns a thousand times a second in an interrupt and never
//! waits. In the background, the [`Controller`] answers the serial link, adds measurements, solves in bounded steps,
//! stores the result and, once that is safe, [hands it over](Handover). The two share only the memory of two lock-free
//! queues.
//!
//! Generic over the scalar, and also built for the host, where the fault tests run.

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

#[macro_use]
mod log;

mod control_loop;
mod controller;
mod geometry;
mod halves;
mod handover;
mod ram_flash;
mod session;
mod stream_store;

pub use control_loop::{BLEND_TURNS, Circle, ControlLoop, NewParameters, Path};
pub use controller::Controller;
pub use halves::{Halves, StoreError};
pub use handover::{Background, Foreground, Handover, Timer};
pub use ram_flash::{PAGE, ParameterFlash, RamFlash, StreamFlash, WORD};
pub use stream_store::{Number, StreamPace};

use delta_cal::robot::GeometryError;
use delta_cal::{Real, Robot, SymmetricRobot};

/// Turns of the control loop per second.
pub const TURNS_A_SECOND: u32 = 1000;

/// The robot as designed: that of Bentaleb and Iqbal (2020), in millimetres.
///
/// # Errors
/// None: the dimensions are valid.
pub fn nominal<T: Real>() -> Result<Robot<T>, GeometryError> {
    SymmetricRobot {
        base_radius: T::from_f64(194.0),
        platform_radius: T::from_f64(30.0),
        upper_arm: T::from_f64(260.0),
        forearm: T::from_f64(480.0),
    }
    .robot()
}
