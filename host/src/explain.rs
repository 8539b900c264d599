//! What explains readings that the model, the noise or the tolerance do not: effects that are opened and then explain
//! significantly more, and rows that are wrong.
//!
//! ```text
//! fit ─→ scan: the gain of every hypothesis, to first order ─→ refit the best of each kind ─→ rank ─→ once more
//! ```

mod cause;
mod scan;
mod search;

pub use cause::{Cause, Causes, Step};
pub(crate) use search::{Found, search};
