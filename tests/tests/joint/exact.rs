//! Measurements without errors: what is returned is the robot.

use crate::joint::joint;
use delta_cal::calibration::Start;
use delta_cal::{Robot, Settings};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::{Spread, generator, largest_difference, measurements, perturbed};

/// The first forearm over that of the paper's robot: by so much start errors and tolerances are scaled.
fn scale(nominal: &Robot<f64>) -> f64 {
    nominal.arms()[0].lb() / 480.0
}

/// Robots that are returned to 1e-6 mm of the paper's scale, from up to 1 cm and 1° of it.
fn returned(poses: usize, start: Start, robots: u64) -> (u64, u64) {
    let (mut found, mut of) = (0, 0);
    let settings = Settings::default().with_start(start);
    for (index, (name, nominal)) in (0..).zip(geometries()) {
        let mut of_these = 0;
        for robot in 0..robots {
            let mut rng = generator(1300 + index, robot);
            let (length, angle) = (10.0 * scale(&nominal), 1f64.to_radians());
            let truth = perturbed(&nominal, length, angle, Spread::Uniform, &mut rng);
            let samples = measurements(&truth, poses, None, &mut rng);
            let outcome = joint(&nominal, &samples, &settings);
            let error = outcome.map_or(f64::INFINITY, |outcome| {
                largest_difference(&outcome.robot, &truth)
            });
            let found = error < 1e-6 * scale(&nominal);
            of_these += u64::from(found);
            if !found {
                let mut apart = delta_cal::Calibrator::new(&nominal, &settings);
                apart.add_many(&samples).unwrap();
                println!(
                    "  robot {robot}: off by {error:e} mm, {:?}; arms apart {:?}",
                    outcome.map(|outcome| (outcome.estimate.conditions, outcome.estimate.start)),
                    apart
                        .solve()
                        .map(|outcome| largest_difference(&outcome.robot, &truth)),
                );
            }
        }
        println!("{name}, {poses} poses, {start:?}: {of_these} of {robots}");
        found += of_these;
        of += robots;
    }
    (found, of)
}

/// Nine equations in eight unknowns an arm have one solution.
#[test]
fn nine_poses_and_more_give_every_robot_back() {
    for poses in [9, 12, 20, 60] {
        let (found, of) = returned(poses, Start::Nominal, 10);
        assert_eq!(found, of, "{poses}");
    }
}

/// Eight equations in eight unknowns an arm may have several solutions, of which the nearest is taken; of
/// three arms it is the right one as often as of the arms by themselves, in nine of ten robots.
#[test]
fn eight_poses_give_most_robots_back() {
    let (found, of) = returned(8, Start::Nominal, 10);
    assert!(10 * found >= 9 * of, "{found} of {of}");
}

#[test]
fn no_guess_is_needed_from_twelve_poses_on() {
    for poses in [12, 20] {
        let (found, of) = returned(poses, Start::Free, 10);
        assert_eq!(found, of, "{poses}");
    }
}
