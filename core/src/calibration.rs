//! The IKM calibration: each arm's eight parameters from its own samples.
//!
//! ```text
//! minimise  Σ (f(P; Xₖ, qₖ)/σf,ₖ)²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! ```

mod arm_problem;
mod calibrator;
#[cfg(test)]
mod curve;
mod free_start;
mod identifiability;
mod iteration;
mod joint_calibrator;
mod joint_problem;
mod judgement;
pub mod limits;
mod minimizer;
mod outcome;
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

pub use crate::samples::Triangle;
pub(crate) use arm_problem::Normal;
pub use calibrator::Calibrator;
pub use joint_calibrator::{JointCalibrator, JointSolver};
pub use joint_problem::JointNormal;
pub(crate) use minimizer::enough_samples;
pub use minimizer::{Minimizer, Progress};
pub use outcome::{ArmOutcome, Estimate, JointOutcome, RobotOutcome, StartUsed, Termination};
#[cfg(test)]
pub(crate) use problem::sum_of_squares;
pub use problem::{Piece, Prior, Problem};
pub use refusal::{Instrument, Refusal};
pub(crate) use robot_solver::prior_of_arm;
pub use robot_solver::{ArmSolver, RobotSolver};
pub use settings::{Settings, Solver, Start};
pub use tolerance::{Tolerance, ToleranceError};
pub use tolerance_prior::TolerancePrior;
