//! A [`CalibrationReport`](crate::calibration::report::CalibrationReport) for people and for programs.

mod causes;
mod combination;
mod comparison;
mod expanded;
pub mod html;
pub mod json;
mod names;
mod next;
pub mod observations;
mod sections;
pub mod stream;
mod suspected;
pub mod table;
mod uncertain;
