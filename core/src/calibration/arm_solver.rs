use super::minimizer::{Minimizer, enough_samples};
use super::outcome::ArmOutcome;
use super::refusal::Refusal;
use super::settings::Settings;
use super::tolerance::Tolerance;
use crate::Real;
use crate::robot::ArmIndex;
use crate::samples::{ArmFactor, Displacement, corrected_arm};

/// Calibrates one arm, one bounded step at a time, so that a control loop can interleave it.
///
/// A step takes the same time whatever the number of samples.
///
/// ```
/// use delta_cal::{ArmIndex, Progress, Settings, SymmetricRobot};
/// use delta_cal::calibration::ArmSolver;
/// use delta_cal::samples::{ArmFactor, NominalArm};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// # let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }.robot()?;
/// # let truth = SymmetricRobot { base_radius: 194.5, platform_radius: 30.0, upper_arm: 260.3, forearm: 479.2 }.robot()?;
/// let centre = robot.forward(&[0.2, 0.2, 0.2])?;
/// let arm = ArmIndex::First;
/// let mut factor = ArmFactor::new(NominalArm::new(robot.arm(arm), &centre, None));
/// for k in 0..20 {
///     let t = f64::from(k);
///     let q = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
///     factor.add(&truth.forward(&q)?, q[0], arm)?;
/// }
/// let mut solver = ArmSolver::new(&factor, arm, &Settings::default())?;
/// while solver.step(&factor) == Progress::Working {
///     // ... the control loop's other work ...
/// }
/// let outcome = solver.outcome(&factor)?;
/// assert!((outcome.arm.lb() - 479.2).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
pub type ArmSolver<T> = Minimizer<T, Displacement<T>, [T; 8], 8, 9, 45>;

impl<T: Real> ArmSolver<T> {
    /// Prepares the calibration of `arm` from the samples in `problem`.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    pub fn new(
        problem: &ArmFactor<T>,
        arm: ArmIndex,
        settings: &Settings<T>,
    ) -> Result<Self, Refusal> {
        enough_samples(problem, arm, settings)?;
        let mut solver = Self::of_arm(problem, arm, settings);
        solver.begin(problem);
        Ok(solver)
    }

    /// Before it has begun.
    pub(super) fn of_arm(problem: &ArmFactor<T>, arm: ArmIndex, settings: &Settings<T>) -> Self {
        let prior = Tolerance::weights(settings.tolerance.as_ref(), problem.nominal());
        Self::unstarted(arm, prior, settings)
    }

    /// The calibrated arm, or why there is none.
    ///
    /// # Errors
    /// Every [`Refusal`] that concerns one arm; [`Refusal::Unfinished`] before the last step.
    #[inline(never)]
    pub fn outcome(&self, problem: &ArmFactor<T>) -> Result<ArmOutcome<T>, Refusal> {
        let estimate = self.estimate(problem)?;
        let arm = corrected_arm(problem.nominal(), &estimate.correction).map_err(|error| {
            Refusal::ImpossibleGeometry {
                arm: self.first_arm(),
                error,
            }
        })?;
        Ok(ArmOutcome::of(arm, &estimate))
    }
}
