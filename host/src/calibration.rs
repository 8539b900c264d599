//! From two files to a calibration that is good, or to the reasons why it is not.

pub mod calibrate;
pub mod diagnosis;
pub mod noise_test;
mod outliers;
mod plausibility;
pub mod refusal;
pub mod report;
pub(crate) mod warnings;
