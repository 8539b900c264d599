//! Accuracy of positions and parameters.

pub mod budget;
pub mod expanded;
pub(crate) mod improvement;
pub mod information;
pub mod position_error;
pub(crate) mod quantiles;
pub mod repeats;
pub mod rigid_motion;
pub mod tilt;
pub mod uncertainty;
