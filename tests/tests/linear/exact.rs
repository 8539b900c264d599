//! Measurements without errors: what is returned is the robot.

use crate::joint::joint;
use crate::linear::{largest_difference, made, measurements, tolerance};
use delta_cal::calibration::Start;
use delta_cal::{Calibrator, Noise, Sample, Settings};
use delta_cal_tests::geometries::linear_geometries;
use delta_cal_tests::{Spread, generator};

#[test]
fn nine_poses_and_more_give_every_robot_back() {
    for (index, (name, nominal, travel)) in (0..).zip(linear_geometries()) {
        for poses in [9, 12, 20, 60] {
            for robot in 0..10 {
                let mut rng = generator(9110 + index, robot);
                let truth = made(&nominal, 3.0, Spread::Uniform, &mut rng);
                let samples = measurements(&truth, travel, poses, None, &mut rng);
                let outcome = joint(&nominal, &samples, &Settings::default()).unwrap();
                let off = largest_difference(&outcome.robot, &truth);
                // The bound that holds for rotary drives.
                assert!(off < 1e-6, "{name}, {poses} poses, robot {robot}: {off}");
                let mut apart = Calibrator::new(&nominal, &Settings::default());
                apart.add_many(&samples).unwrap();
                let off = largest_difference(&apart.solve().unwrap().robot, &truth);
                assert!(
                    off < 1e-6,
                    "{name}, {poses} poses, robot {robot}, by arms: {off}"
                );
            }
        }
    }
}

#[test]
fn no_guess_is_needed_from_twelve_poses_on() {
    let settings = Settings::default().with_start(Start::Free);
    for (index, (name, nominal, travel)) in (0..).zip(linear_geometries()) {
        for robot in 0..10 {
            let mut rng = generator(9120 + index, robot);
            let truth = made(&nominal, 3.0, Spread::Uniform, &mut rng);
            let samples = measurements(&truth, travel, 20, None, &mut rng);
            let outcome = joint(&nominal, &samples, &settings).unwrap();
            let off = largest_difference(&outcome.robot, &truth);
            assert!(off < 1e-6, "{name}, robot {robot}: {off}");
        }
    }
}

/// In single precision as good as the rounding of the samples lets it be.
#[test]
fn single_precision_gives_the_robot_back_within_its_rounding() {
    for (index, (name, nominal, travel)) in (0..).zip(linear_geometries()) {
        let settings = Settings::<f32>::default().with_noise(Noise::new(0.02, 0.0).unwrap());
        for robot in 0..10 {
            let mut rng = generator(9130 + index, robot);
            let truth = made(&nominal, 1.0, Spread::Uniform, &mut rng);
            let samples: Vec<Sample<f32>> = measurements(&truth, travel, 30, None, &mut rng)
                .iter()
                .map(|sample| {
                    #[allow(clippy::cast_possible_truncation)] // that is the test
                    Sample {
                        joints: sample.joints.map(|s| s as f32),
                        position: sample.position.map(|x| x as f32),
                    }
                })
                .collect();
            let outcome = joint(&nominal.cast::<f32>().unwrap(), &samples, &settings).unwrap();
            let found = outcome.robot.cast::<f64>().unwrap();
            for sample in measurements(&truth, travel, 10, None, &mut rng) {
                let off = (found.forward(&sample.joints).unwrap() - sample.position).norm();
                // Travels and positions are rounded to f32 before; a few units in the last place.
                let [_, high] = travel;
                let limit = 8.0 * f64::from(f32::EPSILON) * high;
                assert!(off < limit, "{name}, robot {robot}: {off}");
            }
        }
    }
}

/// A parameter that a linear drive has not is neither counted nor estimated.
#[test]
fn the_empty_place_stays_empty() {
    let (_, nominal, travel) = linear_geometries().swap_remove(0);
    let mut rng = generator(9140, 0);
    let noise = Noise::new(0.02, 0.0).unwrap();
    let truth = made(&nominal, 1.0, Spread::Normal, &mut rng);
    let samples = measurements(&truth, travel, 30, Some(&noise), &mut rng);
    for tolerance in [None, Some(tolerance())] {
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance(tolerance);
        let outcome = joint(&nominal, &samples, &settings).unwrap();
        let covariance = outcome.estimate.covariance.unwrap();
        for place in [6, 14, 22] {
            assert!(covariance.column(place).iter().all(|entry| *entry == 0.0));
        }
        // 90 readings of 21 parameters; the tolerance holds next to nothing of them.
        let freedom = outcome.estimate.degrees_of_freedom;
        assert!((freedom - 69.0).abs() < 0.5, "{freedom}");
    }
}
