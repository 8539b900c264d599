//! The core, the protocol and the controller, on this machine and under QEMU; campaigns over many robots.

// In tests a panic is the failure; counts and seeds are small.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss
)]

mod accuracy;
mod board_page;
mod budgets;
mod controller;
mod derivatives;
mod exact;
mod gate;
mod hard_cases;
mod kinematics;
mod linear;
mod link_faults;
mod observations;
mod oracles;
mod outcomes;
mod refusals;
mod reset;
mod samples;
mod single_precision;
mod small_firmware;
mod stream_calibrator;
mod target;
