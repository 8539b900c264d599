//! Results for people and for programs.

pub mod calibration;
pub mod check;
pub mod plan;
pub mod workspace;
