//! Noisy measurements, each arm by itself: the covariance is right, the error is at the Cramér–Rao bound.

use delta_cal::robot::ParameterKind;
use delta_cal::{
    IkmCalibrator, Noise, Parameter, Robot, RobotOutcome, Sample, Settings, Tolerance,
};
use delta_cal_tests::{
    Spread, generator, measurements, paper_robot, parameter_differences, perturbed,
};
use nalgebra::SMatrix;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Robots about the paper's, measured at random poses; the same numbers give the same robots.
#[derive(Debug, Clone, Copy)]
struct Campaign {
    /// Campaigns of different numbers share nothing.
    number: u64,
    poses: usize,
    /// By how much the robots differ from nominal, mm and radians; with a prior also the tolerance.
    start_error: (f64, f64),
    /// One σ of position and joint angle, mm and radians.
    noise: (f64, f64),
    spread: Spread,
    prior: bool,
}

/// Over all robots of a campaign. Angles count times the upper arm's length.
#[derive(Debug, Default)]
struct Statistics {
    /// The other figures are without them.
    refused: usize,
    /// Errors over their predicted σ, squared.
    z_squared: Vec<f64>,
    error_squared: f64,
    bound_squared: f64,
}

impl Statistics {
    fn z_rms(&self) -> f64 {
        (self.z_squared.iter().sum::<f64>() / self.z_squared.len() as f64).sqrt()
    }

    fn error_over_bound(&self) -> f64 {
        (self.error_squared / self.bound_squared).sqrt()
    }
}

impl Campaign {
    /// Of 500 robots.
    fn run(&self) -> Statistics {
        let nominal = paper_robot::<f64>();
        let (length, angle) = self.start_error;
        let noise = Noise::new(self.noise.0, self.noise.1).unwrap();
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance(self.prior.then(|| Tolerance::new(length, angle).unwrap()));
        let mut statistics = Statistics::default();
        for robot in 0..500 {
            let mut rng = generator(self.number, robot);
            let truth = perturbed(&nominal, length, angle, self.spread, &mut rng);
            let samples = measurements(&truth, self.poses, Some(&noise), &mut rng);
            let mut calibrator = IkmCalibrator::new(&nominal, &settings);
            calibrator.add_many(&samples).unwrap();
            let Ok(outcome) = calibrator.calibrate() else {
                statistics.refused += 1;
                continue;
            };
            let errors = parameter_differences(&outcome.robot, &truth);
            for (error, sigma) in errors.iter().zip(sigmas(&outcome)) {
                statistics.z_squared.push((error / sigma).powi(2));
                statistics.error_squared += error * error;
            }
            if !self.prior {
                statistics.bound_squared += cramer_rao_bound(&truth, &samples, &noise);
            }
        }
        statistics
    }
}

/// The trace of the inverse Fisher information of the true robot, angles times the upper arm's
/// length, from the constraint's derivatives (3.21) and a dense inverse.
fn cramer_rao_bound(truth: &Robot<f64>, samples: &[Sample<f64>], noise: &Noise<f64>) -> f64 {
    let mut bound = 0.0;
    for (index, arm) in truth.arms().iter().enumerate() {
        let mut information = SMatrix::<f64, 8, 8>::zeros();
        for sample in samples {
            let (x, q) = (&sample.position, sample.joints[index]);
            let mut row = arm.constraint_by_parameters(x, q);
            row[3] /= 260.0;
            row[4] /= 260.0;
            let variance = (arm.constraint_by_position(x, q).norm() * noise.position()).powi(2)
                + (arm.constraint_by_joint(x, q) * noise.joint()).powi(2);
            information += row * row.transpose() / variance;
        }
        bound += information.try_inverse().unwrap().trace();
    }
    bound
}

/// All 24 σ, angles times the upper arm's length, as `parameter_differences` has them.
fn sigmas(outcome: &RobotOutcome<f64>) -> Vec<f64> {
    let of_arm = |arm: &delta_cal::calibration::ArmOutcome<f64>| {
        Parameter::ROTARY.map(|parameter| {
            let unit = match parameter.kind() {
                ParameterKind::Length => 1.0,
                ParameterKind::Angle | ParameterKind::Ratio => 260.0,
            };
            arm.standard_deviation(parameter).unwrap() * unit
        })
    };
    outcome.arms.iter().flat_map(of_arm).collect()
}

#[test]
fn z_scores_have_rms_between_0_9_and_1_1_and_errors_reach_the_cramer_rao_bound() {
    for (number, poses, noise) in [
        (41, 20, (0.001, 0.001 * DEGREE)),
        (42, 20, (0.01, 0.01 * DEGREE)),
        (43, 40, (0.05, 0.002 * DEGREE)),
        (44, 60, (0.001, 0.01 * DEGREE)),
        (45, 200, (0.1, 0.01 * DEGREE)),
    ] {
        let result = Campaign {
            number,
            poses,
            start_error: (1.0, DEGREE),
            noise,
            spread: Spread::Uniform,
            prior: false,
        }
        .run();
        let (z, ratio) = (result.z_rms(), result.error_over_bound());
        println!("{poses} poses, {noise:?}: z rms {z:.3}, error over bound {ratio:.3}");
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
        // 12,000 numbers whose own scatter is some 3 %, heavy-tailed poses included.
        assert!(ratio <= 1.05, "{poses} poses: error over bound {ratio}");
    }
}

#[test]
fn with_a_prior_the_covariance_is_right_for_robots_drawn_from_it() {
    for (number, poses) in [(46, 5), (47, 8), (48, 20)] {
        let result = Campaign {
            number,
            poses,
            start_error: (0.1, 0.1 * DEGREE),
            noise: (0.001, 0.01 * DEGREE),
            spread: Spread::Normal,
            prior: true,
        }
        .run();
        let z = result.z_rms();
        println!("{poses} poses with prior: z rms {z:.3}");
        assert_eq!(result.refused, 0);
        assert!((0.9..=1.1).contains(&z), "{poses} poses: z rms {z}");
    }
}
