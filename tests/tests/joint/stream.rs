//! Very many samples in constant memory.

use delta_cal::calibration::JointCalibrator;
use delta_cal::simulate::standard_normal;
use delta_cal::{Noise, Real, Sample, Settings};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, measurements, perturbed, to_single};
use nalgebra::Vector3;

const SAMPLES: usize = 1_000_000;

/// A million samples in single precision: rounding neither grows with their number nor with the noise
/// that they average out. Two robots, one by one and many at once.
#[test]
fn a_million_samples_in_single_precision() {
    let noise = Noise::new(0.02_f32, 3e-5).unwrap();
    let geometries = geometries();
    for (index, at_once) in [(0, false), (1, true)] {
        let (name, nominal) = &geometries[index];
        let mut rng = generator(1470, index as u64);
        let truth = perturbed(nominal, 0.5, 0.003, Spread::Normal, &mut rng);
        let exact = to_single(&measurements(&truth, 1000, None, &mut rng));
        let settings = Settings::default().with_noise(noise);
        let mut calibrator = JointCalibrator::new(&nominal.cast::<f32>().unwrap(), &settings);
        let mut block = Vec::new();
        for sample in exact.iter().cycle().take(SAMPLES) {
            let mut normal = |sigma: f32| sigma * standard_normal::<f32, _>(&mut rng);
            let error = Vector3::new(normal(0.02), normal(0.02), normal(0.02));
            let measured = Sample {
                joints: sample.joints.map(|q| q + normal(3e-5)),
                position: sample.position + error,
            };
            if at_once {
                block.push(measured);
                if block.len() == 1000 {
                    calibrator.add_many(&block).unwrap();
                    block.clear();
                }
            } else {
                calibrator.add(&measured).unwrap();
            }
        }
        assert_eq!(calibrator.samples(), SAMPLES as u64);
        let outcome = calibrator.solve().unwrap();
        let robot = outcome.robot.cast::<f64>().unwrap();
        let mut worst = 0.0_f64;
        for pose in measurements(&truth, 200, None, &mut rng) {
            let distance = truth.singularity_distance(&pose.position, &pose.joints);
            if distance.is_clear() {
                let position = robot.forward(&pose.joints).unwrap();
                worst = worst.max((position - pose.position).norm());
            }
        }
        println!(
            "{name}, a million samples: at most {:.3} µm off, residual {:.4} σ",
            1e3 * worst,
            outcome.estimate.residual_rms.to_f64()
        );
        // The noise itself leaves 0.02 µm in the mean, and W at the nominal robot instead of the true one
        // nothing; half a digit of a position in single precision is 0.015 µm to 0.03 µm.
        assert!(worst < 1e-3, "{worst}");
        // A χ² of three million residuals is known to 4e-4 of its root; W at the nominal robot is off by
        // the robot's error over its size, some 1e-3.
        assert!((outcome.estimate.residual_rms - 1.0).abs() < 0.01);
    }
}
