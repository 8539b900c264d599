//! Optimal experimental design: of many candidates those that together leave least unknown.

mod exchange;
mod lanes;
mod search;
mod source;

pub use exchange::Criterion;
pub(super) use search::{Effort, added, all_over, nearer};
pub(super) use source::{Rows, Source};
