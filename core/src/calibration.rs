//! Calibration from complete positions: [`IkmCalibrator`] solves each arm separately, [`JointCalibrator`] all together.
//!
//! ```text
//! minimise  Σ (f(P; Xₖ, qₖ)/σf,ₖ)²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! ```
//!
//! [`TolerancePrior`], [`Triangle`] and [`limits`] are for programs that judge results, not for firmware.

mod arm_problem;
mod arm_samples;
mod calibrator;
mod free_start;
mod identifiability;
mod iteration;
mod joint_problem;
mod joint_samples;
mod judgement;
pub mod limits;
mod minimizer;
mod outcome;
mod parts;
mod point;
mod problem;
mod refusal;
mod robot_solver;
mod settings;
mod snapshots;
mod starts;
pub(crate) mod step_control;
mod tolerance;
mod tolerance_prior;
mod upper_arm;

pub use crate::samples::{Triangle, Unknowns};
pub(crate) use arm_problem::Normal;
pub(crate) use arm_samples::{ArmSamples, workspace_centre};
pub(crate) use calibrator::Phase;
pub(crate) use calibrator::estimators::Parts;
pub use calibrator::{Calibrator, Estimator, Ikm, IkmCalibrator, Joint, JointCalibrator};
pub(crate) use free_start::{Means, correction_of};
pub(crate) use joint_problem::JointNormal;
pub(crate) use joint_samples::JointSamples;
pub(crate) use minimizer::Minimizer;
pub use minimizer::Progress;
pub(crate) use minimizer::enough_samples;
pub use outcome::{ArmOutcome, Estimate, JointOutcome, RobotOutcome, Start, Termination};
pub(crate) use parts::Samples;
#[cfg(test)]
pub(crate) use problem::sum_of_squares;
pub(crate) use problem::{Extent, Gradient, Judged, Piece, Problem};
pub use refusal::{Instrument, Refusal};
pub(crate) use robot_solver::is_below;
pub use settings::Settings;
pub use tolerance::Tolerance;
pub(crate) use tolerance::positive;
pub use tolerance_prior::TolerancePrior;
