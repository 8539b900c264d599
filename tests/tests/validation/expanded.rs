//! Whether the expanded uncertainty that a calibration states holds the true error.

use super::robots::{error_anywhere, made_anywhere, robot_file, samples_file};
use delta_cal::Robot;
use delta_cal_host::{Frame, Options, RobotFile, calibrate};
use delta_cal_tests::generator;
use delta_cal_tests::geometries::geometries;

/// Rows of each file; without a stated noise 36 − 24 = 12 and 96 degrees of freedom.
const ROWS: [usize; 2] = [12, 40];

/// The share of calibrated robots whose rms error over the workspace is below the expanded uncertainty, percent.
fn covered(rows: usize, stated: bool, files: u64) -> f64 {
    let geometries = geometries();
    let (mut robots, mut within) = (0.0, 0.0);
    for number in 0..files {
        let index = usize::try_from(number).unwrap() % geometries.len();
        let (_, nominal): &(_, Robot<f64>) = &geometries[index];
        let mut rng = generator(172, number);
        let mut robot = made_anywhere(nominal, rows, &mut rng);
        let file = RobotFile {
            noise: robot_file(nominal).noise.filter(|_| stated),
            ..robot_file(nominal)
        };
        let samples = samples_file(&robot, Frame::Base);
        let Ok(found) = calibrate(&file, &samples, &Options::default()) else {
            continue;
        };
        let Some(expanded) = found.expanded_uncertainty else {
            continue;
        };
        robot.nominal = found.after.robot;
        robots += 1.0;
        within += f64::from(u8::from(
            error_anywhere(&robot, &mut rng) <= expanded.rms_mm,
        ));
    }
    100.0 * within / robots
}

/// The rms over the workspace sums up several combinations of parameters, so that it scatters less than one number
/// would, and the expanded uncertainty holds it more often than in 95 % of the robots.
#[test]
fn the_expanded_uncertainty_holds_at_least_95_percent_of_the_robots() {
    for stated in [true, false] {
        for rows in ROWS {
            let within = covered(rows, stated, 64);
            let noise = if stated { "stated" } else { "estimated" };
            println!("noise {noise}, {rows} rows: {within:.1} %");
            assert!(within >= 95.0, "{noise} {rows}: {within}");
        }
    }
}
