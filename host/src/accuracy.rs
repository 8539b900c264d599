//! How well positions and parameters are known.

pub(crate) mod chi_square;
pub mod coverage;
pub mod evaluation;
pub mod expected_error;
pub(crate) mod improvement;
pub mod information;
pub mod position_error;
pub mod position_uncertainty;
pub mod rigid_motion;
pub mod sampled;
pub mod uncertainty_map;
pub mod workspace_comparison;
pub mod workspace_poses;
