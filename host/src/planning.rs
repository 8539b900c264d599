//! Which poses to measure, and whether measured ones suffice.

mod design;
pub mod measurements;
pub mod observability;
pub mod poses;
