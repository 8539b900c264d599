use super::{Refinement, StepControl, StepResult, blur};
use crate::calibration::Solver::{GaussNewton, LevenbergMarquardt};
use crate::calibration::Termination::{GradientVanished, RoundingReached};

/// Costs of about 1 from terms of about 1: everything is far above its rounding.
const TERMS: f64 = 1.0;
const EPSILON: f64 = f64::EPSILON;

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs()
}

/// A residual vector r known to a rounding of e in length has a square known to 2e|r| + e²: what is
/// taken for blur must hold that, of some roundings of the terms and not of thousands.
#[test]
fn the_blur_holds_the_rounding_of_a_sum_of_squares() {
    for terms in [0.0, 1e-6, 1.0, 1e6] {
        for cost in [0.0, 1e-20, 1e-6, 1.0, 1e4] {
            let size = libm::sqrt(cost);
            let square = |roundings: f64| {
                let error = roundings * EPSILON * libm::sqrt(cost + terms);
                2.0 * error * size + error * error
            };
            let found: f64 = blur(cost, terms);
            assert!(
                found >= square(16.0) && found <= square(64.0),
                "{cost} {terms}"
            );
        }
    }
}

#[test]
fn only_rejected_steps_are_damped() {
    let mut control = StepControl::<f64>::new(LevenbergMarquardt);
    assert_eq!(control.solver(), LevenbergMarquardt);
    assert!(control.damping() <= 0.0);
    let prospect = control.judge(0.5, 1.0, TERMS);
    assert!(!prospect.settled);
    assert_eq!(control.accepted(&prospect), StepResult::Continue);
    assert!(control.damping() <= 0.0);
    // Each rejection damps eight times as much, each accepted step a tenth of it; below 1e-5 the full
    // step is tried again.
    let mut expected = 1e-3;
    for _ in 0..3 {
        assert_eq!(control.rejected(&prospect), StepResult::Continue);
        assert!(same(control.damping(), expected), "{}", control.damping());
        expected *= 8.0;
    }
    expected /= 8.0;
    while expected > 1e-4 {
        expected /= 10.0;
        assert_eq!(control.accepted(&prospect), StepResult::Continue);
        assert!(same(control.damping(), expected), "{}", control.damping());
    }
    assert_eq!(control.accepted(&prospect), StepResult::Continue);
    assert!(control.damping() <= 0.0);
}

/// A step that no damping makes acceptable ends the iteration, but not before it is as short as 1e-8 of
/// the full one.
#[test]
fn damping_has_an_end() {
    let mut control = StepControl::<f64>::new(LevenbergMarquardt);
    let prospect = control.judge(0.5, 1.0, TERMS);
    let mut rejections = 0;
    while control.rejected(&prospect) == StepResult::Continue {
        rejections += 1;
        assert!(rejections < 100);
    }
    assert!(control.damping() > 1e8 && control.damping() < 1e9);
    // Gauss–Newton has no other step.
    let mut full = StepControl::<f64>::new(GaussNewton);
    let prospect = full.judge(0.5, 1.0, TERMS);
    assert_eq!(full.rejected(&prospect), StepResult::Failed);
}

#[test]
fn a_full_step_lost_in_rounding_is_the_end_of_full_steps_only() {
    // All that is promised is below the rounding of the cost.
    let gain = 1e-16;
    let mut full = StepControl::<f64>::new(GaussNewton);
    let prospect = full.judge(gain, 1.0, TERMS);
    assert_eq!(
        full.rejected(&prospect),
        StepResult::Finished(RoundingReached)
    );
    // A damped one may have been too long.
    let mut damped = StepControl::<f64>::new(LevenbergMarquardt);
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
    let mut control = StepControl::<f64>::new(LevenbergMarquardt);
    let seen = control.judge(0.5, 1.0, TERMS);
    assert!(control.accepts(&seen, 0.999_999));
    assert!(!control.accepts(&seen, 1.0));
    assert!(!control.accepts(&seen, 1.0 + 1e-15));
    assert!(!control.accepts(&seen, f64::NAN));
    // Within rounding a step is taken on trust, up to the blur and no further.
    let lost = control.judge(1e-16, 1.0, TERMS);
    assert!(control.accepts(&lost, 1.0));
    assert!(control.accepts(&lost, 1.0 + 0.9 * blur(1.0, TERMS)));
    assert!(!control.accepts(&lost, 1.0 + 1.1 * blur(1.0, TERMS)));
    // Gauss–Newton takes any that there is.
    let mut full = StepControl::<f64>::new(GaussNewton);
    let seen = full.judge(0.5, 1.0, TERMS);
    assert!(full.accepts(&seen, 1e300));
    assert!(!full.accepts(&seen, f64::INFINITY));
    assert!(!full.accepts(&seen, f64::NAN));
}

/// Quadratic convergence squares the error at each step: a gain of 1e-2 and one of 1e-14 promise
/// 1e-38 next, which arithmetic of 16 digits does not see.
#[test]
fn the_step_before_nothing_is_the_last() {
    let judge = |gains: &[f64], cost: f64, terms: f64| {
        let mut control = StepControl::<f64>::new(LevenbergMarquardt);
        let mut last = false;
        for gain in gains {
            last = control.judge(*gain, cost, terms).settled;
        }
        last
    };
    // What is below the square of a rounding is nothing: (4ε)² of the terms.
    let nothing = 16.0 * EPSILON * EPSILON;
    assert!(judge(&[0.9 * nothing], 0.0, 1.0));
    assert!(!judge(&[1.1 * nothing], 0.0, 1.0));
    assert!(judge(&[1.9 * nothing], 1.0, 1.0));
    assert!(!judge(&[2.1 * nothing], 1.0, 1.0));
    assert!(judge(&[2.9 * nothing], 1.0, 2.0));
    assert!(!judge(&[3.1 * nothing], 1.0, 2.0));
    // The next gain would be g (g/g′)², and must be a millionth of nothing.
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
    // A gain that grows is no convergence.
    assert!(!judge(&[1e-14, 1e-13], 0.0, 1.0));
    assert!(!judge(&[1e-13, 1e-13], 0.0, 1.0));
}

#[test]
fn an_iteration_that_creeps_ends_where_it_no_longer_matters() {
    let end = |gains: &[f64], cost: f64| {
        let mut control = StepControl::<f64>::new(LevenbergMarquardt);
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
    // Fast convergence is left to go on, to a quarter of the last gain.
    assert_eq!(end(&[2e-11, 0.4e-11], 1.0), StepResult::Continue);
    assert_eq!(end(&[2e-11, 0.6e-11], 1.0), creeping);
    // Of what rounding hides nothing more is to be had, however small the cost.
    assert_eq!(end(&[2e-13, 1e-13], 1e-4), StepResult::Continue);
    assert_eq!(end(&[2e-16, 1e-16], 1e-4), creeping);
    // Convergence that has arrived has not crept.
    let settled = StepResult::Finished(GradientVanished);
    assert_eq!(end(&[1e-2, 1e-14], 1e-4), settled);
}

/// A gain of 1e-2 and then of g leaves g (g/1e-2)²: below 1e-7 of g chord steps may follow, unless steps are damped.
#[test]
fn chord_steps_follow_a_full_step_that_leaves_next_to_nothing() {
    for (gain, near) in [(1e-6, true), (3e-6, true), (4e-6, false), (1e-4, false)] {
        let mut control = StepControl::<f64>::new(LevenbergMarquardt);
        assert!(!control.judge(1e-2, 1.0, TERMS).near);
        assert_eq!(control.judge(gain, 1.0, TERMS).near, near, "{gain}");
        let mut damped = StepControl::<f64>::new(LevenbergMarquardt);
        let prospect = damped.judge(1e-2, 1.0, TERMS);
        assert_eq!(damped.rejected(&prospect), StepResult::Continue);
        assert!(!damped.judge(gain, 1.0, TERMS).near, "{gain}");
    }
}

/// The first chord step must promise 1e-7 of what the full step did, and every other a 64th of the one before it;
/// what promises less than 16 ε² of cost and terms is the last.
#[test]
fn chord_steps_go_on_as_long_as_they_lead_far() {
    let begun = || {
        let mut control = StepControl::<f64>::new(LevenbergMarquardt);
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

/// A cost c from terms t is known to some ε √(c (c + t)): 16 of them are let pass, and of no cost at all some ε² t.
#[test]
fn a_chord_step_is_taken_if_it_leads_down_as_far_as_rounding_shows() {
    let mut control = StepControl::<f64>::new(LevenbergMarquardt);
    control.judge(1e-6, 4.0, 5.0);
    assert!(control.accepts_chord(4.0, 3.9));
    let rounding = EPSILON * libm::sqrt(4.0 * 9.0);
    assert!(control.accepts_chord(4.0, 4.0 + 15.0 * rounding));
    assert!(!control.accepts_chord(4.0, 4.0 + 18.0 * rounding));
    assert!(!control.accepts_chord(4.0, 5.0));
    assert!(control.accepts_chord(0.0, 9.0 * EPSILON * EPSILON));
    assert!(!control.accepts_chord(0.0, 1e-20));
}
