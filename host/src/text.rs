//! Numbers and lists in sentences.

pub(crate) mod date;
pub(crate) mod joint;
pub(crate) mod numbers;
pub(crate) mod tolerance;
pub(crate) mod units;
pub(crate) mod words;
