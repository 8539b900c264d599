//! Robots whose platform tilts because the two rods of an arm differ, with reflectors beside the platform's centre.

use crate::support::schema::violations;
use crate::support::simulated::{SIGMAS, mount, push, rotary, somewhere, worked, working};
use crate::support::{Folder, NOMINAL, Point, assert_refused, number, rows_of};
use delta_cal::frame::RigidTransform;
use delta_cal::robot::Drive;
use delta_cal::simulate::{made_robot, standard_normal};
use delta_cal::{Parameter, Robot, Tolerance};
use delta_cal_host::files::convention::Vertical;
use delta_cal_host::geometry::Parallelograms;
use delta_cal_host::planning::{Kind, Wishes};
use delta_cal_host::validation::{Request, validate};
use delta_cal_host::{Frame, Options, PlanRequest, Reading, Readings, RobotFile, calibrate, plan};
use delta_cal_tests::size as of_size;
use delta_cal_verify::check_figures;
use nalgebra::{DMatrix, DVector, Rotation2, Rotation3, SMatrix, SVector, Vector2, Vector3};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use std::fmt::Write as _;

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
    let off = |at: &SVector<f64, 6>| {
        let turn = Rotation3::new(Vector3::new(at[3], at[4], at[5]));
        SVector::<f64, 6>::from_fn(|row, _| {
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
    let mut at = SVector::<f64, 6>::zeros();
    at.fixed_rows_mut::<3>(0)
        .copy_from(&robot.forward(joints).unwrap());
    for _ in 0..20 {
        let here = off(&at);
        if here.amax() < 1e-10 {
            break;
        }
        let steps = [0, 1, 2, 3, 4, 5].map(|column| {
            let step = if column < 3 { 1e-4 } else { 1e-6 };
            let (mut ahead, mut back) = (at, at);
            ahead[column] += step;
            back[column] -= step;
            (off(&ahead) - off(&back)) / (2.0 * step)
        });
        let steps = SMatrix::<f64, 6, 6>::from_columns(&steps);
        at -= steps.lu().solve(&here).unwrap();
    }
    assert!(off(&at).amax() < 1e-9, "{at}");
    [0, 3].map(|first| Vector3::new(at[first], at[first + 1], at[first + 2]))
}

/// Where a point of the platform is.
pub(crate) fn at(pose: [Vector3<f64>; 2], point: &Vector3<f64>) -> Vector3<f64> {
    pose[0] + Rotation3::new(pose[1]) * point
}

/// To first order, how far each of the twelve numbers of the rods moves a point of the platform: central differences of the
/// independent solver.
#[test]
fn columns_are_derivatives() {
    let robot = &rotary(true)[0].robot;
    let point = Vector3::new(55.0, -30.0, -80.0);
    let exact = Parallelograms {
        spacing: 60.0,
        platform_radius: 30.0,
        numbers: [[0.0; 4]; 3],
        tolerance: RODS,
    };
    for joints in [[0.1, 0.3, -0.2], [0.6, 0.2, 0.5]] {
        let x = robot.forward(&joints).unwrap();
        let columns = exact.columns(robot, (&x, &joints), &point).unwrap();
        for number in 0..12 {
            let moved = |by: f64| {
                let mut rods = exact;
                rods.numbers.as_flattened_mut()[number] = by;
                at(platform(robot, &rods, &joints), &point)
            };
            let expected = (moved(1e-3) - moved(-1e-3)) / 2e-3;
            let off = (columns.column(number) - expected).amax();
            assert!(off < 1e-4 * columns.amax(), "{number}: {off} {expected}");
        }
    }
}

/// How 6-DoF targets are mounted.
fn mounting(target: usize) -> Rotation3<f64> {
    let size = [1.0, 2.0, 3.0][target];
    Rotation3::new(Vector3::new(0.4, -0.9, 0.6) * size)
}

struct Made {
    file: RobotFile,
    /// What was drawn of its parameters and rods, in σ.
    drawn: [f64; UNKNOWNS],
    truth: Robot<f64>,
    rods: Parallelograms,
    readings: Readings,
    /// From the robot's axes to those of the coordinates.
    frame: RigidTransform<f64>,
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
    let size = file.robot.arms()[0].lb() / 480.0;
    let mut file = file.clone();
    file.within = Some(working(&file));
    file.tolerance = Some(tolerance);
    file.platform_radius = Some(30.0 * size);
    file.parallelograms = Some(Parallelograms {
        spacing,
        platform_radius: 30.0 * size,
        numbers: [[0.0; 4]; 3],
        tolerance: [RODS[0], angle],
    });
    let drawn = [0.0; UNKNOWNS].map(|_| standard_normal(&mut rng));
    let (truth, rods) = built(&file, &drawn);
    let mut readings = Readings::of_name("samples.csv");
    mount(&mut file, &mut readings, targets, 1e-3);
    let mut own = Made {
        file,
        drawn,
        truth,
        rods,
        readings,
        frame: RigidTransform::identity(),
    };
    own.measure_all(rows, &mut rng);
    own
}

/// The 24 parameters, for components of an upper arm its length and direction, and the 12 numbers of the rods.
const UNKNOWNS: usize = 36;

/// The robot and the rods that are off a file by this many σ of its tolerances.
fn built(file: &RobotFile, drawn: &[f64; UNKNOWNS]) -> (Robot<f64>, Parallelograms) {
    let (tolerance, mut rods) = (file.tolerance.unwrap(), file.parallelograms.unwrap());
    let mut arms = file.robot.parameters();
    for (arm, drawn) in arms.iter_mut().zip(drawn.chunks(8)) {
        let upper = Vector2::new(arm[5], arm[6]);
        for (own, parameter) in Drive::Rotary.parameters().iter().enumerate() {
            arm[own] += drawn[own] * tolerance.of(*parameter);
        }
        let turn = Rotation2::new(drawn[6] * tolerance.joint_zero().unwrap());
        let length = 1.0 + drawn[5] * tolerance.of(Parameter::LaX) / upper.norm();
        [arm[5], arm[6]] = (turn * upper * length).into();
    }
    for (number, own) in rods.numbers.as_flattened_mut().iter_mut().enumerate() {
        *own = drawn[24 + number] * rods.tolerance[usize::from(number % 4 > 1)];
    }
    (file.robot.with_parameters(arms).unwrap(), rods)
}

impl Made {
    /// All targets at so many poses.
    fn measure_all(&mut self, rows: usize, rng: &mut Pcg32) {
        for _ in 0..rows {
            let joints = worked(&self.file, &self.truth, rng);
            for target in 0..self.file.instruments.targets.len() {
                self.measure(joints, target, rng);
            }
        }
    }

    /// A row of this target.
    fn measure(&mut self, joints: [f64; 3], target: usize, rng: &mut Pcg32) {
        let place = self.file.instruments.targets[target].place;
        let pose = platform(&self.truth, &self.rods, &joints);
        let seen = self.frame.apply(&at(pose, &place));
        let [position, joint, ..] = SIGMAS;
        let mut normal = |sigma: f64| sigma * standard_normal::<f64, _>(rng);
        let turn = self.file.instruments.orientation_noise.map(|sigma| {
            let noise = Rotation3::new(Vector3::from_fn(|_, _| normal(sigma)));
            let frame = Rotation3::from_matrix_unchecked(self.frame.rotation);
            (frame * noise * Rotation3::new(pose[1]) * mounting(target)).scaled_axis()
        });
        let own = Reading {
            position: [0, 1, 2].map(|axis| Some(seen[axis] + normal(position))),
            target,
            turn,
            ..Reading::at(joints.map(|q| q + normal(joint.to_radians())))
        };
        push(&mut self.readings, &own);
    }
}

/// What is measured of robots.
#[derive(Clone, Copy)]
struct Campaign {
    targets: usize,
    poses: usize,
    /// σ of rotations, degrees.
    rotations: Option<f64>,
    /// Whether the rods' spacing is stated.
    known: bool,
    frame: Frame,
}

const THREE_TARGETS: Campaign = Campaign {
    targets: 3,
    poses: 10,
    rotations: None,
    known: true,
    frame: Frame::Base,
};

/// How far off a tool is and is stated to be, and the same of the best estimate by the independent solver, rms, mm, of robots of
/// eight geometries, and tools in turn; and the first in parts of the second together with what rods of which nothing is known
/// add to that.
fn tools(campaign: Campaign) -> [f64; 5] {
    let robots: u8 = of_size(24, 96);
    let geometries = rotary(true);
    let (mut sums, mut calibrated) = ([0.0; 5], 0.0);
    for robot in 0..robots {
        let seed = u64::from(robot);
        let robot = usize::from(robot);
        let mut file = geometries[robot % geometries.len()].clone();
        let size = file.robot.arms()[0].lb() / 480.0;
        let tool = Vector3::from(TOOLS[robot % TOOLS.len()]) * size;
        let targets = TARGETS[..campaign.targets].iter();
        let targets: Vec<_> = targets.map(|own| Vector3::from(*own) * size).collect();
        let rods = if campaign.known {
            (60.0 * size, RODS[1].to_radians())
        } else {
            (50.0, 0.0)
        };
        file.instruments.orientation_noise = campaign.rotations.map(f64::to_radians);
        let mut own = made(&file, rods, &targets, 0, 40 + seed);
        let mut rng = Pcg32::seed_from_u64(80 + seed);
        if campaign.frame == Frame::Sensor {
            own.frame = somewhere(1.0, 500.0, &mut rng);
        }
        own.measure_all(campaign.poses, &mut rng);
        own.file.tool = Some(tool);
        own.file.parallelograms = own.file.parallelograms.filter(|_| campaign.known);
        let options = Options::in_frame(campaign.frame);
        // Model 24 does not fit all robots that tilt; of others a few are doubted.
        let Ok(report) = calibrate(&own.file, &own.readings, &options) else {
            continue;
        };
        calibrated += 1.0;
        let mut rng = Pcg32::seed_from_u64(seed);
        let poses: Vec<_> = (0..50)
            .map(|_| worked(&own.file, &own.truth, &mut rng))
            .collect();
        let pairs = poses.iter().map(|joints| {
            let there = report.after.tool().position(&report.after.robot, joints);
            let is = at(platform(&own.truth, &own.rods, joints), &tool);
            (there.unwrap(), is)
        });
        let pairs: Vec<_> = pairs.collect();
        let expected = report.expected_error.unwrap();
        // A sensor's frame is free: what counts is the shape.
        let (off, stated) = match campaign.frame {
            Frame::Base => (RigidTransform::identity(), expected.absolute_rms_mm),
            Frame::Sensor => (
                RigidTransform::align(pairs.iter().copied()).unwrap(),
                expected.relative_rms_mm,
            ),
        };
        let squares = pairs
            .iter()
            .map(|(there, is)| (off.apply(there) - is).norm_squared() / 50.0);
        let best = if campaign.known && campaign.frame == Frame::Base {
            own.best(&tool, &poses)
        } else {
            [0.0; 2]
        };
        let unknown = report.unknown_rods.map_or(0.0, |own| own.absolute_mm);
        let (is, stated) = (squares.sum::<f64>(), stated * stated);
        let whole = stated + unknown * unknown;
        let each = [is, stated, best[0], best[1]].map(|own| own / (size * size));
        for (sum, own) in sums.iter_mut().zip(each.into_iter().chain([is / whole])) {
            *sum += own;
        }
    }
    let least = if campaign.known { 0.95 } else { 0.6 };
    assert!(calibrated > least * f64::from(robots), "{calibrated}");
    sums.map(|own| f64::sqrt(own / calibrated))
}

impl Made {
    /// The mean square error of a tool at these 50 poses, mm², of the posterior mean of the readings' linear model, and its expectation:
    /// derivatives by the 24 parameters and 12 numbers, each in its tolerance, and by the joints are differences of the
    /// independent solver.
    fn best(&self, tool: &Vector3<f64>, poses: &[[f64; 3]]) -> [f64; 2] {
        let step = 1e-3;
        let changed = |unknown: usize| {
            let mut drawn = self.drawn;
            drawn[unknown] += step;
            built(&self.file, &drawn)
        };
        let all: Vec<_> = (0..UNKNOWNS).map(changed).collect();
        // x, y, z of a point and the rotation vector.
        let read = |(robot, rods): &(Robot<f64>, Parallelograms),
                    joints: &[f64; 3],
                    point: &Vector3<f64>| {
            let pose = platform(robot, rods, joints);
            DVector::from_iterator(6, at(pose, point).iter().chain(&pose[1]).copied())
        };
        let truth = (self.truth.clone(), self.rods);
        let derivatives = |joints: &[f64; 3], point: &Vector3<f64>| {
            let here = read(&truth, joints, point);
            let columns: Vec<_> = all
                .iter()
                .map(|own| (read(own, joints, point) - &here) / step)
                .collect();
            (DMatrix::from_columns(&columns), here)
        };
        let [position, joint, ..] = SIGMAS;
        let targets = &self.file.instruments.targets;
        let turns = self.file.instruments.orientation_noise;
        // The unknowns, and the mounting of each target.
        let count = UNKNOWNS + 3 * targets.len();
        let mut shown = -DVector::from_row_slice(&self.drawn).resize_vertically(count, 0.0);
        let mut information = DMatrix::zeros(count, count);
        information
            .view_mut((0, 0), (UNKNOWNS, UNKNOWNS))
            .fill_with_identity();
        for mounting in UNKNOWNS..count {
            information[(mounting, mounting)] = 1e-6;
        }
        for row in self.readings.rows.iter().map(|row| &row.value) {
            let (columns, here) = derivatives(&row.joints, &targets[row.target].place);
            let by_joints = DMatrix::from_fn(6, 3, |reading, index| {
                let mut joints = row.joints;
                joints[index] += 1e-6;
                (read(&truth, &joints, &targets[row.target].place)[reading] - here[reading]) / 1e-6
            });
            let mut a = columns.insert_columns(UNKNOWNS, 3 * targets.len(), 0.0);
            a.view_mut((3, UNKNOWNS + 3 * row.target), (3, 3))
                .fill_with_identity();
            let noise = [position, turns.unwrap_or(1e3)];
            let noise = DVector::from_fn(6, |reading, _| f64::powi(noise[reading / 3], 2));
            let joint = joint.to_radians();
            let noise = DMatrix::from_diagonal(&noise)
                + &by_joints * by_joints.transpose() * (joint * joint);
            let weight = noise.cholesky().unwrap().inverse();
            let turn = row.turn.map_or_else(Vector3::zeros, |turn| {
                let own = Rotation3::new(Vector3::new(here[3], here[4], here[5]));
                (Rotation3::new(turn) * mounting(row.target).inverse() * own.inverse())
                    .scaled_axis()
            });
            let read = (0..3).map(|axis| row.position[axis].unwrap() - here[axis]);
            let read = DVector::from_iterator(6, read.chain(turn.iter().copied()));
            shown += a.tr_mul(&(&weight * read));
            information += a.tr_mul(&(weight * &a));
        }
        let covariance = information.cholesky().unwrap().inverse();
        let off = (&covariance * shown).rows(0, UNKNOWNS).into_owned();
        let covariance = covariance.view((0, 0), (UNKNOWNS, UNKNOWNS));
        let squares = poses.iter().map(|joints| {
            let a = derivatives(joints, tool).0.rows(0, 3).into_owned();
            let expected = (&a * covariance * a.transpose()).trace();
            [(&a * &off).norm_squared(), expected].map(|own| own / 50.0)
        });
        squares.fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]])
    }
}

/// Three targets and 10 poses, one target and 30 poses; and one target whose rotation is read as well, also in a sensor's frame.
/// The errors are those of the best estimate.
#[test]
fn tools_are_where_they_are_stated_to_be_although_the_platform_tilts() {
    let one = Campaign {
        targets: 1,
        poses: 30,
        ..THREE_TARGETS
    };
    let turned = Campaign {
        rotations: Some(0.01),
        ..one
    };
    let seen = Campaign {
        frame: Frame::Sensor,
        ..turned
    };
    let found = [THREE_TARGETS, one, turned, seen].map(tools);
    println!("achieved, stated, best achieved and stated: {found:.3?}");
    for [achieved, stated, best, expected, _] in found {
        assert!((0.8..1.25).contains(&(achieved / stated)), "{found:?}");
        assert!(best == 0.0 || achieved < 1.1 * best, "{found:?}");
        let promise = stated / expected;
        assert!(best == 0.0 || (0.95..1.05).contains(&promise), "{found:?}");
    }
    // As stated, which is as promised above: what is achieved scatters too much for a ratio of two.
    let [three, one, turned, _] = found.map(|own| own[1]);
    assert!(turned < 0.6 * one, "{found:?}");
    let figures = [
        ("tilt/three", three),
        ("tilt/one", one),
        ("tilt/turned", turned),
    ];
    let figures = figures.map(|(name, own)| (name, own, 0.1 * own));
    check_figures("docs/instruments.md", &figures);
}

/// Of rods that nobody stated the fit knows nothing: what it then leaves out is in the budget, for rods that are as far apart
/// as usual.
#[test]
fn the_budget_states_what_unknown_rods_add() {
    let [achieved, stated, .., parts] = tools(Campaign {
        targets: 1,
        poses: 30,
        known: false,
        ..THREE_TARGETS
    });
    println!(
        "unknown rods: {achieved:.3} mm, {stated:.3} stated, {parts:.2} of all that is stated"
    );
    assert!(achieved > 5.0 * stated, "{achieved} {stated}");
    assert!((0.8..1.25).contains(&parts), "{parts}");
}

/// Robots whose parameters and rods are off what their files say: the error that a validation states by targets beside the
/// centre is theirs, and so is the deviation of the rotations.
#[test]
fn validations_state_the_error_of_platforms_that_tilt() {
    let (mut within, mut ratios, mut turns) = (0, Vec::new(), Vec::new());
    let robots: u8 = of_size(16, 96);
    for index in 0..robots {
        let seed = u64::from(index);
        let geometries = rotary(true);
        let mut file = geometries[usize::from(index) % geometries.len()].clone();
        let size = file.robot.arms()[0].lb() / 480.0;
        let targets = TARGETS.map(|own| Vector3::from(own) * size);
        file.instruments.orientation_noise = Some(0.01_f64.to_radians());
        let rods = (60.0 * size, RODS[1].to_radians());
        let mut own = made(&file, rods, &targets, 0, 200 + seed);
        let mut rng = Pcg32::seed_from_u64(seed);
        own.measure_all(40, &mut rng);
        let off = Tolerance::new(0.05 * size, 5e-5).unwrap();
        own.file.robot = made_robot(&own.truth, &off, &mut rng).unwrap();
        let numbers = own.rods.numbers.as_flattened().iter();
        let numbers: Vec<_> = numbers
            .map(|own| own * (1.0 + 0.3 * standard_normal::<f64, _>(&mut rng)))
            .collect();
        let rods = own.file.parallelograms.as_mut().unwrap();
        rods.numbers.as_flattened_mut().copy_from_slice(&numbers);
        let rods = *rods;
        let request = Request {
            limit: 0.1,
            frame: Frame::Base,
            stored: false,
        };
        let found = validate(&own.file, &own.readings, request).unwrap();
        let poses = |joints: &[f64; 3]| {
            let [is, file] = [(&own.truth, &own.rods), (&own.file.robot, &rods)];
            [is, file].map(|(robot, rods)| platform(robot, rods, joints))
        };
        let mut square = 0.0;
        for _ in 0..100 {
            let [is, file] = poses(&worked(&own.file, &own.truth, &mut rng));
            for target in &targets {
                square += (at(is, target) - at(file, target)).norm_squared() / 300.0;
            }
        }
        let rows = own.readings.rows.iter().step_by(targets.len());
        let tilts = rows.map(|row| {
            let [is, file] = poses(&row.value.joints);
            is[1] - file[1]
        });
        let tilts: Vec<_> = tilts.collect();
        let mean = tilts.iter().sum::<Vector3<f64>>() / 40.0;
        let tilt = tilts.iter().map(|own| (own - mean).norm_squared() / 40.0);
        let noise = 3.0 * 0.01_f64.to_radians().powi(2);
        let tilt = (tilt.sum::<f64>() + noise).sqrt().to_degrees();
        turns.push(found.rotation_deg.unwrap()[0] / tilt);
        let error = found.rms_error.error;
        let (low, high) = (error.interval.0, error.interval.1.unwrap());
        within += u8::from((low..high).contains(&square.sqrt()));
        ratios.push(error.value / square.sqrt());
    }
    println!("{within} of {robots} within; stated/is {ratios:.2?}, rotations {turns:.2?}");
    assert!(f64::from(within) > 0.85 * f64::from(robots), "{within}");
    for all in [ratios, turns] {
        let mean = all.iter().sum::<f64>() / f64::from(robots);
        assert!((0.93..1.07).contains(&mean), "{all:?}");
    }
}

/// Rotations in a file, with z up and down, and their noise in the robot file; without stated rods they are not used, and the report
/// and its budget say what the rods could do.
#[test]
fn rotations_are_read_in_the_axes_of_the_robot_file() {
    let folder = Folder::new();
    let rods = (60.0, RODS[1].to_radians());
    let target = Vector3::from(TARGETS[0]);
    let mut own = made(&rotary(true)[0], rods, &[target], 0, 3);
    own.file.instruments.orientation_noise = Some(0.01_f64.to_radians());
    own.measure_all(20, &mut Pcg32::seed_from_u64(3));
    let tilt = [Vertical::Up, Vertical::Down].map(|z| {
        own.file.convention.z_axis = z;
        let convention = &own.file.convention;
        let mut csv = "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n".to_owned();
        for row in own.readings.rows.iter().map(|row| &row.value) {
            let turn = convention.vector(&row.turn.unwrap()).map(f64::to_degrees);
            let position = Vector3::from(row.position.map(Option::unwrap));
            let position = convention.position(&position);
            let [q1, q2, q3] = convention.joints(&row.joints);
            let ([x, y, z], [rx, ry, rz]): (Point, Point) = (position, turn.into());
            writeln!(csv, "{q1},{q2},{q3},{x},{y},{z},{rx},{ry},{rz}").unwrap();
        }
        folder.write("samples.csv", csv);
        folder.write("robot.toml", own.file.to_toml(""));
        folder
            .run("calibrate robot.toml samples.csv --json r.json")
            .ok();
        let json = folder.json("r.json");
        let read = &json["tilt"]["orientation"];
        assert_eq!(
            (&read["stated_deg"], &read["rows"]),
            (&0.01.into(), &20.into())
        );
        let schema = include_str!("../../../docs/calibration.schema.json");
        let found = violations(&serde_json::from_str(schema).unwrap(), &json);
        assert!(found.is_empty(), "{found:#?}");
        let sign = if z == Vertical::Up { 1.0 } else { -1.0 };
        [0, 1, 2].map(|arm| {
            let of = |key: &str| number(&json, &format!("tilt/arms/{arm}/{key}/0"));
            (sign * of("numbers"), of("sigmas"))
        })
    });
    for ((up, sigma), (down, _)) in tilt[0].into_iter().zip(tilt[1]) {
        assert!((up - down).abs() < 1e-6 && sigma < 0.09, "{tilt:?}");
    }
    own.file.parallelograms = None;
    folder.write("robot.toml", own.file.to_toml(""));
    folder.run("calibrate robot.toml samples.csv").ends(
        0,
        "rx_deg, ry_deg, rz_deg in 20 rows are not used | If the two rods of each arm differ by 0.1 mm | \
         State spacing_mm in [parallelogram] | not combined: rods that differ",
    );
}

/// Planned poses of three targets, and of one whose rotation is read as well, bring what the plan promises, within 15 %.
#[test]
fn planned_poses_keep_their_promise_where_the_platform_tilts() {
    let mut ratios = Vec::new();
    let robots = rotary(true).into_iter().step_by(of_size(6, 3));
    for (seed, mut file) in (90..).zip(robots) {
        let size = file.robot.arms()[0].lb() / 480.0;
        let mut targets = TARGETS.map(|own| Vector3::from(own) * size).to_vec();
        if seed == 91 {
            file.instruments.orientation_noise = Some(0.01_f64.to_radians());
            targets.truncate(1);
        }
        let rods = (60.0 * size, RODS[1].to_radians());
        let mut own = made(&file, rods, &targets, 0, seed);
        own.file.tool = Some(Vector3::from(TOOLS[1]) * size);
        let plan = plan(&PlanRequest {
            absolute: true,
            region: own.file.within,
            ..PlanRequest::new(&own.file, Wishes::only(Kind::XYZ), 9)
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
    let rods = (60.0, RODS[1].to_radians());
    let own = made(&rotary(true)[0], rods, &targets, 12, 3);
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
        let rows = rows_of(&folder.read("x.csv"));
        for (cells, joints) in rows.iter().zip([[10.0, 35.0, -5.0], [40.0, 20.0, 30.0]]) {
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
        let back = &rows_of(&back.stdout)[0];
        for (joint, expected) in back.iter().zip([10.0, 35.0, -5.0]) {
            assert!((joint - expected).abs() < 1e-6, "{back:?}");
        }
    }
    let none = "T9 ⇒ 3 ⇒ its targets are T0, T1, T2 and tool";
    assert_refused(&folder, command, none);

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

/// Simulated robots whose platform tilts: what is stated of their tool is true, and rotations that are read improve it.
#[test]
fn campaigns_simulate_platforms_that_tilt() {
    let folder = Folder::new();
    let target = |(index, [x, y, z]): (usize, &[f64; 3])| {
        format!("[targets.T{index}]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\nsigma_mm = 0.001\n")
    };
    let rods = "[parallelogram]\nspacing_mm = 60\n[tool]\nx_mm = 0\ny_mm = 0\nz_mm = -100\n";
    let within = "[workspace]\nwithin = \"r=216,z=-650..-450\"\n";
    folder.write(
        "campaign.toml",
        "robot = \"robot.toml\"\nrobots = 24\nseed = 3\nspread = \"normal\"\nposes = [10]\nmethods = [\"fkm\"]\n\
         start_errors = [{ length_mm = 0.5, angle_deg = 0.2 }]\n\
         noise_levels = [{ position_mm = 0.02, joint_deg = 0.001 }]\n",
    );
    let rotations = "[noise]\njoint_deg = 0.001\norientation_deg = 0.01\n";
    let errors = [(3, ""), (1, ""), (1, rotations)].map(|(count, noise)| {
        let targets = TARGETS[..count].iter().enumerate().map(target);
        let targets: String = targets.collect();
        folder.write(
            "robot.toml",
            format!("{NOMINAL}{within}{rods}{targets}{noise}"),
        );
        folder.run("simulate campaign.toml --output rows.csv").ok();
        let summary = folder.run("simulate --summary rows.csv --json -").ok();
        let summary = summary.json();
        for ratio in ["error_to_stated", "relative_to_stated"] {
            let found = number(&summary, &format!("0/ratios/{ratio}"));
            println!("{count} targets {noise:?}: {ratio} {found}");
            assert!((0.8..1.25).contains(&found), "{summary:#}");
        }
        number(&summary, "0/relative_after_mm/mean")
    });
    let [three, one, turned] = errors;
    assert!(turned < 0.6 * one && three < one, "{errors:?}");
}
