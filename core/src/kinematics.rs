//! Forward and inverse kinematics.
//!
//! Everything is based on one constraint per arm (paper, equation (3.8), with the square that the printed right-hand
//! side omits):
//!
//! ```text
//! f(P; X, q) = |X − B(q)|² − Lb² = 0
//! ```

mod constraint;
mod poses;

pub(crate) use constraint::constraint_gradient;
pub use constraint::{PlatformJacobian, SingularityDistance};
pub use poses::{JointLimits, KinematicsError};
