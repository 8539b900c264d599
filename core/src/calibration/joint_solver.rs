use super::joint_calibrator::JointCalibrator;
use super::minimizer::{Minimizer, Progress, enough_samples};
use super::outcome::JointOutcome;
use super::refusal::Refusal;
use super::settings::Settings;
use super::tolerance::Tolerance;
use super::tolerance_prior::TolerancePrior;
use crate::Real;
use crate::robot::ArmIndex;
use crate::samples::{JointDisplacement, JointFactor, NominalArm};

impl<T: Real> JointCalibrator<T> {
    /// Calibrates the robot.
    ///
    /// # Errors
    /// A [`Refusal`]; the robot keeps its parameters.
    pub fn solve(&mut self) -> Result<JointOutcome<T>, Refusal> {
        let mut solver = JointSolver::new(self)?;
        while solver.step(self) == Progress::Working {}
        solver.outcome(self)
    }
}

/// Calibrates a robot's 24 parameters together, one bounded step at a time, so that a control loop can
/// interleave it: 24 parameters are linearised in nine steps, and their covariance takes three.
///
/// ```
/// use delta_cal::{Progress, Refusal, Settings, SymmetricRobot};
/// use delta_cal::calibration::{JointCalibrator, JointSolver};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// let robot = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 }
///     .robot()?;
/// let mut calibrator = JointCalibrator::new(&robot, &Settings::default());
/// assert!(matches!(JointSolver::new(&mut calibrator), Err(Refusal::TooFewSamples { needed: 8, .. })));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct JointSolver<T: Real> {
    /// `None` before the first step, which begins in place: a copy of it costs as much as a step.
    minimizer: Option<JointMinimizer<T>>,
}

type JointMinimizer<T> = Minimizer<T, JointDisplacement<T>, TolerancePrior<T, 24>, 24, 25, 325>;

impl<T: Real> JointSolver<T> {
    /// Takes in the samples that wait. A control loop with little time for each step calls
    /// [`JointCalibrator::flush`] in the step before: there is nothing left to take in then.
    ///
    /// # Errors
    /// [`Refusal::TooFewSamples`].
    pub fn new(calibrator: &mut JointCalibrator<T>) -> Result<Self, Refusal> {
        calibrator.flush();
        enough_samples(calibrator.factor(), ArmIndex::First, calibrator.settings())?;
        Ok(Self { minimizer: None })
    }

    /// One step, on the samples that were there at the start and any that were taken in since. Does
    /// nothing once finished.
    pub fn step(&mut self, calibrator: &JointCalibrator<T>) -> Progress {
        let Some(minimizer) = &mut self.minimizer else {
            self.begin(calibrator);
            return Progress::Working;
        };
        minimizer.step(calibrator.factor())
    }

    #[inline(never)]
    fn begin(&mut self, calibrator: &JointCalibrator<T>) {
        let (factor, settings) = (calibrator.factor(), calibrator.settings());
        let prior = tolerance_prior(factor, settings);
        self.minimizer
            .insert(Minimizer::unstarted(ArmIndex::First, prior, settings))
            .begin(factor);
    }

    /// Linearisations so far, all starts together.
    pub fn iterations(&self) -> u16 {
        self.minimizer.as_ref().map_or(0, Minimizer::iterations)
    }

    /// The calibrated robot, or why there is none.
    ///
    /// # Errors
    /// Every [`Refusal`]; [`Refusal::Unfinished`] before the last step.
    pub fn outcome(&self, calibrator: &JointCalibrator<T>) -> Result<JointOutcome<T>, Refusal> {
        let minimizer = self.minimizer.as_ref().ok_or(Refusal::Unfinished)?;
        let factor = calibrator.factor();
        // Not moved out of its place: a copy costs thousands of instructions.
        match &minimizer.estimate(factor) {
            Ok(estimate) => JointOutcome::new(factor, estimate),
            Err(refusal) => Err(*refusal),
        }
    }
}

/// What the tolerance says in internal units.
pub(crate) fn tolerance_prior<T: Real>(
    factor: &JointFactor<T>,
    settings: &Settings<T>,
) -> TolerancePrior<T, 24> {
    let tolerance = settings.tolerance.as_ref();
    let mut weights = [T::ZERO; 24];
    for (own, nominal) in weights.chunks_exact_mut(8).zip(factor.nominal_arms()) {
        own.copy_from_slice(&Tolerance::own_weights(tolerance, nominal));
    }
    let arms = factor.nominal_arms().each_ref().map(NominalArm::arm);
    TolerancePrior::coupled(weights, arms, tolerance)
}
