//! Measurements, and the triangular factor that holds their information in constant memory.

mod displacement;
mod factor;
mod forgetting;
mod joint_factor;
mod linear_displacement;
mod nominal_arm;
mod sample;
pub(crate) mod triangle;
mod unknowns;
mod whitened_sample;

pub(crate) use displacement::{Displacement, corrected_arm, moved_arm, nearest_turn, small_turn};
pub use factor::MergeError;
pub(crate) use factor::{ArmFactor, Waiting};
pub use forgetting::Forgetting;
pub(crate) use joint_factor::{JOINT_COLUMNS, JointFactor, LeftOver};
pub(crate) use nominal_arm::{FARTHEST_SQUARED, FEATURES, NominalArm, ONE};
pub(crate) use sample::check_joint;
pub use sample::{Noise, Sample, SampleError};
pub use triangle::Triangle;
pub(crate) use triangle::{part, put_row, squares};
pub use unknowns::Unknowns;
pub(crate) use whitened_sample::{JointDisplacement, WhitenedSample};
