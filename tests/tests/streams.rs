//! A million samples in constant memory and single precision.

use delta_cal::calibration::JointCalibrator;
use delta_cal::simulate::standard_normal;
use delta_cal::{Calibrator, Noise, Real, Sample, Settings};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{
    Spread, generator, largest_difference, measurements, paper_robot, perturbed, to_single, uniform,
};
use nalgebra::Vector3;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// A million samples in single precision, beside double precision: one by one, of which four wait
/// for each other; many at once; and in parts of a thousand that are merged.
#[test]
fn a_million_samples_leave_single_precision_intact() {
    let mut rng = generator(74, 0);
    let nominal = paper_robot::<f64>();
    let single_nominal = nominal.cast().unwrap();
    let truth = perturbed(&nominal, 1.0, 0.3 * DEGREE, Spread::Uniform, &mut rng);
    let poses = measurements(&truth, 1000, None, &mut rng);
    let single = Settings::default().with_noise(Noise::<f32>::new(0.02, 0.0).unwrap());
    let double = Settings::default().with_noise(Noise::new(0.02, 0.0).unwrap());
    let empty = Calibrator::<f32>::new(&single_nominal, &single);
    let (mut singly, mut in_blocks, mut merged) = (empty, empty, empty);
    let mut exact = Calibrator::<f64>::new(&nominal, &double);
    for _ in 0..1000 {
        let measured: Vec<_> = poses
            .iter()
            .map(|pose| {
                let jitter = [(); 3].map(|()| 0.02 * 3f64.sqrt() * uniform(&mut rng));
                Sample {
                    position: pose.position + Vector3::from(jitter),
                    ..*pose
                }
            })
            .collect();
        let rounded = to_single(&measured);
        let mut part = empty;
        for sample in &rounded {
            singly.add(sample).unwrap();
            part.add(sample).unwrap();
        }
        in_blocks.add_many(&rounded).unwrap();
        merged.merge(&part).unwrap();
        exact.add_many(&measured).unwrap();
    }
    assert_eq!(merged.samples(), 1_000_000);
    let error = |calibrator: &Calibrator<f32>| {
        let mut calibrator = *calibrator;
        let robot = calibrator.solve().unwrap().robot.cast().unwrap();
        largest_difference(&robot, &truth) * 1e3
    };
    let limit = largest_difference(&exact.solve().unwrap().robot, &truth) * 1e3;
    let (singly, in_blocks, merged) = (error(&singly), error(&in_blocks), error(&merged));
    println!(
        "a million samples of 20 µm, worst parameter: f32 one by one {singly:.2} µm, many at once \
         {in_blocks:.2} µm, merged {merged:.2} µm; f64 {limit:.2} µm"
    );
    // A block rounds R by ε/2 at random: ε √(1e6/4)/2 = 3e-5 of a millimetre's correction, times a
    // condition of some 30. In blocks of sixteen half of that, merged in parts of a thousand a
    // sixteenth.
    assert!(singly < limit + 0.9);
    assert!(in_blocks < limit + 0.45);
    assert!(merged < limit + 0.06);
}

const SAMPLES: usize = 1_000_000;

/// A million samples in single precision: rounding neither grows with their number nor with the noise
/// that they average out. Two robots, one by one and many at once.
#[test]
fn a_million_samples_leave_the_joint_calibrator_intact() {
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
