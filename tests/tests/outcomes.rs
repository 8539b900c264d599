//! What a calibration reports, against the definitions: residuals, noise, covariance, the share of the
//! prior, the limits of a refusal, iterations.

use delta_cal::calibration::limits::chi_square_quantile;
use delta_cal::calibration::{Ikm, Start};
use delta_cal::robot::{Arm, Drive};
use delta_cal::{
    ArmIndex, IkmCalibrator, Noise, Parameter, Refusal, Robot, RobotOutcome, Sample, Settings,
    Tolerance,
};
use delta_cal_tests::geometries::distances;
use delta_cal_tests::{
    Spread, calibrated, generator, measurements, paper_robot, robot_and_samples,
};
use nalgebra::{SMatrix, Vector3};

const SIGMA: f64 = 0.02;

fn case(seed: u64, count: usize) -> (Robot<f64>, Vec<Sample<f64>>) {
    let noise = Noise::new(SIGMA, 0.0).unwrap();
    robot_and_samples(
        (640, seed),
        (0.3, 0.002, Spread::Normal),
        count,
        Some(&noise),
    )
}

fn calibrate(
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
) -> Result<RobotOutcome<f64>, Refusal> {
    calibrated::<f64, Ikm>(&paper_robot(), samples, settings)
}

/// Σ d² and JᵀJ of an arm, d the distance along the forearm of the robot before.
fn sums(arm: &Arm<f64>, index: ArmIndex, samples: &[Sample<f64>]) -> (f64, SMatrix<f64, 8, 8>) {
    let (distances, jacobian) = distances(&paper_robot(), index, arm, samples);
    (distances.norm_squared(), jacobian.tr_mul(&jacobian))
}

fn same(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-6 * expected.abs()
}

fn same_matrix(found: &SMatrix<f64, 8, 8>, expected: &SMatrix<f64, 8, 8>) -> bool {
    (found - expected).norm() <= 1e-5 * expected.norm()
}

fn tolerances() -> [f64; 8] {
    [0.3, 0.3, 0.3, 0.002, 0.002, 0.3, 0.3, 0.3]
}

/// With a tolerance the information is JᵀJ/σ² + diag(1/t²), and the prior's share of a parameter is its
/// variance over t².
#[test]
fn the_prior_counts_as_eight_more_measurements() {
    for count in [4, 30] {
        let (_, samples) = case(6, count);
        let settings = Settings::default()
            .with_noise(Noise::new(SIGMA, 0.0).unwrap())
            .with_tolerance(Tolerance::new(0.3, 0.002).unwrap());
        let outcome = calibrate(&samples, &settings).unwrap();
        for (index, arm) in ArmIndex::ALL.into_iter().zip(&outcome.arms) {
            let (_, mut information) = sums(&arm.arm, index, &samples);
            information /= SIGMA * SIGMA;
            let of_samples = information;
            for (k, tolerance) in tolerances().into_iter().enumerate() {
                information[(k, k)] += 1.0 / (tolerance * tolerance);
            }
            let expected = information.try_inverse().unwrap();
            assert!(same_matrix(&arm.covariance.unwrap(), &expected));
            for (k, tolerance) in tolerances().into_iter().enumerate() {
                let share = expected[(k, k)] / (tolerance * tolerance);
                assert!((arm.prior_share[k] - share).abs() < 1e-6, "{k}");
            }
            let determined = (expected * of_samples).trace();
            assert!((arm.degrees_of_freedom - (count as f64 - determined).max(0.0)).abs() < 1e-6);
        }
    }
}

/// A tolerance without a stated noise: the noise that is found in the samples is the one that, had it
/// been stated, would have given the same result.
#[test]
fn the_noise_balanced_against_a_tolerance_could_have_been_stated() {
    let tolerance = Some(Tolerance::new(0.3, 0.002).unwrap());
    let mut compared = 0;
    for (seed, count) in [(11, 9), (12, 12), (13, 20), (14, 60)] {
        let (_, samples) = case(seed, count);
        let balanced = Settings::default().with_tolerance(tolerance);
        let found = calibrate(&samples, &balanced).unwrap();
        for (index, arm) in ArmIndex::ALL.into_iter().zip(&found.arms) {
            let sigma = arm.estimated_noise.unwrap();
            let (squares, information) = sums(&arm.arm, index, &samples);
            assert!(same(sigma, (squares / arm.degrees_of_freedom).sqrt()));
            // γ at that noise.
            let mut with_prior = information;
            for (k, tolerance) in tolerances().into_iter().enumerate() {
                with_prior[(k, k)] += (sigma / tolerance).powi(2);
            }
            let determined = (with_prior.try_inverse().unwrap() * information).trace();
            let freedom = count as f64 - determined;
            // The rounds end when it has settled: a few, if there are samples enough.
            assert!(count < 20 || arm.iterations < 20, "{}", arm.iterations);
            // It has settled to a hundredth of the noise.
            assert!((arm.degrees_of_freedom / freedom - 1.0).abs() < 0.05);
            let stated = balanced.with_noise(Noise::new(sigma, 0.0).unwrap());
            let other = match calibrate(&samples, &stated) {
                Ok(outcome) => outcome.arms[index.index()].clone(),
                // Another arm's samples contradict the noise of this one.
                Err(refusal) if refusal.arm() != Some(index) => continue,
                Err(refusal) => panic!("{refusal}"),
            };
            compared += 1;
            for parameter in Parameter::ROTARY {
                let apart = (other.arm.get(parameter) - arm.arm.get(parameter)).abs();
                assert!(apart < 0.05 * other.standard_deviation(parameter).unwrap());
            }
        }
    }
    assert!(compared >= 8, "{compared}");
}

/// Twice the quantile, with n − 8 degrees of freedom: just within it is accepted, just beyond refused.
#[test]
fn a_stated_noise_is_contradicted_beyond_twice_the_quantile() {
    let (_, samples) = case(21, 20);
    let outcome = calibrate(&samples, &Settings::default()).unwrap();
    // The largest Σd² of the three arms decides.
    let largest = ArmIndex::ALL
        .into_iter()
        .zip(&outcome.arms)
        .map(|(index, arm)| sums(&arm.arm, index, &samples).0)
        .fold(0.0, f64::max);
    let with = |share: f64, freedom: f64, tolerance: Option<Tolerance<f64>>| {
        let cost = 2.0 * chi_square_quantile(freedom) * share;
        let settings = Settings::default()
            .with_noise(Noise::new((largest / cost).sqrt(), 0.0).unwrap())
            .with_tolerance(tolerance);
        (cost, calibrate(&samples, &settings))
    };
    assert!(with(0.98, 12.0, None).1.is_ok());
    let (cost, refused) = with(1.02, 12.0, None);
    let Err(Refusal::ResidualContradictsNoise { ratio, .. }) = refused else {
        panic!("{refused:?}");
    };
    assert!((f64::from(ratio) / (cost / 12.0).sqrt() - 1.0).abs() < 1e-3);
    // With a tolerance there are as many as samples, less what it costs: so wide that it costs nothing.
    let wide = Some(Tolerance::new(50.0, 0.5).unwrap());
    assert!(with(0.97, 20.0, wide).1.is_ok());
    assert!(matches!(
        with(1.03, 20.0, wide).1,
        Err(Refusal::ResidualContradictsNoise { .. })
    ));
}

/// Without a stated noise no residual is judged; how far a parameter is from nominal still is.
#[test]
fn six_tolerances_are_the_limit_with_and_without_a_stated_noise() {
    let off = |index: usize, by: f64| {
        let mut arms = *paper_robot::<f64>().arms();
        let mut p = arms[1].parameters();
        p[index] += by;
        arms[1] = Arm::new(p).unwrap();
        let truth = Robot::new(arms).unwrap();
        measurements(&truth, 30, None, &mut generator(642, 0))
    };
    for noise in [None, Some(Noise::new(1e-4, 0.0).unwrap())] {
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance(Tolerance::new(0.1, 0.001).unwrap());
        for (index, tolerance) in [(2, 0.1), (4, 0.001), (7, 0.1)] {
            assert!(calibrate(&off(index, 4.0 * tolerance), &settings).is_ok());
            let refused = calibrate(&off(index, -12.0 * tolerance), &settings);
            let Err(Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances,
            }) = refused
            else {
                panic!("{refused:?}");
            };
            assert_eq!(arm, ArmIndex::Second);
            assert_eq!(parameter, Parameter::ROTARY[index]);
            assert!((tolerances - 12.0).abs() < 0.2, "{tolerances}");
        }
    }
}

/// The other intersection of the forearms' spheres, above the plane of the elbows: the constraints hold,
/// and the robot never gets there.
fn above_the_elbows(robot: &Robot<f64>, joints: [f64; 3]) -> Option<Sample<f64>> {
    let below = robot.forward(&joints).ok()?;
    let [first, second, third] = robot.arms();
    let corner = first.elbow(joints[0]);
    let normal = (second.elbow(joints[1]) - corner)
        .cross(&(third.elbow(joints[2]) - corner))
        .normalize();
    let position = below - normal * (2.0 * normal.dot(&(below - corner)));
    Some(Sample { joints, position })
}

#[test]
fn a_platform_above_its_elbows_is_refused_wherever_they_are() {
    let nominal = paper_robot::<f64>();
    for centre in [-0.6, 0.0, 0.5, 1.1] {
        let mut rng = generator(643, 0);
        let mut samples = Vec::new();
        while samples.len() < 20 {
            let joints = [(); 3].map(|()| centre + 0.4 * delta_cal_tests::uniform(&mut rng));
            samples.extend(above_the_elbows(&nominal, joints));
        }
        assert_eq!(
            calibrate(&samples, &Settings::default()),
            Err(Refusal::WrongSide)
        );
        // Below them the same joint angles are accepted.
        for sample in &mut samples {
            sample.position = nominal.forward(&sample.joints).unwrap();
        }
        assert!(calibrate(&samples, &Settings::default()).is_ok());
    }
}

#[test]
fn a_joint_angle_may_be_two_turns_and_no_more() {
    let (_, samples) = case(51, 1);
    let limit = 4.0 * std::f64::consts::PI;
    for (q, accepted) in [(12.5, true), (-12.5, true), (12.6, false), (-12.6, false)] {
        assert_eq!(f64::abs(q) <= limit, accepted);
        let mut sample = samples[0];
        sample.joints[1] = q;
        assert_eq!(sample.check(Drive::Rotary).is_ok(), accepted, "{q}");
    }
}

#[test]
fn a_position_may_be_ten_thousand_units_from_the_centre() {
    // The centre is the platform's position at 20°, to a sixteenth of a unit; the unit is a power of two.
    let unit = 256.0;
    let centre = paper_robot::<f64>()
        .forward(&[20f64.to_radians(); 3])
        .unwrap();
    assert!(centre.norm() > 100.0);
    let mut calibrator = IkmCalibrator::new(&paper_robot::<f64>(), &Settings::default());
    for direction in [Vector3::x(), -Vector3::z(), Vector3::z()] {
        for (distance, accepted) in [(0.99999, true), (1.00001, false)] {
            let sample = Sample {
                joints: [0.0; 3],
                position: centre + direction * (1e4 * unit * distance),
            };
            let added = calibrator.add(&sample);
            assert_eq!(added.is_ok(), accepted, "{direction} {distance}");
        }
    }
}

/// An easy calibration is one start and few linearisations; the count is that of all starts.
#[test]
fn a_good_fit_is_not_started_again() {
    for (seed, count) in [(31, 20), (32, 40), (33, 100)] {
        for settings in [
            Settings::default(),
            Settings::default().with_noise(Noise::new(SIGMA, 0.0).unwrap()),
        ] {
            let (_, samples) = case(seed, count);
            let outcome = calibrate(&samples, &settings).unwrap();
            for arm in &outcome.arms {
                assert_eq!(arm.start, Start::Nominal);
                assert!((2..6).contains(&arm.iterations), "{}", arm.iterations);
            }
        }
    }
}

#[test]
fn no_start_takes_more_linearisations_than_allowed() {
    let (_, samples) = case(34, 20);
    let settings = Settings::default()
        .with_iteration_limit(2)
        .with_free_start(true);
    let refused = calibrate(&samples, &settings);
    let Err(Refusal::NotConverged { iterations, .. }) = refused else {
        panic!("{refused:?}");
    };
    // The linear fit, and six arms that the spread of the samples decides.
    assert_eq!(iterations, 7 * 2);
    // No limit, as in C, is the default one.
    let none = Settings::<f64>::new().with_iteration_limit(0);
    assert_eq!(none, Settings::new());
}
