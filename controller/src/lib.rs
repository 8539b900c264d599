//! A Delta controller that recalibrates its own robot: everything except the board.
//!
//! Two activities run concurrently. The [`ControlLoop`] turns in a timer's interrupt and never waits. In the background,
//! the [`Controller`] answers the serial link, adds measurements, solves in bounded steps, stores the result and, once
//! that is safe, [hands it over](Handover). The two share only the memory of two lock-free queues and two words.
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
mod limiter;
mod ram_flash;
mod session;
mod stream_store;

pub use control_loop::{ControlLoop, NewParameters, Path};
pub use controller::Controller;
pub use geometry::Machine;
pub use halves::{Halves, StoreError};
pub use handover::{Background, Foreground, Handover, Timer};
pub use limiter::{Limiter, Limits};
pub use ram_flash::{PAGE, ParameterFlash, RamFlash, StreamFlash, WORD};
pub use stream_store::{Number, StreamPace};
