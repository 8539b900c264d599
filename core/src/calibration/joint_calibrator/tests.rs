#![allow(clippy::cast_precision_loss, clippy::float_cmp, clippy::unwrap_used)]

use super::JointCalibrator;
use crate::calibration::{JointSolver, Progress, Refusal, Settings, Start, Tolerance};
use crate::robot::{ArmIndex, Parameter, Robot};
use crate::samples::joint_factor_tests::{changed, robot, samples};
use crate::samples::{Noise, Sample};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

fn settings() -> Settings<f64> {
    Settings::default().with_noise(Noise::new(0.03, 1e-5).unwrap())
}

/// Parameters to 1e-9 of a millimetre and a radian: noisy samples determine them to some hundredths.
fn assert_same(a: &mut JointCalibrator<f64>, b: &mut JointCalibrator<f64>) {
    assert_eq!(a.samples(), b.samples());
    match (a.solve(), b.solve()) {
        (Ok(a), Ok(b)) => {
            let (a, b) = (a.robot.parameters(), b.robot.parameters());
            for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
        }
        (a, b) => assert_eq!(a.map(|_| ()), b.map(|_| ())),
    }
}

/// A pair is on its way over two calls; whatever comes between, every sample is taken in once.
#[test]
fn every_order_of_adding_flushing_and_solving_gives_the_same() {
    let measured = samples::<40>(&changed(1), 21);
    for seed in 0..40 {
        let mut rng = Pcg32::seed_from_u64(seed);
        let mut calibrator = JointCalibrator::new(&robot(), &settings());
        let mut taken = 0;
        let count = 20 + (rng.next_u32() % 20) as usize;
        while taken < count {
            match rng.next_u32() % 8 {
                0 => calibrator.flush(),
                1 => drop(calibrator.solve()),
                2 => {
                    let some = (rng.next_u32() % 6) as usize;
                    let next = (taken + some).min(count);
                    calibrator.add_many(&measured[taken..next]).unwrap();
                    taken = next;
                }
                3 => {
                    let mut other = JointCalibrator::new(&robot(), &settings());
                    let next = (taken + (rng.next_u32() % 4) as usize).min(count);
                    for sample in &measured[taken..next] {
                        other.add(sample).unwrap();
                    }
                    calibrator.merge(&other).unwrap();
                    taken = next;
                }
                4 => calibrator.forget(1.0),
                _ => {
                    calibrator.add(&measured[taken]).unwrap();
                    taken += 1;
                }
            }
            assert_eq!(calibrator.samples(), taken as u64);
        }
        let mut expected = JointCalibrator::new(&robot(), &settings());
        expected.add_many(&measured[..count]).unwrap();
        assert_same(&mut calibrator, &mut expected);
    }
}

/// One by one the factor takes a pair in at the second sample and at the third.
#[test]
fn samples_that_wait_are_counted_and_are_not_in_the_factor() {
    let measured = samples::<7>(&changed(1), 22);
    let mut calibrator = JointCalibrator::new(&robot(), &settings());
    for (index, (sample, in_factor)) in measured.iter().zip([0, 0, 2, 2, 4, 4, 6]).enumerate() {
        // The pair begins its way with its second sample, and until it is in, none begins.
        assert_eq!(calibrator.begins_next(), index % 2 == 1, "{index}");
        calibrator.add(sample).unwrap();
        assert_eq!(calibrator.factor().samples(), in_factor);
        assert_eq!(calibrator.samples(), index as u64 + 1);
    }
    calibrator.flush();
    assert_eq!(calibrator.factor().samples(), 7);
    let before = calibrator;
    calibrator.flush();
    assert_eq!(calibrator, before);
}

#[test]
fn forgetting_concerns_the_samples_that_wait_as_well() {
    let measured = samples::<15>(&changed(1), 23);
    for count in 0..6 {
        let mut calibrator = JointCalibrator::new(&robot(), &settings());
        for sample in &measured[..count] {
            calibrator.add(sample).unwrap();
        }
        calibrator.forget(0.5);
        let effective = calibrator.factor().effective_samples();
        assert!((effective - 0.5 * count as f64).abs() < 1e-12);
    }
}

#[test]
fn a_faulty_sample_is_refused_and_changes_nothing() {
    let measured = samples::<5>(&changed(1), 24);
    let mut calibrator = JointCalibrator::new(&robot(), &settings());
    for sample in &measured {
        let before = calibrator;
        let mut wrong = *sample;
        wrong.position.x = f64::NAN;
        assert!(calibrator.add(&wrong).is_err());
        assert!(calibrator.check(&wrong).is_err());
        assert_eq!(calibrator, before);
        calibrator.add(sample).unwrap();
    }
    let other = JointCalibrator::new(&changed(2), &settings());
    assert!(calibrator.merge(&other).is_err());
    assert_eq!(calibrator.samples(), 5);
}

/// Each start has its linearisations: one at the nominal robot and one without a guess.
#[test]
fn an_iteration_limit_of_one_is_one_linearisation_a_start() {
    let measured = samples::<20>(&changed(1), 25);
    for (start, expected) in [(Start::Nominal, 2), (Start::Free, 1)] {
        let limited = settings().with_start(start).with_iteration_limit(1);
        let mut calibrator = JointCalibrator::new(&robot(), &limited);
        calibrator.add_many(&measured).unwrap();
        let refusal = calibrator.solve().unwrap_err();
        assert!(
            matches!(refusal, Refusal::NotConverged { iterations, .. } if iterations == expected),
            "{refusal:?}"
        );
    }
}

/// The arm whose joint never moves, and with it every parameter of that arm.
#[test]
fn an_arm_that_does_not_move_is_named() {
    for arm in ArmIndex::ALL {
        let truth = changed(3);
        let measured = samples::<30>(&truth, 26).map(|mut sample| {
            sample.joints[arm.index()] = 0.2;
            Sample {
                position: truth.forward(&sample.joints).unwrap(),
                ..sample
            }
        });
        for limit in [1, 50] {
            let limited = settings().with_iteration_limit(limit);
            let mut calibrator = JointCalibrator::new(&robot(), &limited);
            calibrator.add_many(&measured).unwrap();
            let refusal = calibrator.solve().unwrap_err();
            // The columns of a joint that stands still depend on each other but for rounding.
            assert!(
                matches!(refusal, Refusal::Undetermined { arm: named, condition, .. }
                    if named == arm && condition > 1e9),
                "{arm:?}: {refusal:?}"
            );
        }
    }
}

/// The steps of the solver are the solve, and its outcome is there at the end alone.
#[test]
fn the_solver_s_steps_end_with_the_outcome_of_solve() {
    let measured = samples::<25>(&changed(4), 27);
    let stated = settings().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
    let mut calibrator = JointCalibrator::new(&robot(), &stated);
    for sample in &measured {
        calibrator.add(sample).unwrap();
    }
    let mut solver = JointSolver::new(&mut calibrator).unwrap();
    let mut steps = 0;
    while solver.step(&calibrator) == Progress::Working {
        assert_eq!(solver.outcome(&calibrator), Err(Refusal::Unfinished));
        steps += 1;
    }
    assert!((14..200).contains(&steps), "{steps}");
    let outcome = solver.outcome(&calibrator).unwrap();
    assert_eq!(solver.iterations(), outcome.estimate.iterations);
    assert_eq!(solver.step(&calibrator), Progress::Finished);
    assert_eq!(calibrator.solve(), Ok(outcome));
    assert_eq!(outcome.estimate.samples, 25);
}

/// The covariance's blocks of eight, and its diagonal's roots, by arm and parameter.
#[test]
fn what_is_said_of_one_arm_is_its_part_of_the_whole() {
    let measured = samples::<25>(&changed(5), 28);
    let stated = settings().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
    let mut calibrator = JointCalibrator::new(&robot(), &stated);
    calibrator.add_many(&measured).unwrap();
    let outcome = calibrator.solve().unwrap();
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
        // Of eight parameters the samples determine those that the tolerance does not hold.
        assert!((own.degrees_of_freedom - (25.0 - (8.0 - held))).abs() < 1e-12);
    }
}

/// Whatever the settings say: samples that are in a factor are weighed already.
#[test]
fn the_noise_of_a_factor_is_that_of_its_calibration() {
    let calibrator = JointCalibrator::new(&robot(), &settings());
    let other = Settings::default().with_noise(Noise::new(0.5, 0.0).unwrap());
    let of_factor = JointCalibrator::of_factor(*calibrator.factor(), &other);
    assert_eq!(of_factor.settings().noise, settings().noise);
}

/// From a ten-thousandth of the robot's size, whose square is a hundred-millionth and whose fourth power is rounding:
/// after the second linearisation chord steps do the rest.
#[test]
fn chord_steps_spare_the_last_linearisation() {
    let near = Robot::from_parameters(robot().parameters().map(|arm| {
        let [.., la_x, la_y, lb] = arm;
        let [dx, dy, dz, theta, alpha, ..] = arm;
        [
            dx + 0.02,
            dy,
            dz,
            theta + 1e-4,
            alpha,
            la_x - 0.03,
            la_y,
            lb + 0.02,
        ]
    }))
    .unwrap();
    let measured = samples::<30>(&near, 29).map(|sample| Sample {
        position: near.forward(&sample.joints).unwrap(),
        ..sample
    });
    let mut calibrator = JointCalibrator::new(&robot(), &settings());
    calibrator.add_many(&measured).unwrap();
    assert_eq!(calibrator.solve().unwrap().estimate.iterations, 2);
}

/// Of three arms together it is not known whose samples contradict the noise.
#[test]
fn a_contradiction_of_all_arms_names_none() {
    let measured = samples::<30>(&changed(1), 31);
    let stated = Settings::default().with_noise(Noise::new(1e-3, 0.0).unwrap());
    let mut calibrator = JointCalibrator::new(&robot(), &stated);
    calibrator.add_many(&measured).unwrap();
    assert!(matches!(
        calibrator.solve(),
        Err(Refusal::ResidualContradictsNoise { arm: None, .. })
    ));
}
