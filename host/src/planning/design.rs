//! Optimal experimental design: of many candidates those that together leave least unknown.

mod exchange;
mod lanes;
mod search;
mod source;

pub(super) use search::{Effort, added, all_over, nearer};
pub use source::Criterion;
pub(super) use source::{Rows, Source};
