//! Tests of the command and of the library behind it, in one program: separate ones would each compile the generic core
//! and link the host again.

// In tests a panic is the failure; counts are small.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss
)]

mod support;

mod calibrate;
mod cases;
mod conventions;
mod cross;
mod device;
mod device_on_target;
mod diagnosis;
mod documents;
mod effects;
mod export;
mod faults;
mod help;
mod import;
mod intervals;
mod kinematics;
mod linuxcnc;
mod messages;
mod pipeline;
mod plan;
mod plot;
mod simulate;
mod table_formats;
mod tilt;
mod validate;
mod workspace;
