//! Numbers and lists in sentences.

pub mod joint;
pub mod numbers;
pub mod tolerance;
pub mod units;
pub mod words;
