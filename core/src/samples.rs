//! Measurements, and the constant-memory form that keeps all that they say: a triangular factor.

mod displacement;
mod factor;
mod noise;
mod nominal_arm;
mod sample;
mod triangle;
mod waiting;

pub(crate) use displacement::{Displacement, corrected_arm};
pub(crate) use factor::BLOCK;
pub use factor::{ArmFactor, MergeError};
pub use noise::{Noise, NoiseError};
pub(crate) use nominal_arm::ArmSample;
pub use nominal_arm::NominalArm;
pub use sample::{Sample, SampleError};
pub(crate) use triangle::Triangle;
pub(crate) use waiting::Waiting;
