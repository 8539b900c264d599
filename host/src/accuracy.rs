//! How well positions and parameters are known.

pub mod evaluation;
pub(crate) mod improvement;
pub mod information;
pub mod position_error;
pub(crate) mod quantiles;
pub mod rigid_motion;
pub mod uncertainty;
