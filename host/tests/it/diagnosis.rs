//! Files that cannot be right as a whole: what is injected is what is named, and nothing else is.

use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Arm;
use delta_cal::simulate::{random_pose, simulate_sample};
use delta_cal::{Noise, Robot, Sample};
use delta_cal_host::{Frame, InputText, Options, RobotFile, calibrate, read_samples};
use delta_cal_tests::{Spread, paper_robot, uniform};
use nalgebra::{Rotation3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::fmt::Write;

/// Every length off by up to `length` mm and every angle by up to `degrees`.
fn perturbed(robot: &Robot<f64>, length: f64, degrees: f64, rng: &mut Pcg32) -> Robot<f64> {
    delta_cal_tests::perturbed(robot, length, degrees.to_radians(), Spread::Uniform, rng)
}

/// One run: a robot file, measurements in mm and degrees as they are written, and the header.
struct Case {
    file: Robot<f64>,
    rows: Vec<([f64; 3], Vector3<f64>)>,
    angles: &'static str,
    lengths: &'static str,
    options: Options,
    tolerance: bool,
    /// The stated σ of the positions.
    noise: Option<f64>,
}

impl Case {
    fn robot_file(&self) -> RobotFile {
        let mut text = String::new();
        for arm in self.file.arms() {
            text.push_str("[[arm]]\n");
            for (index, key) in crate::support::KEYS.iter().enumerate() {
                let value = arm.parameters()[index];
                let value = if index == 3 || index == 4 {
                    value.to_degrees()
                } else {
                    value
                };
                writeln!(text, "{key} = {value:?}").unwrap();
            }
        }
        text.push_str("[joints]\nmin_deg = -60\nmax_deg = 90\n");
        if self.tolerance {
            text.push_str("[tolerance]\nlength_mm = 0.6\nangle_deg = 0.2\n");
        }
        if let Some(sigma) = self.noise {
            writeln!(text, "[noise]\nposition_mm = {sigma}\njoint_deg = 0.002").unwrap();
        }
        RobotFile::read(&InputText::new("robot.toml", &text)).unwrap()
    }

    /// All that is said of the file as a whole; none if nothing is.
    fn diagnosis(&self) -> Option<String> {
        let (q, l) = (self.angles, self.lengths);
        let mut text = format!("q1_{q},q2_{q},q3_{q},x_{l},y_{l},z_{l}\n");
        for ([q1, q2, q3], x) in &self.rows {
            writeln!(text, "{q1},{q2},{q3},{},{},{}", x.x, x.y, x.z).unwrap();
        }
        let robot = self.robot_file();
        let input = InputText::new("samples.csv", &text);
        let readings = match read_samples(&input, &robot, &self.options) {
            Ok(readings) => readings,
            Err(error) => return error.remedy(),
        };
        let diagnosis = match calibrate(&robot, &readings, &self.options) {
            Ok(report) => report.diagnosis,
            Err(error) => error.diagnosis().cloned(),
        };
        diagnosis.map(|diagnosis| diagnosis.to_string())
    }
}

/// Every way to calibrate, one after the other.
fn case(robot: u64, frame: Option<Frame>) -> (Case, Pcg32) {
    let mut rng = Pcg32::seed_from_u64(0xd1a6 ^ (robot << 20));
    let file = paper_robot();
    let truth = perturbed(&file, 1.0, 0.3, &mut rng);
    let noise = Noise::new(0.02, 0.002_f64.to_radians()).unwrap();
    let limits = JointLimits::new((-60_f64).to_radians(), 90_f64.to_radians()).unwrap();
    let count = [8, 12, 20, 60][usize::try_from(robot % 4).unwrap()];
    let mut samples: Vec<Sample<f64>> = (0..count)
        .map(|_| {
            let pose = random_pose(&truth, &limits, &mut rng).unwrap();
            simulate_sample(&truth, &pose.joints, Some(&noise), &mut rng).unwrap()
        })
        .collect();
    let way = robot / 4;
    let frame = frame.unwrap_or(if way % 3 == 2 {
        Frame::Sensor
    } else {
        Frame::Base
    });
    if frame == Frame::Sensor {
        let rotation = Rotation3::from_euler_angles(
            3.0 * uniform(&mut rng),
            uniform(&mut rng),
            3.0 * uniform(&mut rng),
        );
        for sample in &mut samples {
            sample.position = rotation * sample.position + Vector3::new(900.0, -400.0, 300.0);
        }
    }
    let case = Case {
        file,
        rows: samples
            .iter()
            .map(|sample| (sample.joints.map(f64::to_degrees), sample.position))
            .collect(),
        angles: "deg",
        lengths: "mm",
        options: Options {
            frame,
            ..Options::default()
        },
        tolerance: (way / 2).is_multiple_of(2),
        noise: (way / 3).is_multiple_of(2).then_some(0.02),
    };
    (case, rng)
}

type Change = fn(&mut Case, &mut Pcg32);
/// A fault, the frames in which it shows, how it is made, and what must be said of it.
type Fault = (&'static str, Option<Frame>, Change, &'static [&'static str]);

fn changed(robot: &Robot<f64>, mut change: impl FnMut(usize, &mut [f64; 8])) -> Robot<f64> {
    let mut index = 0;
    let arms = robot.arms().map(|arm| {
        let mut parameters = arm.parameters();
        change(index, &mut parameters);
        index += 1;
        Arm::new(parameters).unwrap()
    });
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

const FAULTS: &[Fault] = &[
    (
        "q1 and q2 exchanged",
        None,
        |case, _| joints(case, |q| q.swap(0, 1)),
        &["q1_deg and q2_deg, or arm 1 and arm 2, are exchanged"],
    ),
    (
        "q1, q2, q3 in turn",
        Some(Frame::Base),
        |case, _| joints(case, |q| q.rotate_left(1)),
        &["joints 1, 2, 3 are in q3_deg, q1_deg and q2_deg"],
    ),
    (
        "sign of q2",
        None,
        |case, _| joints(case, |q| q[1] = -q[1]),
        &["the sign of the joint angles in q2_deg is wrong"],
    ),
    (
        "signs of all joints",
        None,
        |case, _| joints(case, |q| *q = q.map(|q| -q)),
        &["all joint angles have the wrong sign"],
    ),
    (
        "radians as degrees",
        None,
        |case, _| joints(case, |q| *q = q.map(f64::to_radians)),
        &["are radians, and the header says degrees"],
    ),
    (
        "degrees as radians",
        None,
        |case, _| case.angles = "rad",
        &["are degrees, and the header says radians"],
    ),
    (
        "metres as millimetres",
        None,
        |case, _| positions(case, |x| *x /= 1000.0),
        &["the positions are metres, and the header says millimetres"],
    ),
    (
        "millimetres as metres",
        None,
        |case, _| case.lengths = "m",
        &["the positions are millimetres, and the header says metres"],
    ),
    (
        "inches as millimetres",
        None,
        |case, _| positions(case, |x| *x /= 25.4),
        &["the positions are inches"],
    ),
    (
        "mirrored, x",
        Some(Frame::Base),
        |case, _| positions(case, |x| x.x = -x.x),
        &["x has the wrong sign, so the frame is mirrored (left-handed)"],
    ),
    (
        "mirrored tracker",
        Some(Frame::Sensor),
        |case, _| positions(case, |x| x.z = -x.z),
        &["the sensor's frame is mirrored (left-handed)"],
    ),
    (
        "upside down",
        Some(Frame::Base),
        |case, _| positions(case, |x| (x.y, x.z) = (-x.y, -x.z)),
        &["half a turn about x, upside down"],
    ),
    (
        "x and y exchanged",
        Some(Frame::Base),
        |case, _| positions(case, |x| (x.x, x.y) = (x.y, x.x)),
        &["the robot's x, y, z are y, x, z of the positions, so the frame is mirrored"],
    ),
    (
        "x, y, z in turn",
        Some(Frame::Base),
        |case, _| positions(case, |x| *x = Vector3::new(x.z, x.x, x.y)),
        &["the robot's x, y, z are y, z, x of the positions, so the frame is turned"],
    ),
    (
        "tracker's own frame",
        Some(Frame::Sensor),
        |case, _| case.options.frame = Frame::Base,
        &["the positions are in another frame than the robot's"],
    ),
    (
        "tracker's frame, mirrored",
        Some(Frame::Sensor),
        |case, _| {
            case.options.frame = Frame::Base;
            positions(case, |x| x.x = -x.x);
        },
        &["left-handed", "another frame than the robot's"],
    ),
    (
        "one joint in radians",
        None,
        |case, _| joints(case, |q| q[2] = q[2].to_radians()),
        &["the joint angles in q3_deg are radians"],
    ),
    (
        "lengths of two arms",
        Some(Frame::Base),
        |case, _| {
            // The true robot has the longer parts in arm 2, the file in arm 3.
            case.file = changed(&case.file, |index, parameters| {
                if index == 2 {
                    parameters[5] += 6.0;
                    parameters[7] += 15.0;
                }
            });
            let longer = changed(&paper_robot(), |index, parameters| {
                if index == 1 {
                    parameters[5] += 6.0;
                    parameters[7] += 15.0;
                }
            });
            let original = paper_robot();
            for (q, x) in &mut case.rows {
                let q = q.map(f64::to_radians);
                let moved = longer.forward(&q).unwrap() - original.forward(&q).unwrap();
                *x += moved;
            }
        },
        &["forearms of arm 2 and arm 3 are exchanged"],
    ),
    (
        "positions one row above their joints",
        None,
        |case, _| {
            let positions: Vec<_> = case.rows.iter().map(|(_, x)| *x).collect();
            let count = positions.len();
            for (index, (_, x)) in case.rows.iter_mut().enumerate() {
                *x = positions[(index + 1) % count];
            }
        },
        &["one row above the joints"],
    ),
    (
        "metres, q2 and q3 exchanged",
        None,
        |case, _| {
            joints(case, |q| q.swap(1, 2));
            positions(case, |x| *x /= 1000.0);
        },
        &[
            "q2_deg and q3_deg, or arm 2 and arm 3, are exchanged",
            "the positions are metres",
        ],
    ),
    (
        "radians, metres",
        None,
        |case, _| {
            joints(case, |q| *q = q.map(f64::to_radians));
            positions(case, |x| *x /= 1000.0);
        },
        &["are radians", "the positions are metres"],
    ),
];

const RIGHT: &[(&str, Change)] = &[("right", |_, _| {})];

/// Files that are right as a whole with wrong rows or a wrong robot, or wrong beyond explanation.
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
    ("noise 50 times the stated", |case, rng| {
        for (_, x) in &mut case.rows {
            *x += Vector3::from_fn(|_, _| uniform(rng) * 3f64.sqrt());
        }
    }),
    ("robot 10 mm and 3° off", |case, rng| {
        case.file = perturbed(&case.file, 10.0, 3.0, rng);
    }),
    ("forearm 2 60 mm too long", |case, _| {
        case.file = changed(&case.file, |index, parameters| {
            parameters[7] += if index == 1 { 60.0 } else { 0.0 };
        });
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
        let positions: Vec<_> = case.rows.iter().map(|(_, x)| *x).collect();
        let count = positions.len();
        for (index, (_, x)) in case.rows.iter_mut().enumerate() {
            *x = positions[(index + count / 2) % count];
        }
    }),
    ("numbers without meaning", |case, rng| {
        for (_, x) in &mut case.rows {
            *x = Vector3::from_fn(|_, _| 300.0 * uniform(rng)) - Vector3::z() * 400.0;
        }
    }),
];

/// Robots with every way to calibrate: numbers of samples, frames, with and without a tolerance and a noise.
const ROBOTS: u64 = 240;
/// For each fault.
const SOME: u64 = 12;

/// The robots `0, 7, 14, …`: few of them still meet every way to calibrate; the next fault gets the next ones.
fn robots(fault: usize) -> impl Iterator<Item = u64> {
    let first = SOME * fault as u64;
    (first..first + SOME).map(|index| 7 * index % ROBOTS)
}

#[test]
fn faults_of_whole_files_are_named() {
    let mut unnamed = Vec::new();
    for (place, (name, frame, change, expected)) in FAULTS.iter().enumerate() {
        let named = robots(place).filter(|robot| {
            let (mut case, mut rng) = case(*robot, *frame);
            change(&mut case, &mut rng);
            let said = case.diagnosis();
            said.is_some_and(|said| expected.iter().all(|part| said.contains(part)))
        });
        let named = named.count() as u64;
        if 100 * named < 90 * SOME {
            unnamed.push(format!("{name}: {named} of {SOME}"));
        }
    }
    assert!(unnamed.is_empty(), "{unnamed:#?}");
}

fn accused(others: &[(&'static str, Change)]) -> Vec<String> {
    let mut accused = Vec::new();
    for (place, (name, change)) in others.iter().enumerate() {
        let given = robots(place).filter(|robot| {
            let (mut case, mut rng) = case(*robot, None);
            change(&mut case, &mut rng);
            case.diagnosis().is_some()
        });
        let given = given.count();
        if given > 0 {
            accused.push(format!("{name}: {given} of {SOME}"));
        }
    }
    accused
}

#[test]
fn nothing_is_said_of_files_that_are_right_or_wrong_otherwise() {
    assert_eq!(accused(RIGHT), Vec::<String>::new());
    assert_eq!(accused(OTHERS), Vec::<String>::new());
}
