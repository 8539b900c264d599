//! The robot: three arms of eight geometric parameters (Model 24), or of seven where carriages on towers drive
//! it.

mod arm;
mod arm_index;
mod drive;
mod geometry_error;
#[cfg(feature = "linear")]
mod linear;
mod parameter;
mod symmetric;
mod three_arms;
mod transmission;

pub use arm::{Arm, ArmBasis};
pub use arm_index::ArmIndex;
pub use drive::Drive;
pub(crate) use drive::DriveOf;
pub use geometry_error::GeometryError;
#[cfg(feature = "linear")]
pub use linear::SymmetricLinearRobot;
pub use parameter::{Parameter, ParameterKind};
pub use symmetric::SymmetricRobot;
pub use three_arms::Robot;
pub(crate) use transmission::{NUMBERS as TRANSMISSION_NUMBERS, by_numbers as by_transmission};
pub use transmission::{Transmission, TransmissionTolerance};
