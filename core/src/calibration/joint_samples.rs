//! Accumulated samples and solver of the joint calibration.

use super::arm_samples::{ArmSamples, workspace_centre};
use super::calibrator::Joint;
use super::calibrator::estimators::Parts;
use super::joint_problem::corrected_robot;
use super::minimizer::{Minimizer, Progress, enough_samples};
use super::outcome::{Estimate, JointOutcome};
use super::parts::{Samples, Solver};
use super::problem::Judged;
use super::refusal::Refusal;
use super::settings::Settings;
use super::tolerance_prior::TolerancePrior;
use crate::Real;
use crate::robot::{ArmIndex, Robot};
use crate::samples::{
    Forgetting, JointDisplacement, JointFactor, LeftOver, MergeError, NominalArm, Sample,
    WhitenedSample,
};
use crate::state::state;

/// One factor weights the closures of all arms by their full covariance. Samples added singly are absorbed in pairs,
/// half of the work at a pair's second sample and half at the next: every call of [`add`](Samples::add) is short.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSamples<T: Real> {
    settings: Settings<T>,
    factor: JointFactor<T>,
    /// A pair and the sample after it, whitened on arrival; the first `count` are valid.
    waiting: [WhitenedSample<T>; 3],
    /// The remainder of the pair's first rows, once it is complete: these are in the factor then.
    left: LeftOver<T, 2>,
    count: usize,
}

// At rest a third sample does not wait.
state!(
    JointSamples<T>:
    factor: JointFactor<T>,
    waiting: [WhitenedSample<T>; 3],
    left: LeftOver<T, 2>,
    count: usize;
    [.., 0..=2]
);

impl<T: Real> Samples<T> for JointSamples<T> {
    #[inline(always)]
    fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self {
        Self {
            settings: *settings,
            factor: JointFactor::new(robot, &workspace_centre(robot), settings.noise),
            waiting: [
                WhitenedSample::vacant(),
                WhitenedSample::vacant(),
                WhitenedSample::vacant(),
            ],
            left: [[T::ZERO; 2]; 25],
            count: 0,
        }
    }

    fn push(&mut self, sample: &Sample<T>) {
        T::push_joint(self, sample);
    }

    fn push_forgetting(&mut self, sample: &Sample<T>, forgetting: &Forgetting<T>) {
        self.factor.fade(forgetting, self.count + 1);
        self.push(sample);
    }

    fn take_in(&mut self, samples: &[Sample<T>]) {
        self.factor.absorb_many(samples);
    }

    fn flush(&mut self) {
        T::flush_joint(self);
    }

    fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        let mut other = other.clone();
        other.flush();
        self.factor.merge(&other.factor)
    }

    fn forget(&mut self, lambda: T) {
        self.factor.forget(lambda);
    }

    fn count(&self) -> u64 {
        self.factor.samples().saturating_add(self.count as u64)
    }

    fn settings(&self) -> &Settings<T> {
        &self.settings
    }

    fn nominal_arms(&self) -> [&NominalArm<T>; 3] {
        self.factor.nominal_arms().each_ref()
    }
}

impl<T: Real> JointSamples<T> {
    /// Adds a checked sample, in bounded time.
    pub(crate) fn take(&mut self, sample: &Sample<T>) {
        let begun = self.begun();
        debug_assert!(self.count < self.waiting.len());
        if let Some(place) = self.waiting.get_mut(self.count) {
            *place = self.factor.prepare(sample);
            self.count += 1;
        }
        if begun {
            self.finish_pair();
        } else if self.begun() {
            let [pair @ .., _] = &self.waiting;
            self.left = self.factor.absorb_first(pair);
        }
    }

    /// Absorbs the samples that wait.
    pub(crate) fn absorb_waiting(&mut self) {
        if self.begun() {
            self.finish_pair();
        }
        let [first, ..] = &self.waiting;
        if self.count > 0 {
            self.factor.absorb_one(first);
            self.count = 0;
        }
    }

    /// Whether a pair waits whose first rows are in the factor.
    const fn begun(&self) -> bool {
        self.count >= 2
    }

    fn finish_pair(&mut self) {
        let [pair @ .., _] = &self.waiting;
        self.factor.absorb_others::<2, 4, 6>(pair, &self.left);
        let [first, _, third] = &mut self.waiting;
        *first = *third;
        self.count = self.count.saturating_sub(2);
    }

    /// The absorbed samples.
    pub(crate) const fn factor(&self) -> &JointFactor<T> {
        &self.factor
    }
}

/// Solves for all 24 parameters jointly: a linearisation takes six steps, the covariance four.
#[derive(Debug, Clone)]
pub struct JointSolver<T: Real> {
    /// `None` before the first step, which starts in place: copying it would cost as much as a step.
    minimizer: Option<JointMinimizer<T>>,
    outcome: Option<JointOutcome<T>>,
}

type JointMinimizer<T> = Minimizer<T, JointDisplacement<T>, (), 24>;

impl<T: Real> Solver<T, JointSamples<T>> for JointSolver<T> {
    #[inline(always)]
    fn vacant() -> Self {
        Self {
            minimizer: None,
            outcome: None,
        }
    }

    fn begin(&mut self, samples: &JointSamples<T>) -> Result<(), Refusal> {
        self.minimizer = None;
        enough_samples(
            &samples.factor().extent(),
            ArmIndex::First,
            &samples.settings,
        )
    }

    fn step(&mut self, samples: &JointSamples<T>) -> Result<Progress, Refusal> {
        let factor = &samples.factor;
        if let (Some(minimizer), Some(outcome)) = (&mut self.minimizer, &mut self.outcome) {
            if minimizer.is_done() {
                complete(factor, outcome)?;
                return Ok(Progress::Finished);
            }
            minimizer.step(factor, &mut outcome.estimate)?;
            return Ok(Progress::Working);
        }
        self.start(samples);
        Ok(Progress::Working)
    }
}

impl<T: Real> JointSolver<T> {
    #[inline(never)] // with `complete` 1.9 kB of joint stack built for size
    fn start(&mut self, samples: &JointSamples<T>) {
        let (factor, settings) = (&samples.factor, &samples.settings);
        self.outcome = Some(JointOutcome {
            robot: samples.robot(),
            estimate: Estimate::vacant(),
        });
        let prior = tolerance_prior(factor, settings);
        self.minimizer
            .insert(Minimizer::unstarted(ArmIndex::First, prior, settings))
            .begin(factor);
    }
}

impl Parts for Joint {
    const NUMBER: u8 = 2;
    type Samples<T: Real> = JointSamples<T>;
    type Solver<T: Real> = JointSolver<T>;
    type Beside<T: Real> = ArmSamples<T>;

    fn outcome<T: Real>(solver: &JointSolver<T>) -> Option<&JointOutcome<T>> {
        solver.outcome.as_ref()
    }

    #[inline(always)]
    fn beside<T: Real>(robot: &Robot<T>, settings: &Settings<T>) -> ArmSamples<T> {
        ArmSamples::new(robot, settings)
    }

    fn arms<'a, T: Real>(
        samples: &'a mut JointSamples<T>,
        beside: &'a mut ArmSamples<T>,
    ) -> (&'a mut ArmSamples<T>, Option<&'a mut JointSamples<T>>) {
        (beside, Some(samples))
    }
}

/// The robot of an estimate, and its judgement.
#[inline(never)] // see `start`
fn complete<T: Real>(
    factor: &JointFactor<T>,
    outcome: &mut JointOutcome<T>,
) -> Result<(), Refusal> {
    outcome.robot = corrected_robot(factor, &outcome.estimate.correction)?;
    Ok(())
}

/// The tolerance prior in internal units.
pub(crate) fn tolerance_prior<T: Real>(
    factor: &JointFactor<T>,
    settings: &Settings<T>,
) -> TolerancePrior<T, 24> {
    let arms = factor.nominal_arms().each_ref().map(NominalArm::arm);
    TolerancePrior::new(arms, &factor.units(), settings.tolerance.as_ref())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, clippy::unwrap_used)]

    use crate::calibration::{JointCalibrator, Refusal, Settings, Tolerance};
    use crate::fixtures::{changed, robot, samples};
    use crate::robot::{ArmIndex, Parameter};
    use crate::samples::Noise;

    fn settings() -> Settings<f64> {
        Settings::default().with_noise(Noise::new(0.03, 1e-5).unwrap())
    }

    /// The covariance's blocks of eight and the roots of its diagonal, by arm and parameter.
    #[test]
    fn what_is_said_of_one_arm_is_its_part_of_the_whole() {
        let measured = samples::<25>(&changed(5), 28);
        let stated = settings().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
        let mut calibrator = JointCalibrator::new(&robot(), &stated);
        calibrator.add_many(&measured).unwrap();
        let outcome = calibrator.calibrate().unwrap();
        let whole = outcome.estimate.covariance.unwrap();
        for (number, arm) in ArmIndex::ALL.into_iter().enumerate() {
            let own = outcome.arm(arm);
            let block = whole.fixed_view::<8, 8>(8 * number, 8 * number);
            assert_eq!(own.covariance.unwrap(), block);
            assert_eq!(own.arm, outcome.robot.arms()[number]);
            assert_eq!(own.condition, outcome.estimate.conditions[number]);
            let mut held = 0.0;
            for (place, parameter) in Parameter::ROTARY.into_iter().enumerate() {
                let sigma = libm::sqrt(block[(place, place)]);
                assert_eq!(outcome.standard_deviation(arm, parameter), Some(sigma));
                assert_eq!(own.standard_deviation(parameter), Some(sigma));
                let share = outcome.estimate.prior_share[8 * number + place];
                assert_eq!(own.prior_share[place], share);
                held += share;
            }
            // Of eight parameters, the samples determine those that the tolerance does not hold.
            assert!((own.degrees_of_freedom - (25.0 - (8.0 - held))).abs() < 1e-12);
        }
    }

    /// A contradiction of all three arms together cannot be attributed to one arm.
    #[test]
    fn a_contradiction_of_all_arms_names_none() {
        let measured = samples::<30>(&changed(1), 31);
        let stated = Settings::default().with_noise(Noise::new(1e-3, 0.0).unwrap());
        let mut calibrator = JointCalibrator::new(&robot(), &stated);
        calibrator.add_many(&measured).unwrap();
        assert!(matches!(
            calibrator.calibrate(),
            Err(Refusal::ResidualContradictsNoise { arm: None, .. })
        ));
    }
}
