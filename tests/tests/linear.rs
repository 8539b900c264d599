//! Robots whose elbows are carriages on towers: kinematics against other formulas, and exact data give the robot back.

use delta_cal::calibration::{Joint, JointCalibrator};
use delta_cal::kinematics::KinematicsError;
use delta_cal::observations::{
    Height, Instruments, Observation, ObservationNoise, ObservationProblem, ObservationRow, Plane,
};
use delta_cal::robot::{Arm, Drive, GeometryError};
use delta_cal::samples::SampleError;
use delta_cal::simulate::{made_robot, random_pose};
use delta_cal::{ArmIndex, IkmCalibrator, Noise, Parameter, Robot, Sample, Settings, Tolerance};
use delta_cal_tests::geometries::{all_geometries, geometries_of, linear_geometries};
use delta_cal_tests::{
    Spread, calibrated, generator, in_unit, largest_difference, measurements_within, paper_robot,
    perturbed,
};
use nalgebra::{Matrix3, Vector3};
use rand_pcg::Pcg32;

fn tolerance() -> Tolerance<f64> {
    let own = Tolerance::new(0.5, 3e-3).unwrap();
    let own = own.with(Parameter::Zero, 5.0).unwrap();
    own.with(Parameter::Scale, 1e-3).unwrap()
}

/// A robot whose lengths are up to some millimetres off.
fn made(nominal: &Robot<f64>, rng: &mut Pcg32) -> Robot<f64> {
    perturbed(nominal, 5.0, 5e-3, Spread::Normal, rng)
}

/// Where a tower's carriage is, from the angles alone.
fn carriage(arm: &Arm<f64>, travel: f64) -> Vector3<f64> {
    let [x, y] = [Parameter::LeanX, Parameter::LeanY].map(|lean| arm.get(lean).sin());
    let direction = Vector3::new(x, y, (1.0 - x * x - y * y).sqrt());
    let foot = [Parameter::Dx, Parameter::Dy, Parameter::Zero].map(|own| arm.get(own));
    Vector3::from(foot) + travel * arm.get(Parameter::Scale) * direction
}

/// Newton's method on the three distances, from below the carriages.
fn platform(robot: &Robot<f64>, travels: &[f64; 3]) -> Vector3<f64> {
    let arms = robot.arms();
    let carriages = [0, 1, 2].map(|arm| carriage(&arms[arm], travels[arm]));
    let mean = carriages.iter().sum::<Vector3<f64>>() / 3.0;
    let mut x = mean - Vector3::z() * arms[0].lb();
    for _ in 0..50 {
        let rows = carriages.map(|b| (x - b).transpose() * 2.0);
        let errors =
            Vector3::from_fn(|arm, _| (x - carriages[arm]).norm_squared() - arms[arm].lb().powi(2));
        x -= Matrix3::from_rows(&rows).try_inverse().unwrap() * errors;
    }
    x
}

#[test]
fn the_platform_is_at_the_forearms_length_from_every_carriage() {
    for (index, (name, nominal, limits)) in (0..).zip(geometries_of(Drive::Linear)) {
        let mut rng = generator(9100, index);
        for _ in 0..50 {
            let robot = made(&nominal, &mut rng);
            for sample in measurements_within(&robot, &limits, 4, None, &mut rng) {
                let expected = platform(&robot, &sample.joints);
                // Lengths of some hundred mm: a few thousand ε.
                let off = (sample.position - expected).norm();
                assert!(off < 1e-9, "{name}: {off}");
                let back = robot.inverse(&sample.position).unwrap();
                for (found, travel) in back.iter().zip(sample.joints) {
                    assert!((found - travel).abs() < 1e-8, "{name}: {found} {travel}");
                }
            }
        }
    }
}

#[test]
fn what_is_no_tower_is_no_arm() {
    let arm = |parameters| Arm::<f64>::linear(parameters);
    let good = [140.0, 0.0, 0.0, 0.01, -0.01, 1.0, 330.0];
    assert!(arm(good).is_ok());
    for (place, value, error) in [
        (0, f64::NAN, GeometryError::NonFinite(Parameter::Dx)),
        (2, f64::INFINITY, GeometryError::NonFinite(Parameter::Zero)),
        (3, 1.6, GeometryError::LeanTooLarge),
        // Beyond the horizontal, where the sines are those of a tower that stands.
        (3, 2.5, GeometryError::LeanTooLarge),
        (4, -2.5, GeometryError::LeanTooLarge),
        // Squares of lengths must be finite too.
        (0, 1e200, GeometryError::NonFinite(Parameter::Dx)),
        (1, -1e200, GeometryError::NonFinite(Parameter::Dx)),
        (2, 1e200, GeometryError::NonFinite(Parameter::Dx)),
        (5, 1e200, GeometryError::NonFinite(Parameter::Scale)),
        (6, 1e200, GeometryError::NonFinite(Parameter::Lb)),
        (5, 0.0, GeometryError::NotPositive(Parameter::Scale)),
        (5, -1.0, GeometryError::NotPositive(Parameter::Scale)),
        (6, 0.0, GeometryError::NotPositive(Parameter::Lb)),
    ] {
        let mut parameters = good;
        parameters[place] = value;
        assert_eq!(arm(parameters).err(), Some(error), "{place}");
    }
    // 50° in both directions is more than a tower can lean.
    assert_eq!(
        arm([140.0, 0.0, 0.0, 0.9, 0.9, 1.0, 330.0]).err(),
        Some(GeometryError::LeanTooLarge)
    );
    let [turning, ..] = *paper_robot().arms();
    let tower = arm(good).unwrap();
    assert_eq!(
        Robot::new([tower, tower, turning]).err(),
        Some(GeometryError::MixedDrives)
    );
}

/// In any unit a robot has the same joint angles, and travels in its own unit.
#[test]
fn the_unit_of_length_makes_no_difference() {
    for (_, robot, limits) in all_geometries() {
        let pose = random_pose(&robot, &limits, &mut generator(9110, 0)).unwrap();
        let (x, joints) = (pose.position, pose.joints);
        let is_linear = robot.drive() == Drive::Linear;
        for exponent in -15..=15 {
            let unit = 10f64.powi(exponent);
            let scaled = in_unit(&robot, unit);
            let turned = if is_linear { unit } else { 1.0 };
            for (found, expected) in scaled.inverse(&(x * unit)).unwrap().iter().zip(joints) {
                // Lengths of some hundred: a few thousand ε.
                assert!(
                    (found / turned - expected).abs() < 1e-9,
                    "{found} {expected}"
                );
            }
            let single = scaled.cast::<f32>().unwrap();
            let there = single
                .forward(&joints.map(|q| (q * turned) as f32))
                .unwrap();
            // A few ε of up to 1500 mm.
            let off = (there.cast::<f64>() / unit - x).norm();
            assert!(off < 3e-3, "1e{exponent}: {off} mm");
        }
    }
}

/// Where the forearm is square to its tower, just beyond, and at a number that has no square.
#[test]
fn the_edge_of_a_towers_reach_is_singular_and_beyond_is_unreachable() {
    let robot = Robot::linear(140.0, 330.0, None).unwrap();
    let first = ArmIndex::First;
    let outwards = robot.arms()[0].d() / 140.0;
    // As far from the first tower as its forearm is long, and nearer to both others.
    for (distance, expected) in [
        (330.0 * (1.0 - 1e-12), None),
        (330.0 * (1.0 - 1e-15), Some(KinematicsError::Serial(first))),
        (330.0 * (1.0 + 1e-15), Some(KinematicsError::Serial(first))),
        (
            330.0 * (1.0 + 1e-12),
            Some(KinematicsError::Unreachable(first)),
        ),
        (1e200, Some(KinematicsError::NonFinite(first))),
    ] {
        let x = outwards * (140.0 - distance);
        assert_eq!(robot.inverse(&x).err(), expected, "{distance}");
    }
    assert!(robot.forward(&[0.0, 0.0, 1000.0]).is_err());
    assert!(robot.forward(&[f64::NAN, 0.0, 0.0]).is_err());
}

/// A parameter that a linear drive has not is neither counted nor estimated.
#[test]
fn the_empty_place_stays_empty() {
    let (_, nominal, limits) = geometries_of(Drive::Linear).swap_remove(0);
    let mut rng = generator(9140, 0);
    let noise = Noise::new(0.02, 0.0).unwrap();
    let truth = made_robot(&nominal, &tolerance(), &mut rng).unwrap();
    let samples = measurements_within(&truth, &limits, 30, Some(&noise), &mut rng);
    for tolerance in [None, Some(tolerance())] {
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance(tolerance);
        let outcome = calibrated::<_, Joint>(&nominal, &samples, &settings).unwrap();
        let covariance = outcome.estimate.covariance.unwrap();
        for place in [6, 14, 22] {
            assert!(covariance.column(place).iter().all(|entry| *entry == 0.0));
        }
        // 90 readings of 21 parameters; the tolerance holds next to nothing of them.
        let freedom = outcome.estimate.degrees_of_freedom;
        assert!((freedom - 69.0).abs() < 0.5, "{freedom}");
    }
}

/// Of robots made to a tolerance each tower's place has its own σ and the common one, which two towers share.
#[test]
fn made_robots_have_the_common_radius_beside_each_towers_own_place() {
    const RADIUS: f64 = 3.0;
    let (_, nominal, _) = &linear_geometries()[0];
    let tolerance = tolerance().with_radius(RADIUS).unwrap();
    let mut rng = generator(9450, 0);
    let (count, mut own, mut shared) = (4000, 0.0, 0.0);
    for _ in 0..count {
        let robot = made_robot(nominal, &tolerance, &mut rng).unwrap();
        let outwards: Vec<f64> = (robot.arms().iter().zip(nominal.arms()))
            .map(|(robot, nominal)| {
                let direction = nominal.d().normalize();
                (robot.d() - nominal.d()).dot(&direction)
            })
            .collect();
        own += outwards[0].powi(2) / f64::from(count);
        shared += outwards[1] * outwards[2] / f64::from(count);
    }
    let (length, common) = (tolerance.of(Parameter::Dx).powi(2), RADIUS.powi(2));
    // Of 4000 normal draws a variance is off by √(2/4000): five of its σ.
    let bound = 5.0 * (2.0 / f64::from(count)).sqrt() * (length + common);
    assert!((own - length - common).abs() < bound, "{own}");
    assert!((shared - common).abs() < bound, "{shared}");
}

/// Without errors, and without a tolerance to pull, the robot comes back wherever it is determined.
#[test]
fn exact_positions_and_heights_give_the_robot_back() {
    let noise = ObservationNoise::new(Noise::new(1.0, 0.0).unwrap(), 0.02, 1.0).unwrap();
    let instruments = Instruments {
        planes: &[Plane::default()],
        ..Instruments::new(noise)
    };
    for (index, (name, nominal, limits)) in (0..).zip(geometries_of(Drive::Linear)) {
        for robot in 0..5 {
            let mut rng = generator(9410 + index, robot);
            let truth = made(&nominal, &mut rng);
            let samples = measurements_within(&truth, &limits, 90, None, &mut rng);
            let mut rows: Vec<_> = (0..)
                .zip(samples)
                .map(|(number, sample)| {
                    let mut row = Observation::at(sample.joints);
                    if number % 2 == 0 {
                        row.position = sample.position.data.0[0].map(Some);
                    } else {
                        let height = sample.position.z + 30.0;
                        row.height = Some(Height { plane: 0, height });
                    }
                    ObservationRow::new(row)
                })
                .collect();
            let problem = ObservationProblem::<f64, 27>::prepare(&nominal, &instruments, &mut rows);
            let outcome = problem.unwrap().solve(&Settings::new()).unwrap();
            let off = largest_difference(&outcome.robot, &truth);
            assert!(off < 1e-6, "{name}: {off}");
        }
    }
}

/// The square of such a travel is finite in single precision, and the factor would not be.
#[test]
fn a_travel_of_thousands_of_forearms_is_refused() {
    for (name, robot, limits) in geometries_of(Drive::Linear) {
        let robot = robot.cast::<f32>().unwrap();
        let mut calibrator = IkmCalibrator::new(&robot, &Settings::default());
        let mut joint = JointCalibrator::new(&robot, &Settings::default());
        let middle = [0.5 * (limits.minimum() + limits.maximum()) as f32; 3];
        let mut sample = Sample {
            joints: middle,
            position: robot.forward(&middle).unwrap(),
        };
        sample.joints[1] = 2e12;
        let error = SampleError::JointTooLarge(ArmIndex::Second);
        assert_eq!(calibrator.add(&sample), Err(error), "{name}");
        assert_eq!(joint.add(&sample), Err(error), "{name}");
        sample.joints[1] = 100.0 * robot.arms()[1].lb();
        assert_eq!(calibrator.add(&sample), Ok(()), "{name}");
        assert_eq!(joint.add(&sample), Ok(()), "{name}");
    }
}
