//! What the residuals of a fit show that the model does not hold: directed tests.
//!
//! ```text
//! residual of the position   Lₖ⁻¹ (Xₖ − FK(P; qₖ)) = Lₖ⁻¹ (J δP + C a) + noise
//! ```
//!
//! δP are the 24 parameters with the rows of the tolerance, and with a tolerance the six unknowns of
//! the sensor's frame. Each hypothesis has its columns C. Its gain is by how much the sum of squares
//! falls with it, all parameters being fitted again; so the robot need not be the optimum of this sum.

mod cause;
mod discrepancy;
mod hypotheses;
mod regression;
mod residuals;
mod search;
mod selection;
mod subject;

pub use cause::{Alternative, Cause, CauseKind};
pub use residuals::ArmResiduals;
pub use search::Causes;
pub(crate) use search::causes;
pub(crate) use subject::Subject;
pub(in crate::calibration) use subject::frame_movements;
