//! A printer's configuration, from the readings that it holds to what is wrong, what to measure next and what to
//! paste.

mod area;
mod assess;
mod next;

pub use area::{Area, Off};
pub use assess::{Change, Printer};
pub use next::Next;
