//! Robots whose platform tilts because the two rods of an arm differ, with reflectors beside the platform's centre.

use crate::support::simulated::{SIGMAS, rotary};
use crate::support::{Folder, NOISE, NOMINAL, csv, noisy, true_arms};
use delta_cal::Robot;
use delta_cal::robot::Drive;
use delta_cal::simulate::{made_robot, random_pose, standard_normal};
use delta_cal_host::files::robot_file::Target;
use delta_cal_host::geometry::Parallelograms;
use delta_cal_host::planning::{Kind, Wishes};
use delta_cal_host::{Options, PlanRequest, Reading, Readings, RobotFile, Row, calibrate, plan};
use delta_cal_tests::size as of_size;
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// σ of the rods' and the spacings' differences, mm, and of the elbows' axes, degrees.
const RODS: [f64; 2] = [0.1, 0.1];

/// Three targets and three tools, mm, for forearms of 480 mm.
const TARGETS: [[f64; 3]; 3] = [[60.0, 0.0, 0.0], [-30.0, 52.0, 0.0], [-30.0, -52.0, -20.0]];
const TOOLS: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [0.0, 0.0, -100.0], [80.0, 0.0, -40.0]];

/// Six rods between points that are written as a drawing has them, and nothing shorter: position and rotation vector of the
/// platform by Newton's method with numerical derivatives.
pub(crate) fn platform(
    robot: &Robot<f64>,
    rods: &Parallelograms,
    joints: &[f64; 3],
) -> [Vector3<f64>; 2] {
    let radial = [0, 1, 2].map(|arm| {
        let own = &robot.arms()[arm];
        let azimuth = match own.drive() {
            Drive::Rotary => own.parameters()[3],
            Drive::Linear => own.d().y.atan2(own.d().x),
        };
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
pub(crate) fn at(pose: [Vector3<f64>; 2], point: &Vector3<f64>) -> Vector3<f64> {
    pose[0] + Rotation3::new(pose[1]) * point
}

struct Made {
    file: RobotFile,
    truth: Robot<f64>,
    rods: Parallelograms,
    readings: Readings,
}

/// A robot of a geometry with rods that differ, measured with these targets at poses in turn.
fn made(
    file: &RobotFile,
    (spacing, angle): (f64, f64),
    targets: &[Vector3<f64>],
    rows: usize,
    seed: u64,
) -> Made {
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
    let length = RODS[0];
    let stated = Parallelograms {
        spacing,
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
    let mut own = Made {
        file,
        truth,
        rods,
        readings,
    };
    for _ in 0..rows {
        let joints = worked(&own.file, &own.truth, &mut rng);
        for target in 0..targets.len() {
            own.measure(joints, target, &mut rng);
        }
    }
    own
}

impl Made {
    /// A row of this target.
    fn measure(&mut self, joints: [f64; 3], target: usize, rng: &mut Pcg32) {
        let place = self.file.instruments.targets[target].place;
        let seen = at(platform(&self.truth, &self.rods, &joints), &place);
        let [position, joint, ..] = SIGMAS;
        let mut normal = |sigma: f64| sigma * standard_normal::<f64, _>(rng);
        self.readings.rows.push(Row {
            line: self.readings.rows.len() as u64 + 2,
            value: Reading {
                position: [0, 1, 2].map(|axis| Some(seen[axis] + normal(position))),
                target,
                ..Reading::at(joints.map(|q| q + normal(joint.to_radians())))
            },
        });
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

/// How far off a tool is and is stated to be, rms, mm, of robots of eight geometries, and tools in turn; and the first in parts
/// of the second together with what rods of which nothing is known add to that.
fn tools(targets: usize, poses: usize, known: bool) -> [f64; 3] {
    let robots: u8 = of_size(24, 96);
    let geometries = rotary(true);
    let (mut sums, mut calibrated) = ([0.0; 3], 0.0);
    for robot in 0..robots {
        let seed = u64::from(robot);
        let robot = usize::from(robot);
        let file = &geometries[robot % geometries.len()];
        let size = file.robot.arms()[0].lb() / 480.0;
        let tool = Vector3::from(TOOLS[robot % TOOLS.len()]) * size;
        let targets = TARGETS[..targets].iter();
        let targets: Vec<_> = targets.map(|own| Vector3::from(*own) * size).collect();
        let rods = if known {
            (60.0 * size, RODS[1].to_radians())
        } else {
            (50.0, 0.0)
        };
        let mut own = made(file, rods, &targets, poses, 40 + seed);
        own.file.tool = Some(tool);
        own.file.parallelograms = own.file.parallelograms.filter(|_| known);
        // Model 24 does not fit all robots that tilt.
        let report = match calibrate(&own.file, &own.readings, &Options::default()) {
            Err(_) if own.file.parallelograms.is_none() => continue,
            report => report.unwrap(),
        };
        calibrated += 1.0;
        let mut rng = Pcg32::seed_from_u64(seed);
        let squares = (0..100).map(|_| {
            let joints = worked(&own.file, &own.truth, &mut rng);
            let there = report.after.tool().position(&report.after.robot, &joints);
            let is = at(platform(&own.truth, &own.rods, &joints), &tool);
            (there.unwrap() - is).norm_squared() / 100.0
        });
        let stated = report.expected_error.unwrap().absolute_rms_mm;
        let unknown = report.unknown_rods.map_or(0.0, |own| own.absolute_mm);
        let (is, stated) = (squares.sum::<f64>(), stated * stated);
        let whole = stated + unknown * unknown;
        let each = [is / (size * size), stated / (size * size), is / whole];
        for (sum, own) in sums.iter_mut().zip(each) {
            *sum += own;
        }
    }
    assert!(calibrated > 0.6 * f64::from(robots), "{calibrated}");
    sums.map(|own| f64::sqrt(own / calibrated))
}

/// Three targets and 10 poses, one target and 30 poses.
#[test]
fn tools_are_where_they_are_stated_to_be_although_the_platform_tilts() {
    for (targets, poses) in [(3, 10), (1, 30)] {
        let [achieved, stated, _] = tools(targets, poses, true);
        println!("{targets} targets, {poses} poses: {achieved:.3} mm, {stated:.3} stated");
        assert!(
            (0.8..1.25).contains(&(achieved / stated)),
            "{achieved} {stated}"
        );
    }
}

/// Of rods that nobody stated the fit knows nothing: what it then leaves out is in the budget, for rods that are as far apart
/// as usual.
#[test]
fn the_budget_states_what_unknown_rods_add() {
    let [achieved, stated, parts] = tools(1, 30, false);
    println!(
        "unknown rods: {achieved:.3} mm, {stated:.3} stated, {parts:.2} of all that is stated"
    );
    assert!(achieved > 5.0 * stated, "{achieved} {stated}");
    assert!((0.8..1.25).contains(&parts), "{parts}");
}

/// Planned poses of three targets bring what the plan promises, within 15 %.
#[test]
fn planned_poses_keep_their_promise_where_the_platform_tilts() {
    let mut ratios = Vec::new();
    for (seed, file) in (90..).zip(rotary(true).into_iter().step_by(3)) {
        let size = file.robot.arms()[0].lb() / 480.0;
        let targets = TARGETS.map(|own| Vector3::from(own) * size);
        let rods = (60.0 * size, RODS[1].to_radians());
        let mut own = made(&file, rods, &targets, 0, seed);
        own.file.tool = Some(Vector3::from(TOOLS[1]) * size);
        let plan = plan(&PlanRequest {
            absolute: true,
            region: own.file.within,
            ..PlanRequest::new(&own.file, Wishes::only(Kind::XYZ), 15)
        });
        let plan = plan.unwrap();
        let mut rng = Pcg32::seed_from_u64(seed);
        for planned in &plan.measurements {
            own.measure(planned.reading.joints, planned.reading.target, &mut rng);
        }
        let report = calibrate(&own.file, &own.readings, &Options::default()).unwrap();
        ratios.push(report.expected_error.unwrap().absolute_rms_mm / plan.after.absolute);
    }
    println!("reached/promised {ratios:.2?}");
    for ratio in ratios {
        assert!((0.85..1.15).contains(&ratio), "{ratio}");
    }
}

/// A robot of known rods on the command line: positions of a target, and the joints that bring it there.
#[test]
fn forward_and_inverse_take_targets_and_the_correction_table_is_that_of_the_tool() {
    let targets = TARGETS.map(Vector3::from);
    let own = made(
        &rotary(true)[0],
        (60.0, RODS[1].to_radians()),
        &targets,
        12,
        3,
    );
    let mut file = own.file.with_tolerance(None);
    file.robot = own.truth.clone();
    file.parallelograms = Some(own.rods);
    file.tool = Some(Vector3::from(TOOLS[1]));
    let folder = Folder::new();
    folder.write("robot.toml", file.to_toml(""));
    folder.write("nominal.toml", own.file.to_toml(""));
    folder.write("q.csv", "q1_deg,q2_deg,q3_deg\n10,35,-5\n40,20,30\n");
    let command = "forward robot.toml q.csv --output x.csv --target";
    for (name, place) in [
        ("T2", targets[2]),
        ("12,-34,-56", Vector3::new(12.0, -34.0, -56.0)),
        ("tool", Vector3::from(TOOLS[1])),
    ] {
        folder.run(&format!("{command} {name}")).ok();
        for (line, joints) in folder
            .read("x.csv")
            .lines()
            .skip(1)
            .zip([[10.0, 35.0, -5.0], [40.0, 20.0, 30.0]])
        {
            let cells: Vec<f64> = line.split(',').map(|own| own.parse().unwrap()).collect();
            let pose = platform(&own.truth, &own.rods, &joints.map(f64::to_radians));
            let off = Vector3::from_row_slice(&cells[3..6]) - at(pose, &place);
            let turned = Vector3::from_row_slice(&cells[6..]) - pose[1].map(f64::to_degrees);
            assert!(
                off.norm() < 1e-7 && turned.norm() < 1e-7,
                "{name}: {off} {turned}"
            );
        }
        let back = folder
            .run(&format!("inverse robot.toml x.csv --target {name}"))
            .ok();
        let line = back.stdout.lines().nth(1).unwrap();
        for (cell, expected) in line.split(',').zip([10.0, 35.0, -5.0]) {
            assert!(
                (cell.parse::<f64>().unwrap() - expected).abs() < 1e-6,
                "{line}"
            );
        }
    }
    let none = folder.run(&format!("{command} T9"));
    assert!(
        none.stderr.contains("its targets are T0, T1, T2 and tool"),
        "{}",
        none.stderr
    );

    let table = folder
        .run("export robot.toml --for correction-table --nominal nominal.toml")
        .ok();
    let loss = |name: &str| -> f64 {
        let line = table.stdout.lines().find(|own| own.contains(name)).unwrap();
        line.split_whitespace()
            .rev()
            .nth(1)
            .unwrap()
            .parse()
            .unwrap()
    };
    assert!(
        loss("for correction-table") < 0.02 && loss("at target T1") > 0.05,
        "{}",
        table.stdout
    );
}

/// Without the rods' spacing the report says what they could do, and the budget has it; stated without the platform's radius it is refused.
#[test]
fn unknown_rods_are_said_to_be_unknown() {
    let folder = Folder::new();
    let target = "[target]\nx_mm = 60\ny_mm = 0\nz_mm = -40\n";
    folder.write("robot.toml", format!("{NOMINAL}{NOISE}{target}"));
    let rows = noisy(&true_arms(), 30, 0.02).into_iter();
    let rows: Vec<_> = rows
        .map(|(q, [x, y, z])| (q, [x + 60.0, y, z - 40.0]))
        .collect();
    folder.write("samples.csv", csv(&rows));
    let run = folder.run("calibrate robot.toml samples.csv").ok();
    assert!(
        run.stdout
            .contains("If the two rods of each arm differ by 0.1 mm"),
        "{}",
        run.stdout
    );
    assert!(run.stdout.contains("spacing_mm"), "{}", run.stdout);
    assert!(
        run.stdout.contains("not combined: rods that differ"),
        "{}",
        run.stdout
    );
}

/// Simulated robots whose platform tilts: what is stated of their tool is true.
#[test]
fn campaigns_simulate_platforms_that_tilt() {
    let folder = Folder::new();
    let target = |(index, [x, y, z]): (usize, &[f64; 3])| {
        format!("[targets.T{index}]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\nsigma_mm = 0.001\n")
    };
    let targets: String = TARGETS.iter().enumerate().map(target).collect();
    let rods = "[parallelogram]\nspacing_mm = 60\n[tool]\nx_mm = 0\ny_mm = 0\nz_mm = -100\n";
    let within = "[workspace]\nwithin = \"r=216,z=-650..-450\"\n";
    folder.write("robot.toml", format!("{NOMINAL}{within}{rods}{targets}"));
    folder.write(
        "campaign.toml",
        "robot = \"robot.toml\"\nrobots = 24\nseed = 3\nspread = \"normal\"\nposes = [10]\nmethods = [\"fkm\"]\n\
         start_errors = [{ length_mm = 0.5, angle_deg = 0.2 }]\n\
         noise_levels = [{ position_mm = 0.02, joint_deg = 0.001 }]\n",
    );
    folder.run("simulate campaign.toml --output rows.csv").ok();
    let summary = folder.run("simulate --summary rows.csv --json -").ok();
    let summary: serde_json::Value = serde_json::from_str(&summary.stdout).unwrap();
    for ratio in ["error_to_stated", "relative_to_stated"] {
        let found = summary[0]["ratios"][ratio].as_f64().unwrap();
        println!("{ratio} {found}");
        assert!((0.8..1.25).contains(&found), "{summary:#}");
    }
}
