//! Files with a fault that affects the whole file: exactly the injected fault is named.

use crate::support::cases;
use delta_cal::robot::Arm;
use delta_cal::{Noise, Robot, Tolerance};
use delta_cal_host::{
    CalibrateError, Frame, InputText, Options, Report, RobotFile, calibrate, read_samples,
};
use delta_cal_tests::{Spread, measurements, paper_limits, paper_robot, size, uniform};
use nalgebra::{Rotation3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::fmt::Write;

/// Changes every length by up to `length` mm and every angle by up to `degrees`.
fn perturbed(robot: &Robot<f64>, length: f64, degrees: f64, rng: &mut Pcg32) -> Robot<f64> {
    delta_cal_tests::perturbed(robot, length, degrees.to_radians(), Spread::Uniform, rng)
}

/// A robot file, measurements in mm and degrees, and the header under which they are written.
struct Case {
    file: RobotFile,
    rows: Vec<([f64; 3], Vector3<f64>)>,
    angles: &'static str,
    lengths: &'static str,
    options: Options,
}

impl Case {
    /// The diagnosis of the whole file, if there is one.
    fn diagnosis(&self) -> Option<String> {
        match self.calibrated() {
            Ok(report) => report.diagnosis.map(|own| own.to_string()),
            Err(error) if error.refused() => error.diagnosis().map(ToString::to_string),
            Err(error) => error.remedy(),
        }
    }

    fn calibrated(&self) -> Result<Report, CalibrateError> {
        let (q, l) = (self.angles, self.lengths);
        let mut text = format!("q1_{q},q2_{q},q3_{q},x_{l},y_{l},z_{l}\n");
        for ([q1, q2, q3], x) in &self.rows {
            writeln!(text, "{q1},{q2},{q3},{},{},{}", x.x, x.y, x.z).unwrap();
        }
        let input = InputText::new("samples.csv", &text);
        let readings = read_samples(&input, &self.file, &self.options)?;
        calibrate(&self.file, &readings, &self.options)
    }
}

/// A case; successive robots run through all calibration settings.
fn case(robot: u64, frame: Option<Frame>) -> (Case, Pcg32) {
    let mut rng = Pcg32::seed_from_u64(0xd1a6 ^ (robot << 20));
    let truth = perturbed(&paper_robot(), 1.0, 0.3, &mut rng);
    let noise = Noise::new(0.02, 0.002_f64.to_radians()).unwrap();
    let count = [8, 12, 20, 60][usize::try_from(robot % 4).unwrap()];
    let mut samples = measurements(&truth, count, Some(&noise), &mut rng);
    let way = robot / 4;
    let frame = frame.unwrap_or(if way % 3 == 2 {
        Frame::Sensor
    } else {
        Frame::Base
    });
    if frame == Frame::Sensor {
        let [yaw, pitch, roll] = [3.0, 1.0, 3.0].map(|most| most * uniform(&mut rng));
        let rotation = Rotation3::from_euler_angles(yaw, pitch, roll);
        for sample in &mut samples {
            sample.position = rotation * sample.position + Vector3::new(900.0, -400.0, 300.0);
        }
    }
    let rows = samples.iter();
    let rows = rows.map(|sample| (sample.joints.map(f64::to_degrees), sample.position));
    let tolerance = Tolerance::new(0.6, 0.2_f64.to_radians()).unwrap();
    let case = Case {
        file: RobotFile {
            tolerance: (way / 2).is_multiple_of(2).then_some(tolerance),
            noise: (way / 3).is_multiple_of(2).then_some(noise),
            ..RobotFile::of("robot.toml", paper_robot(), paper_limits())
        },
        rows: rows.collect(),
        angles: "deg",
        lengths: "mm",
        options: Options::in_frame(frame),
    };
    (case, rng)
}

type Change = fn(&mut Case, &mut Pcg32);

/// A robot with one arm changed.
fn changed(robot: &Robot<f64>, arm: usize, change: impl Fn(&mut [f64; 8])) -> Robot<f64> {
    let mut arms = *robot.arms();
    let mut parameters = arms[arm].parameters();
    change(&mut parameters);
    arms[arm] = Arm::new(parameters).unwrap();
    Robot::new(arms).unwrap()
}

fn joints(case: &mut Case, change: impl Fn(&mut [f64; 3])) {
    for (q, _) in &mut case.rows {
        change(q);
    }
}

fn positions(case: &mut Case, change: impl Fn(&mut Vector3<f64>)) {
    for (_, x) in &mut case.rows {
        change(x);
    }
}

/// A fault, the frame in which it shows if only one, and the expected diagnosis.
const FAULTS: &str = include_str!("../files/whole-files.txt");

fn spoil(case: &mut Case, fault: &str) {
    match fault {
        "q1 and q2 exchanged" => joints(case, |q| q.swap(0, 1)),
        "q1, q2, q3 in turn" => joints(case, |q| q.rotate_left(1)),
        "sign of q2" => joints(case, |q| q[1] = -q[1]),
        "signs of all joints" => joints(case, |q| *q = q.map(|q| -q)),
        "radians as degrees" => joints(case, |q| *q = q.map(f64::to_radians)),
        "degrees as radians" => case.angles = "rad",
        "metres as millimetres" => positions(case, |x| *x /= 1000.0),
        "millimetres as metres" => case.lengths = "m",
        "millimetres as micrometres" => case.lengths = "um",
        "inches as millimetres" => positions(case, |x| *x /= 25.4),
        "mirrored" => positions(case, |x| x.x = -x.x),
        "upside down" => positions(case, |x| (x.y, x.z) = (-x.y, -x.z)),
        "x and y exchanged" => positions(case, |x| (x.x, x.y) = (x.y, x.x)),
        "x, y, z in turn" => positions(case, |x| *x = Vector3::new(x.z, x.x, x.y)),
        "tracker's frame" => case.options.frame = Frame::Base,
        "one joint in radians" => joints(case, |q| q[2] = q[2].to_radians()),
        "lengths of two arms" => {
            // The true robot has the longer parts in arm 2, the file has them in arm 3.
            let longer = |robot: &Robot<f64>, arm| {
                changed(robot, arm, |parameters| {
                    parameters[5] += 6.0;
                    parameters[7] += 15.0;
                })
            };
            case.file.robot = longer(&case.file.robot, 2);
            let (original, longer) = (paper_robot(), longer(&paper_robot(), 1));
            for (q, x) in &mut case.rows {
                let q = q.map(f64::to_radians);
                *x += longer.forward(&q).unwrap() - original.forward(&q).unwrap();
            }
        }
        "positions one row above" => moved_up(case, 1),
        both => {
            let (first, second) = match both {
                "tracker's frame, mirrored" => ("tracker's frame", "mirrored"),
                "metres, q1 and q2 exchanged" => ("metres as millimetres", "q1 and q2 exchanged"),
                fault => panic!("{fault}"),
            };
            spoil(case, first);
            spoil(case, second);
        }
    }
}

/// Moves positions this many rows up from their joints.
fn moved_up(case: &mut Case, by: usize) {
    let positions: Vec<_> = case.rows.iter().map(|(_, x)| *x).collect();
    for (index, (_, x)) in case.rows.iter_mut().enumerate() {
        *x = positions[(index + by) % positions.len()];
    }
}

/// Correct files, files with only some wrong rows or a wrong robot, and files wrong beyond explanation.
const OTHERS: &[(&str, Change)] = &[
    ("one sample off by 5 mm", |case, rng| {
        let index = rng.next_u32() as usize % case.rows.len();
        case.rows[index].1.z += 5.0;
    }),
    ("one sample off by 200 mm", |case, rng| {
        let index = rng.next_u32() as usize % case.rows.len();
        case.rows[index].1.x += 200.0;
    }),
    ("two columns exchanged in one row", |case, rng| {
        let index = rng.next_u32() as usize % case.rows.len();
        case.rows[index].0.swap(0, 1);
    }),
    (
        "two forearms that differ by 0.25 mm exchanged",
        |case, _| {
            let [one, other] =
                [0, 1].map(|arm| changed(&case.file.robot, arm, |own| own[7] += 0.25));
            case.file.robot = one;
            for (joints, x) in &mut case.rows {
                *x = other.forward(&joints.map(f64::to_radians)).unwrap();
            }
        },
    ),
    ("noise 50 times the stated", |case, rng| {
        for (_, x) in &mut case.rows {
            *x += Vector3::from_fn(|_, _| uniform(rng) * 3f64.sqrt());
        }
    }),
    ("robot 10 mm and 3° off", |case, rng| {
        case.file.robot = perturbed(&case.file.robot, 10.0, 3.0, rng);
    }),
    ("forearm 2 60 mm too long", |case, _| {
        case.file.robot = changed(&case.file.robot, 1, |parameters| parameters[7] += 60.0);
    }),
    ("joint zeros off by up to 25°", |case, rng| {
        let by = [0; 3].map(|_| 25.0 * uniform(rng));
        joints(case, |q| {
            for (q, by) in q.iter_mut().zip(by) {
                *q = (*q + by).clamp(-60.0, 90.0);
            }
        });
    }),
    ("rows of other poses", |case, _| {
        moved_up(case, case.rows.len() / 2);
    }),
    ("numbers without meaning", |case, rng| {
        for (_, x) in &mut case.rows {
            *x = Vector3::from_fn(|_, _| 300.0 * uniform(rng)) - Vector3::z() * 400.0;
        }
    }),
    ("nothing", |_, _| {}),
];

/// Number of robots, enough for every combination of sample count, frame, and tolerance and noise stated or not.
const ROBOTS: u64 = 240;
/// Robots per fault.
const SOME: u64 = 12;

/// The robots `0, 7, 14, …`, so that a few of them still cover all settings; the next fault gets the next robots.
fn robots(fault: usize) -> impl Iterator<Item = u64> {
    let first = SOME * fault as u64;
    (first..first + SOME).map(|index| 7 * index % ROBOTS)
}

#[test]
fn faults_of_whole_files_are_named() {
    let mut unnamed = Vec::new();
    for (place, [fault, frame, expected]) in cases(FAULTS).into_iter().enumerate() {
        let frame = match frame.as_str() {
            "base" => Some(Frame::Base),
            "sensor" => Some(Frame::Sensor),
            _ => None,
        };
        let named = robots(place).filter(|robot| {
            let (mut case, _) = case(*robot, frame);
            spoil(&mut case, &fault);
            let said = case.diagnosis();
            said.is_some_and(|said| expected.split(" | ").all(|part| said.contains(part)))
        });
        let named = named.count() as u64;
        if 100 * named < 90 * SOME {
            unnamed.push(format!("{fault}: {named} of {SOME}"));
        }
    }
    assert!(unnamed.is_empty(), "{unnamed:#?}");
}

#[test]
fn nothing_is_said_of_files_that_are_right_or_wrong_otherwise() {
    let mut accused = Vec::new();
    for (place, (name, change)) in OTHERS.iter().enumerate() {
        for robot in robots(place).step_by(size(4, 2)) {
            let (mut case, mut rng) = case(robot, None);
            change(&mut case, &mut rng);
            let said = case.diagnosis();
            accused.extend(said.map(|said| format!("{name}, {robot}: {said}")));
        }
    }
    assert!(accused.is_empty(), "{accused:#?}");
}

/// A coordinate that was typed in as the controller had commanded it, and the joints with four digits.
#[test]
fn a_commanded_coordinate_is_no_measurement() {
    for robot in 0..24 {
        let (mut case, _) = case(robot, Some(Frame::Base));
        let nominal = case.file.robot.clone();
        for (joints, position) in &mut case.rows {
            *joints = joints.map(|q| (1e4 * q).round() / 1e4);
            position.z = nominal.forward(&joints.map(f64::to_radians)).unwrap().z;
        }
        let error = case.calibrated().unwrap_err();
        assert!(
            error
                .to_string()
                .contains("z is where the robot file puts the platform"),
            "{error}"
        );
    }
}
