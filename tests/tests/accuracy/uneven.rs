//! Noise that is not stated, and not even: that of the joints moves the platform the more, the nearer it is to the edge.

use crate::accuracy::after;
use crate::accuracy::robots::{geometries, robot_file, samples_file, spread_pose};
use delta_cal::Noise;
use delta_cal::frame::RigidTransform;
use delta_cal::simulate::simulate_sample;
use delta_cal_host::{CalibrationMethod, Options, accepted};
use delta_cal_tests::{Spread, generator, perturbed};

const ROBOTS: u64 = 24;

/// The mean square of the position error over the one that is reported.
fn achieved_over_reported(method: CalibrationMethod, joint_deg: f64) -> f64 {
    let noise = Noise::new(0.02, f64::to_radians(joint_deg)).unwrap();
    // A platform larger than the base, whose edges are steep.
    let (_, nominal) = geometries()[3];
    let at = RigidTransform::identity();
    let mut sums = [0.0; 2];
    for number in 0..ROBOTS {
        let mut rng = generator(141, number);
        let truth = perturbed(
            &nominal,
            0.5,
            f64::to_radians(0.2),
            Spread::Normal,
            &mut rng,
        );
        let samples: Vec<_> = (0..150)
            .map(|_| {
                let joints = spread_pose(&truth, &mut rng);
                simulate_sample(&truth, &joints, Some(&noise), &mut rng).unwrap()
            })
            .collect();
        let held_out: Vec<_> = (0..1000).map(|_| spread_pose(&truth, &mut rng)).collect();
        let options = Options {
            method,
            ..Options::default()
        };
        let file = robot_file(&nominal, (false, false));
        let result = accepted(&file, &samples_file(&samples, &at), options).unwrap();
        sums[0] += after(&truth, &result, &at, &held_out).absolute.powi(2);
        sums[1] += result.expected.unwrap().absolute.rms.powi(2);
    }
    sums[0] / sums[1]
}

/// With 0.01° the error is twice the one that an even noise would make, its square four times. The squares of a robot's
/// error scatter by some 40 % (`the_reported_error_is_the_achieved_one_for_every_geometry`), of 24 by 8 %: three
/// standard deviations, and a quarter more because the noise is told from the residuals.
#[test]
fn the_reported_error_holds_noise_of_the_joints_that_is_not_stated() {
    for method in [CalibrationMethod::Joint, CalibrationMethod::Fkm] {
        for joint_deg in [0.0, 0.01] {
            let squares = achieved_over_reported(method, joint_deg);
            println!("{} {joint_deg}: {squares:.2}", method.name());
            assert!((0.6..1.5).contains(&squares), "{squares}");
        }
    }
}
