//! Planned poses against random ones, on the paper's robot.

use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Arm;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Calibrator, Noise, Parameter, Robot, Sample, Settings, Tolerance};
use delta_cal_host::accuracy::evaluation::CramerRaoBound;
use delta_cal_host::fit::fkm;
use delta_cal_host::planning::poses::{Criterion, PlanRequest, length, plan};
use delta_cal_host::{CalibrationMethod, InstrumentFacts, Record, RobotFile};
use delta_cal_tests::documents::print_documented;
use delta_cal_tests::{
    Spread, generator, is_long, largest_difference, paper_limits, paper_robot,
    parameter_differences, perturbed,
};
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};

const METHODS: [CalibrationMethod; 2] = [CalibrationMethod::Ikm, CalibrationMethod::Fkm];
/// Position and joint noise, mm and degrees: the paper's, a tracker's, of the position alone, coarse.
const NOISES: [(f64, f64); 4] = [(0.001, 0.01), (0.02, 0.002), (0.05, 0.0), (0.1, 0.02)];
/// Poses.
const COUNTS: [usize; 4] = [8, 12, 20, 60];

fn paper_file(noise: Noise<f64>, tolerance: Option<Tolerance<f64>>) -> RobotFile {
    RobotFile {
        name: "paper".to_owned(),
        robot: paper_robot(),
        limits: paper_limits(),
        forearm_limit: None,
        tolerance,
        noise: Some(noise),
        sensor_frame: None,
        transmission: None,
        instruments: InstrumentFacts::default(),
        record: Record::default(),
    }
}

fn noise((position, joint_degrees): (f64, f64)) -> Noise<f64> {
    Noise::new(position, joint_degrees.to_radians()).unwrap()
}

fn planned(request: &PlanRequest<'_>) -> Vec<[f64; 3]> {
    let plan = plan(request).unwrap();
    plan.poses.iter().map(|pose| pose.joints).collect()
}

/// |X − B|² − Lb² of one arm.
fn constraint(parameters: &[f64; 8], x: &Vector3<f64>, q: f64) -> f64 {
    let arm = Arm::new(*parameters).unwrap();
    (x - arm.elbow(q)).norm_squared() - arm.lb().powi(2)
}

/// √tr of the inverse information by brute force: finite differences, JᵀJ, a general inverse. Per arm the
/// rows are the constraint's; together they are the forward kinematics'.
fn brute_force_bound(
    method: CalibrationMethod,
    joints: &[[f64; 3]],
    noise: &Noise<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> f64 {
    let mut information = DMatrix::<f64>::zeros(24, 24);
    for q in joints {
        let (rows, covariance) = match method {
            CalibrationMethod::Ikm => constraint_rows(q, noise),
            CalibrationMethod::Joint | CalibrationMethod::Fkm => position_rows(q, noise),
        };
        information += rows.transpose() * covariance.try_inverse().unwrap() * rows;
    }
    for index in 0..24 {
        let sigma = tolerance.map(|tolerance| tolerance.of(Parameter::ROTARY[index % 8]));
        let weight = sigma.map_or(0.0, |sigma| (sigma * unit_of(index)).powi(-2));
        information[(index, index)] += weight;
    }
    information.try_inverse().unwrap().trace().sqrt()
}

/// mm per unit of the parameter.
fn unit_of(index: usize) -> f64 {
    if matches!(index % 8, 3 | 4) {
        260.0
    } else {
        1.0
    }
}

const STEP: f64 = 1e-4;

/// ∂f/∂P of the three constraints, and their variances with what the arms share left out.
fn constraint_rows(q: &[f64; 3], noise: &Noise<f64>) -> (SMatrix<f64, 3, 24>, Matrix3<f64>) {
    let robot: Robot<f64> = paper_robot();
    let x = robot.forward(q).unwrap();
    let (mut rows, mut covariance) = (SMatrix::zeros(), Matrix3::zeros());
    for (index, arm) in robot.arms().iter().enumerate() {
        let (parameters, q) = (arm.parameters(), q[index]);
        for parameter in 0..8 {
            let unit = unit_of(parameter);
            let [up, down] = [STEP, -STEP].map(|step| {
                let mut moved = parameters;
                moved[parameter] += step / unit;
                constraint(&moved, &x, q)
            });
            rows[(index, 8 * index + parameter)] = (up - down) / (2.0 * STEP);
        }
        let by_joint =
            (constraint(&parameters, &x, q + 1e-6) - constraint(&parameters, &x, q - 1e-6)) / 2e-6;
        covariance[(index, index)] =
            (2.0 * arm.lb() * noise.position()).powi(2) + (by_joint * noise.joint()).powi(2);
    }
    (rows, covariance)
}

/// ∂X/∂P of the position, and its covariance.
fn position_rows(q: &[f64; 3], noise: &Noise<f64>) -> (SMatrix<f64, 3, 24>, Matrix3<f64>) {
    let robot: Robot<f64> = paper_robot();
    let mut rows = SMatrix::<f64, 3, 24>::zeros();
    for index in 0..24 {
        let [up, down] = [STEP, -STEP].map(|step| {
            let mut arms = robot.arms().map(|arm| arm.parameters());
            arms[index / 8][index % 8] += step / unit_of(index);
            Robot::new(arms.map(|arm| Arm::new(arm).unwrap()))
                .unwrap()
                .forward(q)
                .unwrap()
        });
        rows.set_column(index, &((up - down) / (2.0 * STEP)));
    }
    let by_joints = Matrix3::from_columns(&[0, 1, 2].map(|joint| {
        let [up, down] = [1e-6, -1e-6].map(|step| {
            let mut moved = *q;
            moved[joint] += step;
            robot.forward(&moved).unwrap()
        });
        (up - down) / 2e-6
    }));
    let covariance = Matrix3::identity() * noise.position().powi(2)
        + by_joints * by_joints.transpose() * noise.joint().powi(2);
    (rows, covariance)
}

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

/// Whatever the noise is made of, for both methods and with several seeds. A document shows some of it.
#[test]
fn twelve_planned_poses_are_as_good_as_sixty_random_and_twenty_three_times_better_than_twenty() {
    // The document's, and the noise and method that are least like it.
    let short = [(METHODS[0], NOISES[1]), (METHODS[1], NOISES[3])];
    for method in METHODS {
        for level in NOISES {
            if !is_long() && !short.contains(&(method, level)) {
                continue;
            }
            let noise = noise(level);
            let file = paper_file(noise, None);
            println!(
                "{method:?} method, {} mm, {}°: bound on the parameter error, mm",
                level.0, level.1
            );
            println!("| poses | random, median of 201 sets | planned |");
            let figures = COUNTS.map(|count| {
                let random = median_of_random(method, count, &noise, None);
                let planned = [1, 2, 3].map(|seed| {
                    let joints = planned(&PlanRequest {
                        count,
                        method,
                        seed,
                        ..PlanRequest::new(&file)
                    });
                    bound(method, &joints, &noise, None)
                });
                let row = format!("| {count} | {random:.3} | {:.3} |", planned[0]);
                if method == CalibrationMethod::Ikm && level == NOISES[1] {
                    print_documented("docs/planning.md", &row);
                } else {
                    println!("{row}");
                }
                (random, planned)
            });
            let [_, (_, planned_12), (random_20, planned_20), (random_60, _)] = figures;
            for (planned_12, planned_20) in planned_12.into_iter().zip(planned_20) {
                assert!(planned_12 <= random_60, "{method:?}, {level:?}");
                assert!(3.0 * planned_20 <= random_20, "{method:?}, {level:?}");
            }
        }
    }
}

/// What is planned with a tolerance is judged with it. The tolerance is worth many random poses
/// itself, so that it is the first of the two that holds.
#[test]
fn with_a_tolerance_twelve_planned_poses_are_as_good_as_sixty_random() {
    let tolerance = Tolerance::new(0.5, 0.2f64.to_radians()).unwrap();
    for level in &NOISES[..3] {
        let noise = noise(*level);
        let file = paper_file(noise, Some(tolerance));
        let joints = planned(&PlanRequest {
            count: 12,
            ..PlanRequest::new(&file)
        });
        let method = CalibrationMethod::Ikm;
        let random = median_of_random(method, 60, &noise, Some(&tolerance));
        assert!(bound(method, &joints, &noise, Some(&tolerance)) <= random);
    }
}

/// The figure that is minimised is the bound that finite differences and a general inverse give.
#[test]
fn the_expected_parameter_error_is_that_of_brute_force() {
    let noise = noise((0.02, 0.002));
    let tolerance = Tolerance::new(0.5, 0.2f64.to_radians()).unwrap();
    for method in [CalibrationMethod::Ikm, CalibrationMethod::Joint] {
        for (count, tolerance) in [(8, None), (12, Some(tolerance)), (20, None)] {
            let file = paper_file(noise, tolerance);
            let plan = plan(&PlanRequest {
                count,
                method,
                ..PlanRequest::new(&file)
            })
            .unwrap();
            let joints: Vec<_> = plan.poses.iter().map(|pose| pose.joints).collect();
            let expected = brute_force_bound(method, &joints, &noise, tolerance.as_ref());
            // The steps of the differences leave a relative error of some 1e-8.
            let off = (plan.planned.bound / expected - 1.0).abs();
            assert!(off < 1e-6, "{method:?}, {count} poses: {off:e}");
        }
    }
}

/// D-optimal poses have the smaller determinant, A-optimal ones the smaller trace.
#[test]
fn each_criterion_is_best_by_its_own_measure() {
    let noise = noise((0.02, 0.002));
    let file = paper_file(noise, None);
    for method in METHODS {
        let [a, d] = [Criterion::A, Criterion::D].map(|criterion| {
            let joints = planned(&PlanRequest {
                count: 15,
                method,
                criterion,
                ..PlanRequest::new(&file)
            });
            let bound = CramerRaoBound::new(method, &paper_robot(), &joints, &noise, None).unwrap();
            (bound.error(), bound.covariance.determinant())
        });
        assert!(a.0 < d.0, "{method:?}: {} {}", a.0, d.0);
        assert!(d.1 < a.1, "{method:?}: {:e} {:e}", a.1, d.1);
    }
}

#[test]
fn eight_planned_poses_return_500_of_500_exact_robots_from_1_cm_by_both_methods() {
    for (level, criterion, seed) in [
        (NOISES[0], Criterion::A, 1),
        (NOISES[1], Criterion::A, 2),
        (NOISES[1], Criterion::D, 3),
    ] {
        let file = paper_file(noise(level), None);
        let joints = planned(&PlanRequest {
            count: 8,
            criterion,
            seed,
            ..PlanRequest::new(&file)
        });
        let nominal = paper_robot();
        let mut worst = 0.0;
        for robot in 0..500 {
            let mut rng = generator(72, robot);
            let angle = 1f64.to_radians();
            let truth: Robot<f64> = perturbed(&nominal, 10.0, angle, Spread::Uniform, &mut rng);
            let samples: Vec<Sample<f64>> = joints
                .iter()
                .map(|q| simulate_sample(&truth, q, None, &mut rng).unwrap())
                .collect();
            let settings = Settings::default();
            let mut calibrator = Calibrator::new(&nominal, &settings);
            calibrator.add_many(&samples).unwrap();
            let ikm = calibrator.solve().unwrap().robot;
            let fkm = fkm::calibrate(&nominal, &samples, &settings).unwrap();
            for (method, found) in [("ikm", ikm), ("fkm", fkm.fit.robot)] {
                let error = largest_difference(&found, &truth);
                assert!(error < 1e-6, "{method}, robot {robot}: {error:e} mm");
                worst = f64::max(worst, error);
            }
        }
        println!(
            "8 poses, criterion {}, {} mm, {}°: 500 of 500 robots by both methods, worst {worst:.1e} mm",
            criterion.name(),
            level.0,
            level.1
        );
    }
}

/// The σ that a plan states is the scatter of calibrations from its poses.
#[test]
fn the_stated_sigmas_are_the_scatter_of_simulated_calibrations() {
    const ROBOTS: u32 = 600;
    let noise = noise((0.02, 0.002));
    let tolerance = Tolerance::new(0.1, 0.05f64.to_radians()).unwrap();
    let file = paper_file(noise, Some(tolerance));
    let plan = plan(&PlanRequest {
        count: 12,
        ..PlanRequest::new(&file)
    })
    .unwrap();
    let nominal = paper_robot();
    let settings = Settings::default()
        .with_noise(noise)
        .with_tolerance(tolerance);
    let mut squares = [0.0; 24];
    let mut position = 0.0;
    let mut places = 0.0;
    for robot in 0..u64::from(ROBOTS) {
        let mut rng = generator(73, robot);
        // As the tolerance says: every parameter normally, one σ.
        let truth = perturbed(
            &nominal,
            0.1,
            0.05f64.to_radians(),
            Spread::Normal,
            &mut rng,
        );
        let mut calibrator = Calibrator::new(&nominal, &settings);
        for pose in &plan.poses {
            let sample = simulate_sample(&truth, &pose.joints, Some(&noise), &mut rng).unwrap();
            calibrator.add(&sample).unwrap();
        }
        let found = calibrator.solve().unwrap().robot;
        for (sum, difference) in squares
            .iter_mut()
            .zip(parameter_differences(&found, &truth))
        {
            *sum += difference * difference;
        }
        for _ in 0..20 {
            let pose = random_pose(&truth, &paper_limits(), &mut rng).unwrap();
            let error = found.forward(&pose.joints).unwrap() - pose.position;
            position += error.norm_squared();
            places += 1.0;
        }
    }
    let mut ratios = Vec::new();
    for (index, sum) in squares.iter().enumerate() {
        let unit = if index % 8 == 3 || index % 8 == 4 {
            260.0
        } else {
            1.0
        };
        let stated = unit * plan.planned.parameters[index / 8][index % 8];
        ratios.push((sum / f64::from(ROBOTS)).sqrt() / stated);
    }
    // A standard deviation from 600 robots is known to 1/√1200 = 3 %; 24 of them within five times
    // that.
    for (index, ratio) in ratios.iter().enumerate() {
        assert!((ratio - 1.0).abs() < 0.15, "parameter {index}: {ratio}");
    }
    let mean = ratios.iter().sum::<f64>() / 24.0;
    assert!((mean - 1.0).abs() < 0.04, "{mean}");
    // Random poses and the plan's grid weigh the workspace alike.
    let ratio = f64::sqrt(position / places) / plan.planned.workspace.rms;
    println!("parameters: scatter / stated σ, mean {mean:.3}; positions {ratio:.3}");
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

/// Poses within the robot's limits, whatever they are, and a way no longer than it was found.
#[test]
fn poses_keep_to_the_limits_and_the_way_is_short() {
    for (low, high) in [(-60.0, 90.0), (-20.0, 45.0), (-40.0, 10.0)] {
        let limits = JointLimits::new(f64::to_radians(low), f64::to_radians(high)).unwrap();
        let file = RobotFile {
            limits,
            ..paper_file(noise(NOISES[1]), None)
        };
        let plan = plan(&PlanRequest {
            count: 30,
            ..PlanRequest::new(&file)
        })
        .unwrap();
        for pose in &plan.poses {
            let within = |q: &f64| (low + 1.0..=high - 1.0).contains(&q.to_degrees());
            assert!(pose.joints.iter().all(within));
            let x = paper_robot().forward(&pose.joints).unwrap();
            assert!(
                paper_robot()
                    .singularity_distance(&x, &pose.joints)
                    .is_clear()
            );
        }
        assert!(plan.travel <= plan.travel_unordered);
        assert!((length(&plan.poses) - plan.travel).abs() < 1e-12);
    }
}
