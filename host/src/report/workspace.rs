//! What is written of a workspace: tables, JSON, CSV, mesh, figures, and all of it in HTML.

pub mod contents;
pub mod csv;
pub mod figures;
mod html;
pub mod json;
pub mod table;
mod viewer;
