//! Measurements, and the constant-memory form that keeps all that they say: a triangular factor.

mod count;
mod displacement;
mod factor;
mod joint_factor;
mod linear_displacement;
mod mean_pose;
mod noise;
mod nominal_arm;
mod sample;
mod triangle;
mod waiting;
mod whitened_sample;

pub(crate) use displacement::{Displacement, corrected_arm, moved_arm};
pub(crate) use factor::BLOCK;
pub use factor::{ArmFactor, MergeError};
pub use joint_factor::JointFactor;
#[cfg(test)]
pub(crate) use joint_factor::tests as joint_factor_tests;
pub(crate) use joint_factor::{JOINT_COLUMNS, LeftOver};
pub use noise::{Noise, NoiseError};
pub(crate) use nominal_arm::ArmSample;
pub use nominal_arm::NominalArm;
pub use sample::{Sample, SampleError};
pub(crate) use sample::{check_joint, check_weight};
pub use triangle::Triangle;
pub(crate) use triangle::put_row;
pub(crate) use waiting::Waiting;
pub use whitened_sample::JointDisplacement;
pub(crate) use whitened_sample::WhitenedSample;
