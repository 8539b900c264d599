//! Where a robot may be: limits of the joints and of the ball joints.

pub(crate) mod directions;
pub(crate) mod joint_limits;
pub mod range;
pub mod reach;
pub(crate) mod sweep;
