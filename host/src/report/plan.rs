//! A [`PosePlan`](crate::planning::poses::PosePlan), a
//! [`MeasurementPlan`](crate::planning::measurements::MeasurementPlan) and a comparison of instruments, for
//! people and for programs.

pub mod comparison;
pub mod json;
pub mod measurements;
pub mod table;
