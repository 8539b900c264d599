//! The faults of whole files, with what must be said of each, and changes of which nothing may be said.

use super::case::{Case, perturbed};
use delta_cal::Robot;
use delta_cal::robot::Arm;
use delta_cal_host::Frame;
use delta_cal_tests::{paper_robot, uniform};
use nalgebra::Vector3;
use rand_core::Rng;
use rand_pcg::Pcg32;

pub(super) type Change = fn(&mut Case, &mut Pcg32);
/// A fault, the frames in which it shows, how it is made, and what must be said of it.
pub(super) type Fault = (&'static str, Option<Frame>, Change, &'static [&'static str]);

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

pub(super) const FAULTS: &[Fault] = &[
    (
        "q1 and q2 exchanged",
        None,
        |case, _| joints(case, |q| q.swap(0, 1)),
        &["q1_deg and q2_deg, or arm 1 and arm 2, are exchanged"],
    ),
    (
        "q2 and q3 exchanged",
        None,
        |case, _| joints(case, |q| q.swap(1, 2)),
        &["q2_deg and q3_deg, or arm 2 and arm 3, are exchanged"],
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
        "mirrored, z",
        Some(Frame::Base),
        |case, _| positions(case, |x| x.z = -x.z),
        &["z has the wrong sign, so the frame is mirrored (left-handed)"],
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
        "y and z exchanged",
        Some(Frame::Base),
        |case, _| positions(case, |x| (x.y, x.z) = (x.z, x.y)),
        &["the robot's x, y, z are x, z, y of the positions, so the frame is mirrored"],
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
        "signs of all joints, inches",
        None,
        |case, _| {
            joints(case, |q| *q = q.map(|q| -q));
            positions(case, |x| *x /= 25.4);
        },
        &[
            "all joint angles have the wrong sign",
            "the positions are inches",
        ],
    ),
    (
        "sign of q1, mirrored y",
        Some(Frame::Base),
        |case, _| {
            joints(case, |q| q[0] = -q[0]);
            positions(case, |x| x.y = -x.y);
        },
        &["in q1_deg is wrong", "y has the wrong sign"],
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

pub(super) const RIGHT: &[(&str, Change)] = &[("right", |_, _| {})];

/// Files that are right as a whole with wrong rows or a wrong robot, or wrong beyond explanation.
pub(super) const OTHERS: &[(&str, Change)] = &[
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
            *x = positions[(index + 1) % count];
        }
    }),
    ("numbers without meaning", |case, rng| {
        for (_, x) in &mut case.rows {
            *x = Vector3::from_fn(|_, _| 300.0 * uniform(rng)) - Vector3::z() * 400.0;
        }
    }),
];
