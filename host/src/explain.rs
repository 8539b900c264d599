//! What explains readings that the model, the noise or the tolerance do not: effects that are opened and then explain
//! significantly more, rows that are wrong, and mistakes in all rows of a file.
//!
//! ```text
//! fit ─→ scan: the gain of every hypothesis, to first order ─→ refit the best of each kind ─→ rank ─→ once more
//! undo each mistake of a whole file ─→ compare with the robot of the file
//! ```

mod cause;
mod fault;
mod files;
mod rows;
mod scan;
mod search;

pub use cause::{Cause, Causes, Step};
pub use files::{Diagnosis, Explanation};
pub(crate) use files::{commanded, diagnose, mistake};
pub(crate) use rows::{
    FEWEST, MOST_WRONG, beside_the_platform_point, explained_by_rods, shifted, shifted_rows,
};
pub(crate) use search::{Found, search};
