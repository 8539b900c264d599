//! Figures, pages, and what is written to a terminal. What a report says is described once, as
//! sections and tables, and shown in both.

pub mod json;
pub(crate) mod named_figure;
pub(crate) mod page;
pub mod plot;
pub(crate) mod section;
pub(crate) mod table;
pub(crate) mod terminal;
