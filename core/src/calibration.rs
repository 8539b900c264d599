//! The IKM calibration: each arm's eight parameters from its own samples.
//!
//! ```text
//! minimise  Σ (f(P; Xₖ, qₖ)/σf,ₖ)²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//! ```

mod arm;
mod condition;
mod gate;
mod held_out;
mod judgement;
pub mod limits;
mod loss;
mod outcome;
mod problem;
mod refusal;
mod robot;
mod robust;
mod solver;
mod start;
pub mod step_control;
mod tolerance;

pub use arm::{ArmSolver, Progress};
pub use gate::{Alarm, Gate, GateCounts, GateError, Innovation, Untested, Verdict};
pub use held_out::{HeldOut, HeldOutRefusal, Validation};
pub use loss::{Loss, Worth};
pub use outcome::{ArmOutcome, RobotOutcome, StartUsed, Termination};
pub use problem::ArmProblem;
pub use refusal::Refusal;
pub use robot::{Calibrator, RobotCalibrator, RobotSolver, StoredCalibrator};
pub use robust::{RobustOutcome, RobustRefusal, WeighedSample, robust_fit};
pub use tolerance::{Tolerance, ToleranceError};

use crate::{Noise, Real};

/// How a step is taken from the linearised problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Method {
    /// The full step of the linearised problem, always. It can diverge, and then says so.
    GaussNewton,
    /// Damped until the step reduces the sum of squares (Levenberg 1944, Marquardt 1963).
    #[default]
    LevenbergMarquardt,
}

/// Where the iteration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Start {
    /// From the reference robot. With 12 or more samples the start without a guess is tried as
    /// well if the result fits worse than the samples allow.
    #[default]
    Reference,
    /// Without a guess, from the linear fit of c(P). Needs 12 samples.
    Free,
}

/// What a calibration assumes and how it is solved. The default: no noise weights, no prior,
/// Levenberg–Marquardt from the reference robot, at most 50 iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings<T> {
    /// Measurement noise; weights the samples and judges the residual.
    pub noise: Option<Noise<T>>,
    /// Manufacturing tolerance; the prior about the reference robot.
    pub tolerance: Option<Tolerance<T>>,
    /// Gauss–Newton or Levenberg–Marquardt.
    pub method: Method,
    /// Where to start.
    pub start: Start,
    /// Linearisations allowed for each start; a solve may make several starts.
    pub iteration_limit: u16,
}

impl<T: Real> Default for Settings<T> {
    fn default() -> Self {
        Self {
            noise: None,
            tolerance: None,
            method: Method::default(),
            start: Start::default(),
            iteration_limit: 50,
        }
    }
}
