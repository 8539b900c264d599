//! The functions in single precision.
#![allow(clippy::duplicate_mod)] // the same text for both scalars

macro_rules! name {
    ($name:literal) => {
        concat!("delta_cal_", $name, "_f32")
    };
}

/// `float` in C.
pub type Real = f32;

use crate::kind::OBSERVATION_ROW_F32 as OBSERVATION_ROW;

#[path = "scalar/calibrator.rs"]
pub mod calibrator;
#[path = "scalar/gate.rs"]
pub mod gate;
#[path = "scalar/joint.rs"]
pub mod joint;
#[path = "scalar/observations.rs"]
pub mod observations;
#[path = "scalar/outcome.rs"]
pub mod outcome;
#[path = "scalar/robot.rs"]
pub mod robot;
#[path = "scalar/sample.rs"]
pub mod sample;
#[path = "scalar/snapshot.rs"]
pub mod snapshot;
