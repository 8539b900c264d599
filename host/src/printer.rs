//! A printer's configuration, from what it measured to what is wrong with it, what to measure next and what to
//! paste.

pub mod area;
pub mod assess;
pub mod error;
pub mod next;
