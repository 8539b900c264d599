//! The robot: three arms with eight geometric parameters each (Model 24), or seven if carriages on towers drive it.

mod arm;
mod parameter;
mod three_arms;
mod transmission;

pub(crate) use arm::ArmAt;
pub use arm::{Arm, ArmBasis};
pub use parameter::{ArmIndex, Drive, GeometryError, Parameter, ParameterKind};
pub(crate) use parameter::{DriveOf, OF_ARM, OF_ROBOT};
pub use three_arms::{Robot, SymmetricRobot};
pub(crate) use transmission::{NUMBERS as TRANSMISSION_NUMBERS, by_numbers as by_transmission};
pub use transmission::{Transmission, TransmissionTolerance};
