//! A [`PosePlan`](crate::planning::poses::PosePlan) for people and for programs.

pub mod json;
pub mod table;
