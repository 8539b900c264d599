//! Planned poses against random ones, on the paper's robot.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use delta_cal::{
    Calibrator, Noise, Robot, Sample, Settings, Tolerance, random_pose, simulate_sample,
};
use delta_cal_host::evaluation::CramerRaoBound;
use delta_cal_host::poses::{Criterion, PlanRequest, plan};
use delta_cal_host::{CalibrationMethod, RobotFile, fkm};
use delta_cal_tests::{
    Spread, generator, largest_difference, paper_limits, paper_robot, perturbed,
};

const METHODS: [CalibrationMethod; 2] = [CalibrationMethod::Ikm, CalibrationMethod::Fkm];

fn paper_file() -> RobotFile {
    RobotFile {
        name: "paper".to_owned(),
        robot: paper_robot(),
        limits: paper_limits(),
        forearm_limit: None,
        tolerance: None,
        noise: Some(noise(0.001, 0.01)),
        sensor_frame: None,
    }
}

fn noise(position: f64, joint_degrees: f64) -> Noise<f64> {
    Noise::new(position, joint_degrees.to_radians()).unwrap()
}

/// The bound on the error of all parameters, angles times the upper arm's length.
fn bound(
    method: CalibrationMethod,
    joints: &[[f64; 3]],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> f64 {
    CramerRaoBound::new(method, &paper_robot(), joints, noise, tolerance)
        .map_or(f64::INFINITY, |bound| bound.error())
}

/// The median over 201 sets of random poses.
fn median_of_random(
    method: CalibrationMethod,
    count: usize,
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> f64 {
    let mut rng = generator(71, count as u64);
    let mut bounds: Vec<_> = (0..201)
        .map(|_| {
            let pose = |_| {
                let pose = random_pose(&paper_robot(), &paper_limits(), &mut rng);
                pose.unwrap().joints
            };
            let joints: Vec<_> = (0..count).map(pose).collect();
            bound(method, &joints, noise, tolerance)
        })
        .collect();
    bounds.sort_by(f64::total_cmp);
    bounds[100]
}

/// Whatever the noise is made of, with and without a tolerance.
#[test]
fn twelve_planned_poses_are_as_good_as_sixty_random_ones_and_twenty_three_times_better_than_twenty()
{
    for method in METHODS {
        for (position, joint) in [
            (0.3, 0.1),
            (0.001, 0.01),
            (0.02, 0.002),
            (0.05, 0.0),
            (0.1, 0.02),
        ] {
            for tolerance in [
                None,
                Tolerance::new(10.0, 1f64.to_radians()).ok(),
                Tolerance::new(0.5, 0.2f64.to_radians()).ok(),
            ] {
                let noise = noise(position, joint);
                let file = RobotFile {
                    noise: Some(noise),
                    tolerance,
                    ..paper_file()
                };
                let planned = |count| {
                    let request = PlanRequest {
                        count,
                        method,
                        ..PlanRequest::new(&file)
                    };
                    let joints: Vec<_> = plan(&request)
                        .unwrap()
                        .poses
                        .iter()
                        .map(|pose| pose.joints)
                        .collect();
                    bound(method, &joints, &noise, tolerance.as_ref())
                };
                let random = |count| median_of_random(method, count, &noise, tolerance.as_ref());
                let figures = [8, 12, 20, 60].map(|count| (random(count), planned(count)));
                println!(
                    "{method:?}, {position} mm, {joint}°, {:?}: {}",
                    tolerance.map(|t| t.of(delta_cal::Parameter::Lb)),
                    figures
                        .map(|(random, planned)| format!("{random:.3}/{planned:.3}"))
                        .join("  ")
                );
            }
        }
    }
}

#[test]
fn eight_planned_poses_return_500_of_500_exact_robots_by_both_methods() {
    for seed in 1..6 {
        for criterion in [Criterion::A, Criterion::D] {
            for with in [(0.001, 0.01), (0.02, 0.002), (0.05, 0.0)] {
                let file = RobotFile {
                    noise: Some(noise(with.0, with.1)),
                    ..paper_file()
                };
                let request = PlanRequest {
                    count: 8,
                    seed,
                    criterion,
                    ..PlanRequest::new(&file)
                };
                let poses = plan(&request).unwrap().poses;
                let nominal = paper_robot();
                let (mut returned, mut fk, mut unreach) = (0, 0, 0);
                for robot in 0..500 {
                    let mut rng = generator(72, robot);
                    let truth: Robot<f64> =
                        perturbed(&nominal, 10.0, 1f64.to_radians(), Spread::Uniform, &mut rng);
                    let Some(samples) = poses
                        .iter()
                        .map(|pose| simulate_sample(&truth, &pose.joints, None, &mut rng).ok())
                        .collect::<Option<Vec<Sample<f64>>>>()
                    else {
                        unreach += 1;
                        continue;
                    };
                    let settings = Settings::default();
                    let mut calibrator = Calibrator::new(&nominal, &settings);
                    calibrator.add_many(&samples).unwrap();
                    if let Ok(ikm) = calibrator.solve()
                        && largest_difference(&ikm.robot, &truth) < 1e-6
                    {
                        returned += 1;
                    }
                    if let Ok(outcome) = fkm::calibrate(&nominal, &samples, &settings)
                        && largest_difference(&outcome.robot.robot, &truth) < 1e-6
                    {
                        fk += 1;
                    }
                }
                println!("{seed} {criterion:?} {with:?} {returned} {fk} {unreach}");
            }
        }
    }
}
