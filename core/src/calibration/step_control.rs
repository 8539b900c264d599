//! Step length and termination of the iteration.
//!
//! Apart from its size and linearisation, every problem is treated alike here: 8 parameters for the IKM method, more
//! for the others. A step δ minimises |J δ + r|² + λ|D δ|², D the column norms of J and λ the damping (Marquardt 1963);
//! λ = 0 gives the Gauss–Newton step. If a prior holds the parameters, J has full rank and every Gauss–Newton step
//! leads downhill: one that is too long is halved, and damped only if no fraction of it is accepted. Damping by the
//! column norms would hold back poorly determined parameters, and the iteration would creep.

use super::outcome::Termination;
use crate::Real;

/// Damping after the first rejected step, relative to the squared column norms.
const FIRST_DAMPING: f64 = 1e-3;
const MORE_DAMPING: f64 = 8.0;
const LESS_DAMPING: f64 = 0.1;
/// Below this, damping is dropped and full steps are tried again.
const LEAST_DAMPING: f64 = 1e-5;
const MOST_DAMPING: f64 = 1e8;
/// Damping that shortens a step noticeably. Along the singular value s of J D⁻¹, a step damped by λ is shorter than the
/// full one by λ/(s² + λ). The columns of J D⁻¹ have unit length, so for an arm's 8 parameters the s² sum to 8, and the
/// step is shorter by at least 1.2 %.
const ENOUGH_DAMPING: f64 = 0.1;
/// The shortest fraction of a step that is tried before damping.
const SHORTEST: f64 = 0.02;
/// When convergence is slow, a gain below this fraction of the cost ends the iteration. A gain g moves the solution by
/// at most √g σ, and the cost of n samples of an arm is (n − 8) σ²: by at most 1e-5 √(n − 8) of its own σ.
const IRRELEVANT: f64 = 1e-10;
/// After a full step that leaves less than this fraction of its gain, the minimum is so near that its triangle is
/// reused for chord steps and for the covariance: in 28,800 simulated calibrations of six geometries, σ was off by less
/// than a hundredth.
const NEAR: f64 = 1e-7;
/// A chord step that leaves more than this fraction of its gain is no better than a linearisation.
const CONTRACTION: f64 = 1.0 / 64.0;
/// A predicted gain must be smaller than an observed one by this factor to count as zero.
const SURELY_NOTHING: f64 = 1e-6;

/// No Levenberg–Marquardt step may move a parameter by more than this, in units of the upper arm and radians: the
/// solution nearest to the start is wanted, and a longer step leaves the region where the linearisation is valid.
pub(crate) const LONGEST_STEP: f64 = 0.25;

/// How much of a cost |r|² may be rounding. `terms_squared`: the sum of the squared terms of which the residuals are
/// differences, in the cost's unit.
pub(crate) fn blur<T: Real>(cost: T, terms_squared: T) -> T {
    let blur = T::from_f64(64.0) * T::EPSILON * (cost + terms_squared).square_root();
    blur * cost.square_root() + blur.squared()
}

/// The result of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StepResult {
    /// The iteration continues.
    Continue,
    /// The iteration has converged.
    Finished(Termination),
    /// The full step does not exist or does not lead downhill, and the method has no other.
    Failed,
}

/// The action after a step near the minimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refinement {
    /// A chord step.
    Chord,
    /// A final chord step with negligible gain: the iteration has converged.
    Last,
    /// A linearisation, since chord steps would gain little.
    Linearize,
}

/// The expected result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::struct_excessive_bools)] // each answers a question of its own
pub(crate) struct Prospect<T> {
    /// Whether this step, if taken, is the last: the next would gain nothing, and this one is too short to change the
    /// Jacobian.
    pub(crate) settled: bool,
    /// Whether it ends near enough to the minimum for chord steps, which combine the triangle of the last linearisation
    /// with the current gradient.
    pub(crate) near: bool,
    at_rounding: bool,
    stagnant: bool,
    cost: T,
    blur: T,
}

/// Solver and damping of an iteration, and the expected gain of its last step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepControl<T> {
    pub(super) damped: bool,
    /// Whether a rejected step is shortened before it is damped. There are few such attempts per linearisation, and
    /// they are not counted.
    shortens: bool,
    /// The fraction of the step to take.
    pub(super) part: T,
    /// λ of the next step.
    pub(super) damping: T,
    /// The expected gain of the last full step, and the gain it left, if measured.
    previous_gain: T,
    left: Option<T>,
    /// The expected gain of the last step of either kind.
    last_gain: T,
    /// The gain below which rounding dominates.
    nothing: T,
}

impl<T: Real> StepControl<T> {
    /// Before the first step, which is a full one. `held`: whether a prior holds the parameters.
    #[inline]
    pub(crate) const fn new(damped: bool, held: bool) -> Self {
        Self {
            damped,
            shortens: held,
            part: T::ONE,
            damping: T::ZERO,
            previous_gain: T::INFINITY,
            left: None,
            last_gain: T::INFINITY,
            nothing: T::ZERO,
        }
    }

    /// The same control before the first step.
    #[inline]
    pub(crate) const fn renewed(&self) -> Self {
        Self::new(self.damped, self.shortens)
    }

    /// A full step does not exist, so no shorter one does either.
    #[inline]
    pub(crate) const fn damp(&mut self) {
        self.part = T::ZERO;
    }

    /// Judges the step at a cost of |r|². `gain` is the whole gain predicted by the linearised problem, the part of
    /// |r|² within the range of J; `terms_squared` as for [`blur`].
    #[inline]
    pub(crate) fn judge(&mut self, gain: T, cost: T, terms_squared: T) -> Prospect<T> {
        // r is known to ε times its terms, so a gain below that squared is zero. |r|² is blurred by |r| times as much;
        // a smaller gain cannot be seen in it and is accepted on trust.
        self.nothing = T::from_f64(16.0) * T::EPSILON.squared() * (cost + terms_squared);
        // With quadratic convergence, what a full step leaves goes with the square of its gain. If that is negligible,
        // this step is the last.
        let previous = self.previous_gain;
        let left = self.left.take().unwrap_or(gain);
        let next = if previous.finite() && gain < previous && left < previous {
            gain * (gain / previous) * (left / previous)
        } else {
            gain
        };
        let settled = gain <= self.nothing || next <= self.nothing * T::from_f64(SURELY_NOTHING);
        let blur = blur(cost, terms_squared);
        let at_rounding = gain <= blur;
        let slow = gain >= self.previous_gain * T::from_f64(0.25);
        let stagnant = slow && (at_rounding || gain <= T::from_f64(IRRELEVANT) * cost);
        self.previous_gain = gain;
        self.last_gain = gain;
        Prospect {
            settled,
            near: next <= T::from_f64(NEAR) * gain
                && !(self.damping > T::ZERO || self.part < T::ONE),
            at_rounding,
            stagnant,
            cost,
            blur,
        }
    }

    /// What to do when a chord step predicts a gain.
    #[inline]
    pub(crate) fn refine(&mut self, gain: T) -> Refinement {
        let before = self.last_gain;
        let contraction = match self.left {
            None => NEAR,
            Some(_) => CONTRACTION,
        };
        self.last_gain = gain;
        self.left = self.left.or(Some(gain));
        if gain <= self.nothing {
            Refinement::Last
        } else if gain <= T::from_f64(contraction) * before {
            Refinement::Chord
        } else {
            Refinement::Linearize
        }
    }

    /// Whether a chord step between two costs is accepted: it must lead downhill to within rounding.
    #[inline]
    pub(crate) fn accepts_chord(&self, before: T, cost: T) -> bool {
        cost <= before + self.rounding(before)
    }

    /// A few roundings of a cost not above that at the last linearisation.
    fn rounding(&self, cost: T) -> T {
        let squared = T::from_f64(16.0) * self.nothing;
        (squared * cost).square_root() + squared
    }

    /// Whether a step to this cost is accepted: Gauss–Newton requires a finite cost, Levenberg–Marquardt a smaller one
    /// to within rounding.
    #[inline]
    pub(crate) fn accepts(&self, prospect: &Prospect<T>, cost: T) -> bool {
        if self.damped {
            cost < prospect.cost || (prospect.at_rounding && cost <= prospect.cost + prospect.blur)
        } else {
            cost.finite()
        }
    }

    /// The step was accepted: reduces the damping.
    #[inline]
    pub(crate) fn accepted(&mut self, prospect: &Prospect<T>) -> StepResult {
        self.part = T::ONE;
        self.damping *= T::from_f64(LESS_DAMPING);
        if self.damping < T::from_f64(LEAST_DAMPING) {
            self.damping = T::ZERO;
        }
        if prospect.settled {
            StepResult::Finished(Termination::GradientVanished)
        } else if prospect.stagnant {
            StepResult::Finished(Termination::RoundingReached)
        } else {
            StepResult::Continue
        }
    }

    /// The step was rejected or does not exist: increases the damping, unless the iteration ends.
    #[inline]
    pub(crate) fn rejected(&mut self, prospect: &Prospect<T>) -> StepResult {
        // A full step that fails may be too long rather than lost in rounding.
        let short = self.damping > T::from_f64(ENOUGH_DAMPING) || self.part < T::from_f64(SHORTEST);
        if prospect.at_rounding && (!self.damped || short) {
            return StepResult::Finished(Termination::RoundingReached);
        }
        if !self.damped || self.damping > T::from_f64(MOST_DAMPING) {
            return StepResult::Failed;
        }
        if self.shortens && self.part >= T::from_f64(SHORTEST) {
            self.part *= T::HALF;
            return StepResult::Continue;
        }
        self.part = T::ONE;
        self.damping = if self.damping > T::ZERO {
            self.damping * T::from_f64(MORE_DAMPING)
        } else {
            T::from_f64(FIRST_DAMPING)
        };
        StepResult::Continue
    }
}

#[cfg(test)]
mod tests {
    use super::{Refinement, StepControl, StepResult, blur};
    use crate::calibration::Termination::{GradientVanished, RoundingReached};

    /// Costs of about 1 from terms of about 1: everything is far above its rounding.
    const TERMS: f64 = 1.0;
    const EPSILON: f64 = f64::EPSILON;

    fn same(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs()
    }

    #[test]
    fn only_rejected_steps_are_damped() {
        let mut control = StepControl::<f64>::new(true, false);
        assert!(control.damping <= 0.0);
        let prospect = control.judge(0.5, 1.0, TERMS);
        assert!(!prospect.settled);
        assert_eq!(control.accepted(&prospect), StepResult::Continue);
        assert!(control.damping <= 0.0);
        // Each rejection multiplies the damping by eight, each accepted step divides it by ten; below 1e-5 full steps
        // are tried again.
        let mut expected = 1e-3;
        for _ in 0..3 {
            assert_eq!(control.rejected(&prospect), StepResult::Continue);
            assert!(same(control.damping, expected), "{}", control.damping);
            expected *= 8.0;
        }
        expected /= 8.0;
        while expected > 1e-4 {
            expected /= 10.0;
            assert_eq!(control.accepted(&prospect), StepResult::Continue);
            assert!(same(control.damping, expected), "{}", control.damping);
        }
        assert_eq!(control.accepted(&prospect), StepResult::Continue);
        assert!(control.damping <= 0.0);
    }

    #[test]
    fn a_full_step_lost_in_rounding_is_the_end_of_full_steps_only() {
        // The predicted gain is below the rounding of the cost.
        let gain = 1e-16;
        let mut full = StepControl::<f64>::new(false, false);
        let prospect = full.judge(gain, 1.0, TERMS);
        assert_eq!(
            full.rejected(&prospect),
            StepResult::Finished(RoundingReached)
        );
        // A damped step may have been too long.
        let mut damped = StepControl::<f64>::new(true, false);
        let prospect = damped.judge(gain, 1.0, TERMS);
        let mut rejections = 0;
        let end = loop {
            let result = damped.rejected(&prospect);
            if result != StepResult::Continue {
                break result;
            }
            rejections += 1;
            assert!(rejections < 100);
        };
        assert_eq!(end, StepResult::Finished(RoundingReached));
        // 1e-3, 8e-3, 0.064, 0.512: the first above 0.1.
        assert_eq!(rejections, 4);
    }

    #[test]
    fn levenberg_marquardt_takes_what_leads_down() {
        let mut control = StepControl::<f64>::new(true, false);
        let seen = control.judge(0.5, 1.0, TERMS);
        assert!(control.accepts(&seen, 0.999_999));
        assert!(!control.accepts(&seen, 1.0));
        assert!(!control.accepts(&seen, 1.0 + 1e-15));
        assert!(!control.accepts(&seen, f64::NAN));
        // To within rounding, a step is accepted on trust, up to the blur and no further.
        let lost = control.judge(1e-16, 1.0, TERMS);
        assert!(control.accepts(&lost, 1.0));
        assert!(control.accepts(&lost, 1.0 + 0.9 * blur(1.0, TERMS)));
        assert!(!control.accepts(&lost, 1.0 + 1.1 * blur(1.0, TERMS)));
        // Gauss–Newton accepts any finite cost.
        let mut full = StepControl::<f64>::new(false, false);
        let seen = full.judge(0.5, 1.0, TERMS);
        assert!(full.accepts(&seen, 1e300));
        assert!(!full.accepts(&seen, f64::INFINITY));
        assert!(!full.accepts(&seen, f64::NAN));
    }

    /// Quadratic convergence squares the error at each step: gains of 1e-2 and then 1e-14 predict 1e-38 next, which is
    /// invisible in 16 digits.
    #[test]
    fn the_step_before_nothing_is_the_last() {
        let judge = |gains: &[f64], cost: f64, terms: f64| {
            let mut control = StepControl::<f64>::new(true, false);
            let mut last = false;
            for gain in gains {
                last = control.judge(*gain, cost, terms).settled;
            }
            last
        };
        // A gain below the square of a rounding, (4ε)² of the terms, is zero.
        let nothing = 16.0 * EPSILON * EPSILON;
        assert!(judge(&[0.9 * nothing], 0.0, 1.0));
        assert!(!judge(&[1.1 * nothing], 0.0, 1.0));
        assert!(judge(&[1.9 * nothing], 1.0, 1.0));
        assert!(!judge(&[2.1 * nothing], 1.0, 1.0));
        assert!(judge(&[2.9 * nothing], 1.0, 2.0));
        assert!(!judge(&[3.1 * nothing], 1.0, 2.0));
        // The next gain would be g (g/g′)², and must be a millionth of zero's limit.
        let next = |first: f64, second: f64| second * (second / first) * (second / first);
        let first = 1e-2;
        for (second, expected) in [(1e-15, true), (1e-14, true), (1e-13, false), (1e-9, false)] {
            assert_eq!(next(first, second) < nothing * 1e-6, expected);
            assert_eq!(judge(&[first, second], 0.0, 1.0), expected, "{second:e}");
        }
        // g³/g′² just on either side.
        let limit = libm::cbrt(nothing * 1e-6 * first * first);
        assert!(judge(&[first, 0.99 * limit], 0.0, 1.0));
        assert!(!judge(&[first, 1.01 * limit], 0.0, 1.0));
        // A growing gain is not convergence.
        assert!(!judge(&[1e-14, 1e-13], 0.0, 1.0));
        assert!(!judge(&[1e-13, 1e-13], 0.0, 1.0));
    }

    #[test]
    fn an_iteration_that_creeps_ends_where_it_no_longer_matters() {
        let end = |gains: &[f64], cost: f64| {
            let mut control = StepControl::<f64>::new(true, false);
            let mut result = StepResult::Continue;
            for gain in gains {
                let prospect = control.judge(*gain, cost, TERMS);
                result = control.accepted(&prospect);
            }
            result
        };
        // A gain below 1e-10 of the cost.
        let creeping = StepResult::Finished(RoundingReached);
        assert_eq!(end(&[2e-11, 1e-11], 1.0), creeping);
        assert_eq!(end(&[1.1e-10, 0.9e-10], 1.0), creeping);
        assert_eq!(end(&[2e-10, 1.1e-10], 1.0), StepResult::Continue);
        assert_eq!(end(&[2e-11, 1e-11], 0.05), StepResult::Continue);
        // Fast convergence may continue, down to a quarter of the last gain.
        assert_eq!(end(&[2e-11, 0.4e-11], 1.0), StepResult::Continue);
        assert_eq!(end(&[2e-11, 0.6e-11], 1.0), creeping);
        // A gain hidden by rounding ends the iteration, however small the cost.
        assert_eq!(end(&[2e-13, 1e-13], 1e-4), StepResult::Continue);
        assert_eq!(end(&[2e-16, 1e-16], 1e-4), creeping);
        // Completed convergence is not creeping.
        let settled = StepResult::Finished(GradientVanished);
        assert_eq!(end(&[1e-2, 1e-14], 1e-4), settled);
    }

    /// If a prior makes steps lead downhill, a rejected one is halved six times, then damped; the next is full again.
    #[test]
    fn where_a_prior_holds_a_rejected_step_is_halved_first() {
        let mut control = StepControl::<f64>::new(true, true);
        let prospect = control.judge(0.5, 1.0, TERMS);
        for part in [0.5, 0.25, 0.125, 0.0625, 0.031_25, 0.015_625] {
            assert_eq!(control.rejected(&prospect), StepResult::Continue);
            assert!(same(control.part, part) && control.damping <= 0.0);
        }
        let mut damped = control;
        assert_eq!(damped.rejected(&prospect), StepResult::Continue);
        assert!(same(damped.part, 1.0) && same(damped.damping, 1e-3));
        assert_eq!(control.accepted(&prospect), StepResult::Continue);
        assert!(same(control.part, 1.0) && control.damping <= 0.0);
        // Without a step there is nothing to halve.
        let mut control = StepControl::<f64>::new(true, true);
        control.damp();
        assert_eq!(control.rejected(&prospect), StepResult::Continue);
        assert!(same(control.part, 1.0) && same(control.damping, 1e-3));
        // A gain within rounding is not pursued for long.
        let rounding = control.judge(1e-14, 1.0, TERMS);
        let mut control = StepControl::<f64>::new(true, true);
        let mut tries = 1;
        while control.rejected(&rounding) == StepResult::Continue {
            tries += 1;
        }
        assert_eq!(tries, 7);
    }

    /// The first chord step must predict 1e-7 of the full step's gain, and each further one a 64th of the previous; one
    /// that predicts less than 16 ε² of cost and terms is the last.
    #[test]
    fn chord_steps_go_on_as_long_as_they_lead_far() {
        let begun = || {
            let mut control = StepControl::<f64>::new(true, false);
            control.judge(1e-6, 1.0, 4.0);
            control
        };
        assert_eq!(begun().refine(2e-13), Refinement::Linearize);
        let mut control = begun();
        assert_eq!(control.refine(0.9e-13), Refinement::Chord);
        assert_eq!(control.refine(1.3e-15), Refinement::Chord);
        assert_eq!(control.refine(3e-17), Refinement::Linearize);
        let nothing = 16.0 * EPSILON * EPSILON * 5.0;
        assert_eq!(begun().refine(1.1 * nothing), Refinement::Chord);
        assert_eq!(begun().refine(0.9 * nothing), Refinement::Last);
    }
}
