//! Where the platform is at given joint angles, and the other way round.
//!
//! Everything rests on one constraint per arm (paper, equation (3.8), with the square that its
//! right-hand side lacks in print):
//!
//! ```text
//! f(P; X, q) = |X − B(q)|² − Lb² = 0
//! ```

mod constraint;
mod error;
mod forward;
mod inverse;
mod jacobian;
mod joint_limits;
mod singularity_distance;

pub(crate) use constraint::{constraint_gradient, linear_gradient};
pub use error::{KinematicsError, Singularity};
pub use jacobian::PlatformJacobian;
pub use joint_limits::{JointLimits, JointLimitsError};
pub use singularity_distance::SingularityDistance;
