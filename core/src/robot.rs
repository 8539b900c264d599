//! The robot: three arms of eight geometric parameters (Model 24).

mod arm;
mod arm_index;
mod geometry_error;
mod parameter;
mod symmetric;
mod three_arms;

pub use arm::{Arm, ArmBasis};
pub use arm_index::ArmIndex;
pub use geometry_error::GeometryError;
pub use parameter::{Parameter, ParameterKind};
pub use symmetric::SymmetricRobot;
pub use three_arms::Robot;
