//! What is written of a workspace: tables, JSON, CSV, mesh, figures, and all of it in HTML.

pub mod contents;
pub mod csv;
pub mod figures;
mod html;
pub mod json;
mod sections;
pub mod table;
mod viewer;

/// mm³ in a litre.
const LITRE: f64 = 1e6;
