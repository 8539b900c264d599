//! What is wrong with a file of samples as a whole: columns exchanged, a wrong sign, another unit,
//! a mirrored frame. Each fault is undone and the samples compared with the robot of the file; the
//! faults without which they agree clearly better are named. Nothing is ever corrected.

mod evidence;
mod explanation;
mod hypothesis;
mod search;
mod words;

pub use explanation::{Diagnosis, Explanation};
pub(crate) use search::diagnose;
