//! What is wrong with a file: all of its rows in the same way, or single ones. Each mistake is undone and the rest judged.

mod fault;
mod files;
mod rows;

pub use files::{Diagnosis, Explanation};
pub(crate) use files::{commanded, diagnose};
pub(crate) use rows::{FEWEST, MOST_WRONG, beside_the_platform_point, shifted_rows, wrong_rows};
