//! How well positions and parameters are known.

pub mod evaluation;
pub(crate) mod information;
pub mod position_error;
pub mod position_uncertainty;
pub mod workspace_comparison;
