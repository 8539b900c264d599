//! Observability indices, leverages and the positions' uncertainty against what is known otherwise.

use delta_cal::simulate::{random_pose, standard_normal};
use delta_cal::{ArmIndex, Noise, Parameter, Robot, Sample};
use delta_cal_host::accuracy::evaluation::CramerRaoBound;
use delta_cal_host::accuracy::position_uncertainty::PositionUncertainty;
use delta_cal_host::planning::observability::{Combination, Indices, Observability};
use delta_cal_host::{
    CalibrationMethod, InstrumentFacts, PositionUnit, Record, RobotFile, Row, SamplesFile,
};
use delta_cal_tests::{generator, measurements, paper_limits, paper_robot};
use nalgebra::{DMatrix, SMatrix};

fn file(noise: Noise<f64>) -> RobotFile {
    RobotFile {
        name: "paper".to_owned(),
        robot: paper_robot(),
        limits: paper_limits(),
        forearm_limit: None,
        tolerance: None,
        noise: Some(noise),
        sensor_frame: None,
        transmission: None,
        instruments: InstrumentFacts::default(),
        record: Record::default(),
    }
}

fn samples_file(samples: Vec<Sample<f64>>) -> SamplesFile {
    SamplesFile {
        name: "samples".to_owned(),
        rows: (2..)
            .zip(samples)
            .map(|(line, value)| Row { line, value })
            .collect(),
        all: None,
        in_degrees: true,
        positions_in: PositionUnit::Millimetre,
    }
}

/// Singular values 8, 4, 2, 1 from nine poses, worked out by hand.
#[test]
fn the_indices_of_a_simple_case_are_those_of_their_definitions() {
    let indices = Indices::of(&[8.0, 4.0, 2.0, 1.0], 9);
    for (found, expected) in [
        (indices.o1, 64f64.powf(0.25) / 3.0),
        (indices.o2, 0.125),
        (indices.o3, 1.0),
        (indices.o4, 0.125),
        (indices.o5, 1.0 / 1.875),
    ] {
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
    }
    let none = Indices::of(&[8.0, 4.0, 0.0], 9);
    for found in [none.o1, none.o2, none.o3, none.o4, none.o5] {
        assert!(found.abs() < f64::MIN_POSITIVE);
    }
}

#[test]
fn a_combination_names_each_change_once() {
    let words = |parts: &[(usize, Parameter, f64)]| {
        let parts = parts
            .iter()
            .map(|(arm, parameter, part)| (ArmIndex::ALL[*arm], *parameter, *part));
        let combination = Combination {
            parts: parts.collect(),
            sigma: 1.0,
        };
        combination.in_words()
    };
    let (dx, dz, lb) = (Parameter::Dx, Parameter::Dz, Parameter::Lb);
    assert_eq!(words(&[(1, lb, 1.0)]), "Lb");
    assert_eq!(words(&[(1, lb, 1.0), (1, dz, -0.5)]), "+Lb and \u{2212}Dz");
    let several = [
        (1, lb, 1.0),
        (0, lb, 0.9),
        (2, dz, -0.8),
        (2, lb, 0.7),
        (0, dz, -0.6),
        (1, dz, 0.5),
        (0, dx, 0.4),
    ];
    assert_eq!(
        words(&several),
        "+Lb of all arms, \u{2212}Dz of arms 1 and 3, +Dz of arm 2 and +Dx of arm 1"
    );
}

/// The sum of 1/σₖ² is the trace of the covariance: the bound of a calibration.
#[test]
fn the_singular_values_and_the_cramer_rao_bound_are_of_one_matrix() {
    let noise = Noise::new(0.02, 0.002f64.to_radians()).unwrap();
    for robot in 0..100 {
        let mut rng = generator(81, robot);
        let samples = measurements(&paper_robot(), 14, None, &mut rng);
        let joints: Vec<_> = samples.iter().map(|sample| sample.joints).collect();
        let samples = samples_file(samples);
        for method in [CalibrationMethod::Ikm, CalibrationMethod::Fkm] {
            let observability = Observability::new(&file(noise), &samples, method).unwrap();
            let values = observability
                .blocks
                .iter()
                .flat_map(|block| &block.singular_values);
            let trace: f64 = values.map(|value| value.powi(-2)).sum();
            let bound = CramerRaoBound::new(method, &paper_robot(), &joints, &noise, None);
            let off = trace.sqrt() / bound.unwrap().error() - 1.0;
            // The condition is up to 1e4: both lose four digits of sixteen.
            assert!(off.abs() < 1e-9, "robot {robot}: {off:e}");
        }
    }
}

/// H = J (JᵀJ)⁻¹ Jᵀ of one arm, by a general inverse.
#[test]
fn leverages_are_the_diagonal_of_the_hat_matrix() {
    let noise = Noise::new(0.02, 0.002f64.to_radians()).unwrap();
    let robot: Robot<f64> = paper_robot();
    for case in 0..50 {
        let mut rng = generator(82, case);
        let samples = measurements(&robot, 11, None, &mut rng);
        let mut expected = vec![0.0; samples.len()];
        for (index, arm) in robot.arms().iter().enumerate() {
            let rows = DMatrix::from_fn(samples.len(), 8, |row, column| {
                let (x, q) = (&samples[row].position, samples[row].joints[index]);
                let sigma = (arm.constraint_by_position(x, q).norm() * 0.02)
                    .hypot(arm.constraint_by_joint(x, q) * 0.002f64.to_radians());
                let unit = if column == 3 || column == 4 {
                    260.0
                } else {
                    1.0
                };
                arm.constraint_by_parameters(x, q)[column] / unit / sigma
            });
            let inverse = (rows.transpose() * &rows).try_inverse().unwrap();
            let hat = &rows * inverse * rows.transpose();
            for (sum, own) in expected.iter_mut().zip(hat.diagonal().iter()) {
                *sum += own;
            }
        }
        let found =
            Observability::new(&file(noise), &samples_file(samples), CalibrationMethod::Ikm)
                .unwrap();
        for (found, expected) in found.leverages.iter().zip(&expected) {
            // JᵀJ squares a condition of up to 1e4.
            assert!((found.total - expected).abs() < 1e-6, "case {case}");
            assert!(found.largest <= 1.0 + 1e-9);
        }
        let total: f64 = found.leverages.iter().map(|leverage| leverage.total).sum();
        assert!((total - 24.0).abs() < 1e-9);
    }
}

/// Moving all parameters along the weakest combination changes the residuals least.
#[test]
fn the_weakest_combination_is_named_where_it_is_known_beforehand() {
    // All joints alike: the platform stays on the axis, and what turns or shifts the arm about it
    // is not seen.
    let robot: Robot<f64> = paper_robot();
    let samples: Vec<_> = (0..20)
        .map(|index| {
            let joints = [0.08 * f64::from(index) - 0.8; 3];
            Sample {
                joints,
                position: robot.forward(&joints).unwrap(),
            }
        })
        .collect();
    let noise = Noise::new(0.02, 0.0).unwrap();
    let found =
        Observability::new(&file(noise), &samples_file(samples), CalibrationMethod::Ikm).unwrap();
    assert!(!found.determined());
    for block in &found.blocks {
        assert!(block.rank < 8);
        assert!(block.weakest.sigma.is_infinite());
        let named = |parameter| block.weakest.parts.iter().any(|part| part.1 == parameter);
        // The forearm and the base radius are in every pose: never named alone.
        assert!(!(named(Parameter::Lb) && block.weakest.parts.len() == 1));
    }
}

/// √tr(J C Jᵀ) against the scatter of forward kinematics of robots drawn from C.
#[test]
fn the_position_sigma_is_the_scatter_of_robots_with_that_covariance() {
    const ROBOTS: u32 = 4000;
    let robot: Robot<f64> = paper_robot();
    let noise = Noise::new(0.02, 0.002f64.to_radians()).unwrap();
    let mut rng = generator(83, 0);
    let joints: Vec<_> = measurements(&robot, 20, None, &mut rng)
        .iter()
        .map(|sample| sample.joints)
        .collect();
    let bound = CramerRaoBound::new(CalibrationMethod::Fkm, &robot, &joints, &noise, None).unwrap();
    let covariance = bound.of_parameters(&robot);
    let factor: SMatrix<f64, 24, 24> = covariance.cholesky().unwrap().l();
    let uncertainty = PositionUncertainty {
        robot: &robot,
        covariance: &covariance,
    };
    let poses: Vec<_> = (0..10)
        .map(|_| random_pose(&robot, &paper_limits(), &mut rng).unwrap())
        .collect();
    let mut squares = vec![0.0; poses.len()];
    for _ in 0..ROBOTS {
        let drawn = SMatrix::<f64, 24, 1>::from_fn(|_, _| standard_normal(&mut rng));
        let change = factor * drawn;
        let mut arms = robot.arms().map(|arm| arm.parameters());
        for (value, change) in arms.iter_mut().flatten().zip(change.iter()) {
            *value += change;
        }
        let other = Robot::new(arms.map(|arm| delta_cal::robot::Arm::new(arm).unwrap())).unwrap();
        for (sum, pose) in squares.iter_mut().zip(&poses) {
            *sum += (other.forward(&pose.joints).unwrap() - pose.position).norm_squared();
        }
    }
    for (sum, pose) in squares.iter().zip(&poses) {
        let scatter = (sum / f64::from(ROBOTS)).sqrt();
        let stated = uncertainty.sigma(&pose.position, &pose.joints).unwrap();
        // Of 4000 normal errors, √(1/8000) at most; five times that.
        assert!((scatter / stated - 1.0).abs() < 0.056, "{scatter} {stated}");
    }
}
