//! Which poses to measure, and whether measured ones suffice.

pub mod observability;
pub mod poses;
