//! The IKM calibration: each arm's eight parameters from its own samples.
//!
//! ```text
//! minimise  Σ (f(P; Xₖ, qₖ)/σf,ₖ)²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! ```

mod arm_solver;
mod calibrator;
mod end_point;
mod free_start;
mod identifiability;
mod iteration;
mod judgement;
pub mod limits;
mod outcome;
mod problem;
mod refusal;
mod robot_solver;
pub(crate) mod row_by_row;
mod settings;
pub mod step_control;
mod tolerance;

pub use arm_solver::{ArmSolver, Progress};
pub(crate) use calibrator::nominal_arms;
pub use calibrator::{Calibrator, RobotCalibrator};
pub(crate) use free_start::free_start;
pub(crate) use identifiability::Identifiability;
pub use outcome::{ArmOutcome, RobotOutcome, StartUsed, Termination};
pub use problem::ArmProblem;
pub(crate) use problem::{Linearize, Means, Normal};
pub use refusal::Refusal;
pub use robot_solver::RobotSolver;
pub use settings::{Settings, Solver, Start};
pub use tolerance::{Tolerance, ToleranceError};
