//! Figures, pages, and what is written to a terminal.

pub(crate) mod page;
pub mod plot;
pub(crate) mod terminal;
