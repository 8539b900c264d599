//! What the residuals of a fit show that the model does not hold: directed tests.
//!
//! ```text
//! residuals of a row   Lₖ⁻¹ (mₖ − h(FK(P; qₖ), u)) = Lₖ⁻¹ (J δ(P, u) + C a) + noise
//! ```
//!
//! P are the parameters and u the instruments' unknowns, with the rows of what is known of them. Each hypothesis has its columns C. Its gain is by how much the sum of squares
//! falls with it, all parameters being fitted again; so the robot need not be the optimum of this sum.

mod cause;
mod hypotheses;
mod regression;
mod search;
mod selection;
mod subject;

pub use cause::{Alternative, Cause, CauseKind};
pub use search::Causes;
pub(crate) use search::causes;
pub use subject::ArmResiduals;
pub(crate) use subject::Subject;
