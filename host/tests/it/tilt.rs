//! Robots whose platform tilts because the two rods of an arm differ, with reflectors beside the platform's centre.

use crate::support::simulated::{SIGMAS, rotary};
use delta_cal::Robot;
use delta_cal::simulate::{made_robot, random_pose, standard_normal};
use delta_cal_host::files::robot_file::Target;
use delta_cal_host::geometry::Parallelograms;
use delta_cal_host::{Options, Reading, Readings, RobotFile, Row, calibrate};
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// σ of the rods' and the spacings' differences, mm, and of the elbows' axes, degrees.
const RODS: [f64; 2] = [0.1, 0.1];

/// Six rods between points that are written as a drawing has them, and nothing shorter: position and rotation vector of the
/// platform by Newton's method with numerical derivatives.
fn platform(robot: &Robot<f64>, rods: &Parallelograms, joints: &[f64; 3]) -> [Vector3<f64>; 2] {
    let radial = [0, 1, 2].map(|arm| {
        let azimuth = robot.arms()[arm].parameters()[3];
        Vector3::new(azimuth.cos(), azimuth.sin(), 0.0)
    });
    let off = |at: &DVector<f64>| {
        let turn = Rotation3::new(Vector3::new(at[3], at[4], at[5]));
        DVector::from_fn(6, |row, _| {
            let (arm, side) = (row / 2, [0.5, -0.5][row % 2]);
            let [longer, wider, yaw, roll] = rods.numbers[arm];
            let (r, z) = (radial[arm], Vector3::z());
            let (t, p) = (z.cross(&r), r * rods.platform_radius);
            let own = &robot.arms()[arm];
            let elbow = own.elbow(joints[arm]) + p + (t + yaw * r + roll * z) * side * rods.spacing;
            let end =
                Vector3::new(at[0], at[1], at[2]) + turn * (p + t * side * (rods.spacing + wider));
            (end - elbow).norm() - own.lb() - side * longer
        })
    };
    let mut at = DVector::zeros(6);
    at.rows_mut(0, 3).copy_from(&robot.forward(joints).unwrap());
    for _ in 0..8 {
        let here = off(&at);
        let steps = DMatrix::from_fn(6, 6, |row, column| {
            let step = if column < 3 { 1e-4 } else { 1e-6 };
            let mut moved = at.clone();
            moved[column] += step;
            let ahead = off(&moved)[row];
            moved[column] -= 2.0 * step;
            (ahead - off(&moved)[row]) / (2.0 * step)
        });
        at -= steps.lu().solve(&here).unwrap();
    }
    assert!(off(&at).amax() < 1e-9, "{at}");
    [0, 3].map(|first| Vector3::new(at[first], at[first + 1], at[first + 2]))
}

/// Where a point of the platform is.
fn at(pose: [Vector3<f64>; 2], point: &Vector3<f64>) -> Vector3<f64> {
    pose[0] + Rotation3::new(pose[1]) * point
}

struct Made {
    file: RobotFile,
    truth: Robot<f64>,
    rods: Parallelograms,
    readings: Readings,
}

/// A robot of a geometry with rods that differ, measured with these targets at poses in turn.
fn made(file: &RobotFile, targets: &[Vector3<f64>], rows: usize, seed: u64) -> Made {
    let mut rng = Pcg32::seed_from_u64(seed);
    let tolerance = file.tolerance.unwrap();
    let tolerance = tolerance.with_joint_zero(0.2_f64.to_radians()).unwrap();
    let truth = made_robot(&file.robot, &tolerance, &mut rng).unwrap();
    let size = file.robot.arms()[0].lb() / 480.0;
    let mut file = file.clone();
    let mut down = [0.35, 0.7, 1.0, 0.0, -0.4].into_iter();
    let middle = down
        .find_map(|q| file.robot.forward(&[q; 3]).ok())
        .unwrap()
        .z;
    let [radius, low, high] = [0.45, -0.2, 0.2].map(|own| own * file.robot.arms()[0].lb());
    let within = format!("r={radius},z={}..{}", middle + low, middle + high);
    file.within = Some(within.parse().unwrap());
    file.tolerance = Some(tolerance);
    file.platform_radius = Some(30.0 * size);
    let [length, angle] = [RODS[0], RODS[1].to_radians()];
    let stated = Parallelograms {
        spacing: 60.0 * size,
        platform_radius: 30.0 * size,
        numbers: [[0.0; 4]; 3],
        tolerance: [length, angle],
    };
    file.parallelograms = Some(stated);
    let numbers = [0, 1, 2].map(|_| {
        [length, length, angle, angle].map(|own| own * standard_normal::<f64, _>(&mut rng))
    });
    let rods = Parallelograms { numbers, ..stated };
    let mut readings = Readings::of_name("samples.csv");
    for (index, place) in targets.iter().enumerate() {
        let name = if targets.len() == 1 {
            "target".to_owned()
        } else {
            format!("T{index}")
        };
        readings.targets.push(name.clone());
        file.instruments.targets.push(Target {
            name,
            place: *place,
            sigma: Vector3::repeat(1e-3),
        });
    }
    let [position, joint, ..] = SIGMAS;
    for index in 0..rows {
        let joints = worked(&file, &truth, &mut rng);
        for (target, place) in targets.iter().enumerate() {
            let seen = at(platform(&truth, &rods, &joints), place);
            let mut normal = |sigma: f64| sigma * standard_normal::<f64, _>(&mut rng);
            readings.rows.push(Row {
                line: (index * targets.len() + target) as u64 + 2,
                value: Reading {
                    position: [0, 1, 2].map(|axis| Some(seen[axis] + normal(position))),
                    target,
                    ..Reading::at(joints.map(|q| q + normal(joint.to_radians())))
                },
            });
        }
    }
    Made {
        file,
        truth,
        rods,
        readings,
    }
}

/// A pose where the robot works.
fn worked(file: &RobotFile, truth: &Robot<f64>, rng: &mut Pcg32) -> [f64; 3] {
    loop {
        let pose = random_pose(truth, &file.limits, rng).unwrap();
        let clear = [&file.robot, truth].map(|own| file.reach().clear_position(own, &pose.joints));
        if clear.iter().all(Result::is_ok) && file.within.unwrap().contains(&pose.position) {
            return pose.joints;
        }
    }
}

#[test]
fn tools_are_where_they_are_stated_to_be_although_the_platform_tilts() {
    let robots: u64 = std::env::var("DELTA_CAL_TILT").map_or(12, |own| own.parse().unwrap());
    let geometries = rotary(true);
    let three = [[60.0, 0.0, 0.0], [-30.0, 52.0, 0.0], [-30.0, -52.0, -20.0]].map(Vector3::from);
    let tools = [[0.0, 0.0, 0.0], [0.0, 0.0, -100.0], [80.0, 0.0, -40.0]].map(Vector3::from);
    for (targets, poses) in [(&three[..1], 30), (&three[..], 10)] {
        for known in (if std::env::var("DELTA_CAL_KNOWN").is_ok() {
            vec![true]
        } else {
            vec![false, true]
        }) {
            let mut found = [[0.0; 2]; 3];
            let mut refused = 0;
            for robot in 0..robots {
                let file = &geometries[if std::env::var("DELTA_CAL_GEOMETRY").is_ok() {
                    robot as usize % geometries.len()
                } else {
                    0
                }];
                let size = file.robot.arms()[0].lb() / 480.0;
                let targets: Vec<_> = targets.iter().map(|own| own * size).collect();
                let mut own = made(file, &targets, poses, 40 + robot);
                if !known {
                    own.file.parallelograms = None;
                }
                for (tool, found) in tools.iter().zip(&mut found) {
                    let tool = tool * size;
                    own.file.tool = Some(tool);
                    let report = match calibrate(&own.file, &own.readings, &Options::default()) {
                        Ok(report) => report,
                        Err(why) => {
                            refused += 1;
                            if robot < 3 {
                                println!("{robot} {why}");
                            }
                            continue;
                        }
                    };
                    let after = &report.after;
                    let mut rng = Pcg32::seed_from_u64(robot);
                    let judged = (0..200).map(|_| worked(&own.file, &own.truth, &mut rng));
                    let judged: Vec<_> = judged.collect();
                    let errors = judged.iter().filter_map(|q| {
                        after.reach().clear_position(&after.robot, q).ok()?;
                        let pose = platform(&own.truth, &own.rods, q);
                        let there = delta_cal_host::files::robot_file::Tool {
                            place: tool,
                            parallelograms: after.parallelograms,
                        };
                        Some((there.position(&after.robot, q)? - at(pose, &tool)).norm_squared())
                    });
                    let errors: Vec<_> = errors.collect();
                    found[0] += errors.iter().sum::<f64>() / errors.len() as f64;
                    found[1] += report.expected_error.unwrap().absolute_rms_mm.powi(2);
                }
            }
            let count = robots as f64 - refused as f64 / 3.0;
            let rms = found.map(|own| own.map(|own| (own / count).sqrt()));
            println!(
                "{} targets, {poses} poses, known {known}: refused {refused}",
                targets.len()
            );
            for ([achieved, stated], tool) in rms.iter().zip(&tools) {
                println!(
                    "  {:?}: {achieved:.3} ({stated:.3}) {:.2}",
                    tool.data.0[0],
                    achieved / stated
                );
            }
        }
    }
}
