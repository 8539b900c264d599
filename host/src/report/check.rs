//! Whether poses determine the robot ([`Observability`](crate::planning::observability::Observability)), for
//! people and for programs.

pub mod json;
pub mod measurements;
pub mod table;
