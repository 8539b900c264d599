//! A tolerance that is not the robot's.

use crate::accuracy::robots::{Poses, geometries, made, robot_file, samples_file, tracker};
use delta_cal::frame::RigidTransform;
use delta_cal_host::{CalibrationMethod, CalibrationReport, Frame, Options, calibrate};
use delta_cal_tests::generator;

fn calibrated(
    factor: f64,
    count: usize,
    method: CalibrationMethod,
    number: u64,
) -> Result<CalibrationReport, String> {
    calibrated_in(Frame::Base, factor, count, method, number)
}

fn calibrated_in(
    frame: Frame,
    factor: f64,
    count: usize,
    method: CalibrationMethod,
    number: u64,
) -> Result<CalibrationReport, String> {
    let (_, nominal) = geometries()[0];
    let mut rng = generator(133, number);
    let robot = made(&nominal, factor, Poses::Spread(count), &mut rng);
    let file = robot_file(&nominal, (true, true));
    let at = match frame {
        Frame::Base => RigidTransform::identity(),
        Frame::Sensor => tracker(),
    };
    let samples = samples_file(&robot.samples, &at);
    let options = Options {
        method,
        frame,
        ..Options::default()
    };
    calibrate(&file, &samples, options).map_err(|error| error.to_string())
}

/// ν = 12 combinations and more at four samples: χ² of four times the variance passes the limit of
/// 3 σ in 87 % of robots, if all combinations count fully; some count half.
#[test]
fn errors_of_twice_the_tolerance_are_noticed_at_few_samples() {
    for method in [CalibrationMethod::Ikm, CalibrationMethod::Joint] {
        let refused = |factor: f64, count: usize| {
            (0..40)
                .filter(|number| match calibrated(factor, count, method, *number) {
                    Ok(_) => false,
                    Err(cause) => {
                        assert!(
                            cause.contains("as the stated [tolerance] allows"),
                            "{cause}"
                        );
                        true
                    }
                })
                .count()
        };
        // As stated: 0.27 % each.
        assert!(refused(1.0, 4) <= 1);
        assert!(refused(2.0, 4) >= 24);
    }
}

#[test]
fn with_many_samples_a_wrong_tolerance_is_widened_and_named() {
    for number in 0..10 {
        for factor in [2.0, 4.0] {
            let report = calibrated(factor, 40, CalibrationMethod::Joint, number).unwrap();
            assert!(report.tolerance_widened);
            let test = report.prior_test.unwrap();
            // χ² with 24 degrees of freedom: 5 σ are 0.72 of the ratio.
            assert!((test.ratio / factor - 1.0).abs() < 0.75, "{test:?}");
            let warned = report
                .warnings
                .iter()
                .any(|text| text.contains("[tolerance]"));
            assert!(warned, "{:?}", report.warnings);
        }
        let report = calibrated(1.0, 40, CalibrationMethod::Joint, number).unwrap();
        assert!(!report.tolerance_widened);
    }
}

/// Robots as the tolerance says. In the sensor's frame six of the 24 combinations move the robot as a whole, and no sample
/// tells them: χ² has 18 degrees of freedom, and the mean of 40 squared ratios a standard deviation of √(2/18/40).
#[test]
fn the_place_of_the_robot_is_no_parameter_in_the_sensors_frame() {
    for (frame, all) in [(Frame::Base, 24), (Frame::Sensor, 18)] {
        let mut squares = 0.0;
        for number in 0..40 {
            let report = calibrated_in(frame, 1.0, 30, CalibrationMethod::Joint, number).unwrap();
            let test = report.prior_test.unwrap();
            assert_eq!(test.of, all);
            squares += test.ratio.powi(2) / 40.0;
        }
        let limit = 4.0 * f64::sqrt(2.0 / f64::from(all) / 40.0);
        println!("{frame:?}: {squares}");
        assert!((squares - 1.0).abs() < limit, "{frame:?}: {squares}");
    }
}
