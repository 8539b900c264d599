//! Results for people and for programs.

pub mod calibration;
pub mod campaign;
pub mod document;
pub mod export;
pub mod plan;
pub mod printer;
pub mod validation;
pub mod workspace;
