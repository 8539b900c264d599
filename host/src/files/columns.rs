//! What columns of a file hold, and by which names.

mod mapping;
mod quantity;

pub use mapping::ColumnMapping;
pub(crate) use quantity::{COUNT, ColumnName, Quantity, Unit, is_note};
