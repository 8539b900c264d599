//! Where the platform is at given joint angles, and the other way round.
//!
//! Everything rests on one constraint per arm (paper, equation (3.8), with the square that its
//! right-hand side lacks in print):
//!
//! ```text
//! f(P; X, q) = |X − B(q)|² − Lb² = 0
//! ```

mod constraint;
mod poses;

pub use constraint::{PlatformJacobian, SingularityDistance};
pub(crate) use constraint::{constraint_gradient, linear_gradient};
pub use poses::{JointLimits, JointLimitsError, KinematicsError, Singularity};
