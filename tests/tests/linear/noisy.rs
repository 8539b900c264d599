//! Measurements with errors: the error of the position over the Cramér–Rao bound, and over what the calibration
//! says of itself.

use crate::joint::joint;
use crate::linear::{made, measurements, spread_out, tolerance};
use delta_cal::simulate::standard_normal;
use delta_cal::{Noise, Settings, Tolerance};
use delta_cal_tests::geometries::{bound, linear_geometries, position_jacobian};
use delta_cal_tests::{Spread, generator};

/// Where the position is compared.
const PLACES: usize = 10;

/// Mean squares of the position error over the bound's and over the reported one, of how many robots, and how
/// many were refused.
fn campaign(poses: usize, stated: Option<Tolerance<f64>>) -> ([f64; 2], f64, u32) {
    let noise = Noise::new(0.02, 0.005).unwrap();
    let settings = Settings::default().with_noise(noise).with_tolerance(stated);
    let (mut sums, mut robots, mut refused) = ([0.0; 2], 0.0, 0);
    for (index, (_, nominal, travel)) in (0..).zip(linear_geometries()) {
        for robot in 0..50 {
            let mut rng = generator(9200 + index, robot);
            let mut truth = made(&nominal, 1.0, Spread::Normal, &mut rng);
            let radius = stated.map_or(0.0, |tolerance| tolerance.radius());
            if radius > 0.0 {
                truth = spread_out(&truth, radius * standard_normal::<f64, _>(&mut rng));
            }
            let samples = measurements(&truth, travel, poses, Some(&noise), &mut rng);
            let limit = bound(&truth, &samples, &noise, stated.as_ref()).unwrap();
            let Ok(outcome) = joint(&nominal, &samples, &settings) else {
                refused += 1;
                continue;
            };
            let reported = outcome.estimate.covariance.unwrap();
            let (mut error, mut expected) = (0.0, [0.0; 2]);
            for place in measurements(&truth, travel, PLACES, None, &mut rng) {
                let found = outcome.robot.forward(&place.joints).unwrap();
                let jacobian = position_jacobian(&truth, &place.joints).unwrap();
                error += (found - place.position).norm_squared();
                for (sum, covariance) in expected.iter_mut().zip([&limit, &reported]) {
                    *sum += (jacobian * covariance * jacobian.transpose()).trace();
                }
            }
            for (sum, expected) in sums.iter_mut().zip(expected) {
                *sum += error / expected;
            }
            robots += 1.0;
        }
    }
    (sums.map(|sum| (sum / robots).sqrt()), robots, refused)
}

/// Of 200 robots a ratio scatters by some 2 %: its square is a mean of some six independent directions each.
#[test]
fn positions_are_at_the_bound_and_as_good_as_reported() {
    let with_radius = tolerance().with_radius(3.0).unwrap();
    for (poses, stated, most) in [
        (3, Some(with_radius), 1.10),
        (8, Some(with_radius), 1.10),
        (20, Some(with_radius), 1.05),
        (8, Some(tolerance()), 1.10),
        (12, Some(tolerance()), 1.10),
        (20, Some(tolerance()), 1.05),
        (60, Some(tolerance()), 1.05),
        (12, None, 1.10),
        (20, None, 1.05),
        (60, None, 1.05),
    ] {
        let ([error, reported], robots, refused) = campaign(poses, stated);
        let row = format!(
            "| {poses} | {} | {error:.2} | {reported:.2} | {refused} of {:.0} |",
            match stated {
                Some(stated) if stated.radius() > 0.0 => "stated, common radius 3 mm",
                Some(_) => "stated",
                None => "not stated",
            },
            robots + f64::from(refused),
        );
        println!("{row}");
        assert!(error < most && error > 0.92, "{row}");
        assert!((0.9..1.1).contains(&reported), "{row}");
        assert!(f64::from(refused) <= 0.02 * robots, "{row}");
    }
}
