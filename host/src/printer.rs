//! A printer's configuration, from the readings that it holds to what is wrong, what to measure next and what to
//! paste.

mod area;
mod assess;
mod next;
mod notes;

pub use area::{Area, BedMap, Off};
pub use assess::{Change, Printer};
pub use next::{Next, touches_of_bed};
pub(crate) use notes::{alike, common_scale};
