//! Planned poses against random ones, on the paper's robot.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use delta_cal::{Noise, random_pose};
use delta_cal_host::evaluation::CramerRaoBound;
use delta_cal_host::poses::{Criterion, PlanRequest, plan};
use delta_cal_host::{CalibrationMethod, RobotFile};
use delta_cal_tests::{generator, paper_limits, paper_robot};

fn paper_file() -> RobotFile {
    RobotFile {
        name: "paper".to_owned(),
        robot: paper_robot(),
        limits: paper_limits(),
        forearm_limit: None,
        tolerance: None,
        noise: Some(noise()),
        sensor_frame: None,
    }
}

fn noise() -> Noise<f64> {
    Noise::new(0.001, 0.01f64.to_radians()).unwrap()
}

#[test]
fn figures() {
    let file = paper_file();
    for method in [CalibrationMethod::Ikm, CalibrationMethod::Fkm] {
        for count in [8, 12, 20, 60] {
            for criterion in [Criterion::A, Criterion::D] {
                let begin = std::time::Instant::now();
                let plan = plan(&PlanRequest {
                    count,
                    method,
                    criterion,
                    ..PlanRequest::new(&file)
                })
                .unwrap();
                println!(
                    "{method:?} {count} {criterion:?}: {:.3} random {:.3}; pos rms {:.4} max {:.4} random {:.4} {:.4}; {:.0}° of {:.0}°; {:?}",
                    plan.planned.bound,
                    plan.random.bound,
                    plan.planned.workspace.rms,
                    plan.planned.workspace.max,
                    plan.random.workspace.rms,
                    plan.random.workspace.max,
                    plan.travel.to_degrees(),
                    plan.travel_unordered.to_degrees(),
                    begin.elapsed()
                );
            }
        }
    }
    let mut rng = generator(1, 1);
    for count in [8, 12, 20, 60] {
        let mut b: Vec<_> = (0..101)
            .map(|_| {
                let joints: Vec<_> = (0..count)
                    .map(|_| {
                        random_pose(&paper_robot(), &paper_limits(), &mut rng)
                            .unwrap()
                            .joints
                    })
                    .collect();
                CramerRaoBound::new(
                    CalibrationMethod::Ikm,
                    &paper_robot(),
                    &joints,
                    &noise(),
                    None,
                )
                .map_or(f64::INFINITY, |b| b.error())
            })
            .collect();
        b.sort_by(f64::total_cmp);
        println!("random_pose {count}: {:.3}", b[50]);
    }
}
