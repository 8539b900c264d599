//! Faults of any size are named: kind, arm, line and size; clean files have none.

use crate::support::simulated::{Instrument, Promise, SIGMAS, anchor, file_of, measured};
use delta_cal::Robot;
use delta_cal_host::accuracy::budget::Contribution;
use delta_cal_host::files::robot_file::KnownPlane;
use delta_cal_host::validation::{Request, Verdict, validate};
use delta_cal_host::{Frame, Options, Reading, ReadingFrom, Readings, RobotFile, calibrate};
use delta_cal_tests::geometries::geometries;
use delta_cal_tests::size;
use nalgebra::{Rotation3, Vector3};

const ROWS: usize = 31;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// Of one joint, degrees, from a row on.
    Slip(f64),
    /// mm, and degrees.
    Move(f64, f64),
    /// Degrees either way, of one joint or of all.
    Backlash(f64, bool),
    Gear(f64),
    /// Degrees.
    Eccentric(f64),
    /// Degrees.
    TwiceATurn(f64),
    /// mm at the largest radius.
    Sag(f64),
    /// mm over all rows, and how many time constants they take; 0 if it is even.
    Drift(f64, f64),
    Scale(f64),
    /// Every third row by so many mm.
    Rows(f64),
}

/// Adds a fault to positions; returns the joint that it concerns and its row.
fn spoilt(readings: &mut Readings, fault: Fault, seed: usize) -> (usize, usize) {
    let rows = readings.rows.len();
    let (joint, from) = (seed % 3, (8 + 3 * (seed % 6)) * rows / ROWS);
    let mut before: Option<[f64; 3]> = None;
    let mut directions = [1.0; 3];
    let largest = readings
        .samples()
        .map(|row| row.value.position.xy().norm_squared());
    let largest = largest.fold(0.0, f64::max);
    for (index, row) in readings.rows.iter_mut().enumerate() {
        let own = &mut row.value;
        let last = before.replace(own.joints).unwrap_or(own.joints);
        for axis in 0..3 {
            if (own.joints[axis] - last[axis]).abs() > 0.0 {
                directions[axis] = (own.joints[axis] - last[axis]).signum();
            }
        }
        let mut x = Vector3::from(own.position.map(Option::unwrap));
        let q = &mut own.joints;
        match fault {
            Fault::Slip(by) if index >= from => q[joint] -= by.to_radians(),
            Fault::Backlash(by, all) => {
                for axis in (0..3).filter(|axis| all || *axis == joint) {
                    q[axis] -= directions[axis] * by.to_radians();
                }
            }
            Fault::Gear(by) => q[joint] /= 1.0 + by,
            Fault::Eccentric(by) | Fault::TwiceATurn(by) => {
                let times = if matches!(fault, Fault::Eccentric(_)) {
                    1.0
                } else {
                    2.0
                };
                // The error is a function of what the encoder reads.
                let angle = q[joint];
                for _ in 0..20 {
                    q[joint] = angle - by.to_radians() * (times * q[joint] + 0.7).cos();
                }
            }
            Fault::Move(by, turn) if index >= from => {
                let axis = Vector3::new(0.48, -0.6, 0.64);
                let turned = Rotation3::new(axis * turn.to_radians());
                x = turned * (x - Vector3::new(0.0, 0.0, -500.0)) + Vector3::new(0.0, 0.0, -500.0);
                x += Vector3::new(0.6, 0.64, 0.48) * by;
            }
            Fault::Sag(by) => x.z -= by * x.xy().norm_squared() / largest,
            Fault::Drift(by, constants) => {
                let even = index as f64 / rows as f64;
                let slower = -(-constants * even).exp_m1();
                let part = if constants > 0.0 { slower } else { even };
                x += Vector3::new(0.6, 0.64, 0.48) * by * part;
            }
            Fault::Scale(by) => x *= 1.0 + by,
            Fault::Rows(by) if index % 3 == seed % 3 => {
                let turn = (index * 7 % 11) as f64;
                x += Vector3::new(turn.cos(), turn.sin(), 0.3) * by;
            }
            _ => {}
        }
        own.position = x.data.0[0].map(Some);
    }
    (joint, from)
}

/// What a calibration says; how many rows it suspects, `None` if it is refused.
fn said(robot: &RobotFile, readings: &Readings, options: Options) -> (String, Option<usize>) {
    match calibrate(robot, readings, &options) {
        Ok(report) => {
            let suspected = report.suspected_samples.len();
            (report.warnings.join(" "), Some(suspected))
        }
        Err(error) => (
            format!("{error} {}", error.remedy().unwrap_or_default()),
            None,
        ),
    }
}

fn nominal(geometry: usize) -> RobotFile {
    let (_, nominal) = geometries().swap_remove(geometry);
    file_of(&nominal, [-60.0, 75.0].map(f64::to_radians), true)
}

/// Where the noise of positions is stated.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Noise {
    InTheFile,
    InEachRow,
    Nowhere,
}

const NOISES: [Noise; 3] = [Noise::InTheFile, Noise::Nowhere, Noise::InEachRow];

fn made(
    (geometry, rows): (usize, usize),
    frame: Frame,
    seed: usize,
    noise: Noise,
) -> (RobotFile, Readings, Robot<f64>) {
    let mut robot = nominal(geometry);
    let instrument = match frame {
        Frame::Base => Instrument::Positions,
        Frame::Sensor => Instrument::Tracker,
    };
    let (truth, mut readings) = measured(&robot, instrument, rows, seed as u64);
    match noise {
        Noise::InTheFile => {}
        Noise::InEachRow => {
            for (index, row) in readings.rows.iter_mut().enumerate() {
                row.value.sigma = Some([0.9, 1.0, 1.1][index % 3] * SIGMAS[0]);
            }
        }
        Noise::Nowhere => robot.noise = None,
    }
    (robot, readings, truth)
}

/// The words for a fault, of which one must be said.
fn words(fault: Fault, (joint, from): (usize, usize)) -> Vec<String> {
    let (arm, line) = (joint + 1, from + 2);
    match fault {
        Fault::Slip(_) => vec![format!("arm {arm}: the joint zero jumps")],
        Fault::Move(..) => vec![format!("from line {line} on, the positions are moved")],
        Fault::Backlash(..) => vec![format!(
            "arm {arm}: the joint's error changes with the direction"
        )],
        Fault::Gear(_) => vec![
            format!("arm {arm}: the joint turns"),
            format!("gear ratio of arm {arm}"),
            format!("arm {arm}: the joint has an error that repeats"),
        ],
        Fault::Eccentric(_) => vec![
            format!("arm {arm}: the joint has an error that repeats"),
            format!("arm {arm}: the joint turns"),
        ],
        // Or listed as an alternative that is about as likely.
        Fault::TwiceATurn(_) => vec![
            format!("arm {arm}: the joint has an error that repeats twice a turn"),
            format!("an error twice a turn of arm {arm}"),
        ],
        Fault::Sag(_) => vec!["the platform is lower".to_owned()],
        Fault::Drift(..) => vec!["drift".to_owned()],
        Fault::Scale(_) => vec!["lengths are".to_owned()],
        Fault::Rows(_) => vec!["agree, all but".to_owned(), "disagree".to_owned()],
    }
}

/// What is not said beside it: play of another joint, the row before which no joint had moved, the base as it was half-way.
fn besides(fault: Fault, (joint, _): (usize, usize)) -> Vec<String> {
    match fault {
        Fault::Backlash(_, all) => (1..4)
            .filter(|arm| !all && *arm != joint + 1)
            .map(|arm| format!("arm {arm}: the joint's error"))
            .chain(["line 2 disagrees".to_owned()])
            .collect(),
        Fault::Drift(_, constants) if constants > 0.0 => vec!["are moved".to_owned()],
        Fault::Drift(..) => vec!["beside the platform point".to_owned()],
        _ => Vec::new(),
    }
}

const FAULTS: [Fault; 25] = [
    Fault::Slip(0.05),
    Fault::Slip(0.5),
    Fault::Slip(5.0),
    Fault::Slip(30.0),
    Fault::Move(0.5, 0.0),
    Fault::Move(20.0, 1.0),
    Fault::Move(200.0, 20.0),
    Fault::Backlash(0.02, false),
    Fault::Backlash(0.1, true),
    Fault::Backlash(0.5, false),
    Fault::Gear(2e-3),
    Fault::Gear(5e-3),
    Fault::Gear(2e-2),
    Fault::Eccentric(0.1),
    Fault::Eccentric(2.0),
    Fault::TwiceATurn(0.03),
    Fault::Sag(0.5),
    Fault::Sag(5.0),
    Fault::Drift(0.4, 0.0),
    Fault::Drift(3.0, 3.0),
    Fault::Scale(5e-3),
    Fault::Scale(-2e-2),
    Fault::Scale(5e-2),
    Fault::Rows(5.0),
    Fault::Rows(50.0),
];
const IN_ROWS: [(usize, Fault); 17] = [
    (8, Fault::Slip(5.0)),
    (8, Fault::Move(30.0, 0.0)),
    (8, Fault::Gear(2e-2)),
    (12, Fault::Slip(0.8)),
    (12, Fault::Move(5.0, 0.0)),
    (12, Fault::Scale(2e-2)),
    (12, Fault::Drift(2.0, 0.0)),
    (15, Fault::Slip(0.2)),
    (15, Fault::Backlash(0.2, false)),
    (18, Fault::Gear(1e-2)),
    (18, Fault::Eccentric(0.5)),
    (21, Fault::TwiceATurn(0.2)),
    (24, Fault::Sag(2.0)),
    (24, Fault::Move(1.0, 0.0)),
    (1000, Fault::Slip(0.02)),
    (1000, Fault::Backlash(0.01, false)),
    (1000, Fault::Drift(0.2, 0.0)),
];

/// What a message says that names any fault.
const OTHERS: [&str; 10] = [
    "jumps",
    "are moved",
    "direction",
    "the joint turns",
    "repeats",
    "is lower",
    "drift",
    "engths are",
    "disagree",
    "off by",
];

/// Where it is not named, hardly ever another one is alone. In the base frame, and of the faults that do not depend on one
/// every fourth in a sensor's. With `--robust` none is taken for wrong rows. The long campaign states the noise of each in the
/// file, in each row and nowhere.
#[test]
fn faults_of_any_size_are_named() {
    let count = size(1, 20);
    let (mut missed, mut tried, mut alone) = (Vec::new(), 0, 0);
    let faults = FAULTS.map(|own| (ROWS, own)).into_iter().chain(IN_ROWS);
    for (index, (rows, fault)) in faults.enumerate() {
        let noises = NOISES.into_iter();
        for noise in noises.filter(|noise| count > 1 || *noise == NOISES[index % 3]) {
            let (mut named, mut robust) = (0, 0);
            for seed in 0..count {
                let frame = match fault {
                    Fault::Sag(_) | Fault::Move(..) => Frame::Base,
                    _ if (index + seed) % 4 == 3 => Frame::Sensor,
                    _ => Frame::Base,
                };
                let (robot, mut readings, _) = made((seed % 5, rows), frame, seed, noise);
                let at = spoilt(&mut readings, fault, seed);
                let words = words(fault, at).into_iter().map(|own| own.to_lowercase());
                let words: Vec<_> = words.collect();
                let besides = besides(fault, at);
                let mut options = Options::in_frame(frame);
                let (text, accepted) = said(&robot, &readings, options);
                // A size within reach of the instrument's scale is not stated as the robot's.
                let scale = matches!(fault, Fault::Scale(_));
                assert!(!(scale && accepted.is_some()), "{fault:?}: {text}");
                let alternatives: Vec<_> = text
                    .split(" well: ")
                    .flat_map(|own| own.split("; or "))
                    .collect();
                let twice = |own: &[&str]| own[1].starts_with(own[0]);
                assert!(!alternatives.windows(2).any(twice), "{fault:?}: {text}");
                let is_named = |text: &str| {
                    let text = text.to_lowercase();
                    let said = |own: &String| text.contains(own);
                    words.iter().any(said) && !besides.iter().any(said)
                };
                tried += 1;
                if is_named(&text) {
                    named += 1;
                } else {
                    let several = text.contains("equally well") || text.contains("likely");
                    let other = !several && OTHERS.iter().any(|own| text.contains(own));
                    alone += usize::from(other);
                    println!(
                        "  {fault:?}, {rows} rows, noise {noise:?} seed {seed} at {at:?}: {text}"
                    );
                }
                // The short campaign has one size of most.
                let skipped =
                    count == 1 && index % 4 != 0 && !matches!(fault, Fault::TwiceATurn(_));
                if skipped || rows != ROWS || matches!(fault, Fault::Rows(_)) {
                    robust += 1;
                    continue;
                }
                options.robust = true;
                let (text, suspected) = said(&robot, &readings, options);
                robust += usize::from(suspected.is_some_and(|own| own < 3) || is_named(&text));
            }
            println!("{rows} rows, {fault:?}, noise {noise:?}: {named} and {robust} of {count}");
            if 10 * named.min(robust) < 9 * count {
                missed.push((rows, fault, noise, named, robust));
            }
        }
    }
    assert_eq!(missed, []);
    assert!(100 * alone <= tried, "{alone} of {tried}");
}

/// A large fault makes an estimated noise so large that the tolerance determines most parameters, and not the readings. Wrong
/// rows make it larger as well.
#[test]
fn a_fault_is_named_alone_where_the_noise_is_estimated() {
    let all = [
        (Fault::Slip(30.0), "the joint zero jumps", "disagree"),
        (Fault::Rows(5.0), "disagree", "the joint zero jumps"),
    ];
    let count = size(8, 60);
    let several = (0..count).filter(|seed| {
        let (robot, mut readings, _) = made((seed % 4, ROWS), Frame::Base, *seed, Noise::Nowhere);
        let (fault, expected, other) = all[seed % 2];
        spoilt(&mut readings, fault, *seed);
        let (text, _) = said(&robot, &readings, Options::default());
        let besides = [other, "equally well", "are moved", "drift by", "turns"];
        !text.contains(expected) || besides.iter().any(|own| text.contains(own))
    });
    let several: Vec<_> = several.collect();
    assert!(8 * several.len() <= count, "{several:?} of {count}");
}

/// The positions of all rows from one on are those of the next ones.
#[test]
fn rows_after_a_missing_one_are_said_to_be_shifted() {
    for (seed, noise) in NOISES.into_iter().take(2).enumerate() {
        let (robot, mut readings, _) = made((seed, ROWS), Frame::Base, seed, noise);
        for row in 22..ROWS - 1 {
            readings.rows[row].value.position = readings.rows[row + 1].value.position;
        }
        readings.rows.pop();
        let (text, _) = said(&robot, &readings, Options::default());
        let expected = "From line 24 each position fits the joints of the row after it";
        assert!(text.contains(expected), "{noise:?}: {text}");
    }
}

/// Each of two that happen in one file is named, in at least nine of ten.
#[test]
fn two_faults_at_once_are_both_named() {
    let faults = [
        Fault::Slip(0.5),
        Fault::Move(2.0, 0.1),
        Fault::Backlash(0.1, false),
        Fault::Gear(1e-2),
        Fault::Sag(2.0),
        Fault::Scale(2e-2),
    ];
    let pairs = (0..faults.len()).flat_map(|one| (0..one).map(move |other| [one, other]));
    let (count, mut tried, mut named) = (size(1, 20), 0, 0);
    for (index, pair) in pairs.enumerate().filter(|own| count > 1 || own.0 % 3 == 0) {
        for seed in 0..count {
            let noise = NOISES[(index + seed) % 3];
            let (robot, mut readings, _) = made((seed % 4, ROWS), Frame::Base, seed, noise);
            // Of different joints and at different rows.
            let both = [0, 1].map(|own| {
                let fault = faults[pair[own]];
                words(fault, spoilt(&mut readings, fault, seed + own))
            });
            let text = said(&robot, &readings, Options::default()).0.to_lowercase();
            let mut both = both.iter();
            tried += 1;
            if both.all(|words| words.iter().any(|own| text.contains(&own.to_lowercase()))) {
                named += 1;
            } else {
                println!(
                    "{:?}, {noise:?}, seed {seed}: {text}",
                    pair.map(|own| faults[own])
                );
            }
        }
    }
    println!("{named} of {tried}");
    assert!(10 * named >= 9 * tried, "{named} of {tried}");
}

/// Such rows are no cause: beside one, nothing else says what they are.
#[test]
fn wrong_rows_beside_a_cause_are_said_where_the_noise_is_estimated() {
    let causes = [Fault::Gear(1e-2), Fault::Sag(2.0), Fault::Drift(1.0, 0.0)];
    for (seed, fault) in causes.into_iter().enumerate() {
        let (robot, mut readings, _) = made((seed, ROWS), Frame::Base, seed, Noise::Nowhere);
        let words = words(fault, spoilt(&mut readings, fault, seed));
        for row in [5, 14, 22] {
            let z = &mut readings.rows[row].value.position[2];
            *z = z.map(|own| own + 6.0);
        }
        let text = said(&robot, &readings, Options::default()).0.to_lowercase();
        let is_said = words.iter().any(|own| text.contains(&own.to_lowercase()));
        let rows = text.contains("lines 7, 16 and 24 disagree with the others");
        assert!(is_said && rows, "{fault:?}: {text}");
    }
}

/// At most 2 % in the long campaign, whatever is stated and wherever the sensor stands.
#[test]
fn clean_files_have_no_fault() {
    let count = size(48, 400);
    let (mut tested, mut alarms) = (0, 0);
    for seed in 0..count {
        let frame = [Frame::Base, Frame::Sensor][seed / 2 % 2];
        let rows = match seed % 8 {
            0 | 1 => 8 + seed / 8 % 8,
            2 if seed % 5 == 0 => 1000,
            _ => 14 + 7 * seed % 47,
        };
        let of = (seed % 5, rows);
        let (mut robot, readings, _) = made(of, frame, 1000 + seed, NOISES[seed % 3]);
        robot.tolerance.take_if(|_| seed % 8 == 4);
        if let Ok(report) = calibrate(&robot, &readings, &Options::in_frame(frame)) {
            tested += usize::from(report.causes.not_tested.is_none());
            if !report.causes.found.is_empty() {
                println!("{seed}, {rows} rows: {:?}", report.causes.found);
                alarms += 1;
            }
        }
    }
    println!("{alarms} of {tested}, {count} files");
    assert!(2 * tested > count, "{tested} of {count}");
    assert!(50 * alarms <= count.max(50), "{alarms} of {count}");
}

#[test]
fn a_step_during_a_validation_is_named_and_the_rows_before_it_are_shown() {
    let request = Request {
        limit: 0.2,
        frame: Frame::Base,
        stored: false,
    };
    for (seed, fault) in [
        Fault::Slip(0.5),
        Fault::Move(0.5, 0.0),
        Fault::Move(20.0, 1.0),
    ]
    .into_iter()
    .enumerate()
    {
        for noise in NOISES {
            let (mut robot, mut readings, truth) = made((seed, ROWS), Frame::Base, seed, noise);
            robot.robot = truth;
            let clean = validate(&robot, &readings, request).unwrap();
            assert_eq!(
                (clean.verdict, clean.step),
                (Verdict::Pass, None),
                "{fault:?}"
            );
            let at = spoilt(&mut readings, fault, seed);
            let found = validate(&robot, &readings, request).unwrap();
            let step = found.step.unwrap_or_else(|| panic!("{fault:?} {noise:?}"));
            assert_eq!(found.verdict, Verdict::NotJudged);
            assert_eq!(step.line, at.1 as u64 + 2, "{fault:?}: {}", step.text);
            let words = words(fault, at).remove(0);
            assert!(
                step.text.to_lowercase().contains(&words),
                "{fault:?}: {}",
                step.text
            );
            assert_eq!(found.row_count, at.1);
            assert!(
                found.deviation_mm.rms < 0.1,
                "{fault:?}: {}",
                found.deviation_mm.rms
            );
        }
    }
}

type Change = fn(&mut Reading);

#[test]
fn a_mistake_in_all_heights_or_distances_is_named() {
    let mut robot = nominal(0);
    let (_, right) = measured(&robot, Instrument::PlateAndCalliper, 45, 1);
    robot.instruments.planes.push(KnownPlane {
        name: "p0".to_owned(),
        line: 0,
        height: -900.0,
        sigma: 3.0,
        tilt: None,
        blocks: (0..16).map(|block| 60.0 * f64::from(block)).collect(),
    });
    let changes: [(&str, Change); 7] = [
        ("the gauge blocks are missing from the heights", |own| {
            own.height = own.height.map(|(plane, by)| (plane, by.rem_euclid(60.0)));
        }),
        ("the heights above p0 fit z = -949 mm, not -900 mm", |own| {
            own.height = own.height.map(|(plane, by)| (plane, by + 50.0));
        }),
        ("the heights have the wrong sign", |own| {
            own.height = own.height.map(|(plane, by)| (plane, -by));
        }),
        ("the distances are in inches", |own| {
            own.distance = own.distance.map(|(from, by)| (from, by / 25.4));
        }),
        ("lengths are 2.0", |own| {
            own.height = own.height.filter(|_| own.distance.is_none());
            own.distance = own.distance.map(|(from, by)| (from, 0.98 * by));
        }),
        ("between two poses are longer by the same, 0.", |own| {
            own.height = own.height.filter(|_| own.distance.is_none());
            own.distance = own.distance.map(|(from, by)| (from, by + 0.5));
        }),
        ("all joint angles have the wrong sign", |own| {
            own.joints = own.joints.map(|q| -q);
            if let Some((ReadingFrom::Pose(joints), _)) = &mut own.distance {
                *joints = joints.map(|q| -q);
            }
        }),
    ];
    for (expected, change) in changes {
        let mut readings = right.clone();
        let rows = readings.rows.iter_mut();
        rows.for_each(|row| change(&mut row.value));
        let (text, accepted) = said(&robot, &readings, Options::default());
        assert!(
            accepted.is_none() && text.contains(expected),
            "{expected}: {text}"
        );
    }
}

/// The robot is where its base was at the first row: that is what its positions are known to, and a row of the budget, whose
/// parts make up the whole; further poses leave it.
#[test]
fn what_causes_do_to_positions_is_stated() {
    let mut promise = Promise::default();
    for geometry in 0..6 {
        for fault in [
            Fault::Drift(0.5, 0.0),
            Fault::Move(0.3, 0.0),
            Fault::Scale(2e-3),
        ] {
            let (robot, mut readings, truth) =
                made((geometry, 40), Frame::Base, geometry, Noise::Nowhere);
            spoilt(&mut readings, fault, geometry);
            let Ok(report) = calibrate(&robot, &readings, &Options::default()) else {
                continue;
            };
            let share =
                |part: fn(&Contribution) -> f64| report.budget.iter().map(part).sum::<f64>();
            let [absolute, relative] = [
                share(|own| own.absolute_share),
                share(|own| own.relative_share),
            ];
            assert!(
                (absolute - 1.0).abs() < 2e-3 && (relative - 1.0).abs() < 2e-3,
                "{absolute} {relative}"
            );
            let mut sources = report.budget.iter();
            let Some(causes) = sources.find(|own| own.source == "causes") else {
                continue;
            };
            let mut next = report.next_poses.iter();
            assert!(next.all(|own| own.expected_error_mm > 0.9 * causes.absolute_mm));
            promise.add(&robot, &truth, &report, 1);
        }
    }
    let (accepted, achieved) = (promise.accepted(), promise.ratios());
    println!("{accepted} accepted, achieved/stated {achieved:?}");
    assert!(
        accepted > 12 && achieved.iter().all(|own| (0.5..1.1).contains(own)),
        "{achieved:?}"
    );
}

/// A plate moves up, or the anchors of the wires aside, and the robot's poses with them.
#[test]
fn what_the_instrument_stands_on_is_named_with_line_and_size_when_it_moved() {
    let robot = nominal(0);
    for (seed, by) in [0.2, -0.2, 0.5, -0.5, 2.0, -2.0].into_iter().enumerate() {
        for (instrument, by) in [(Instrument::Plate, by), (Instrument::Wires, 3.0 * by)] {
            let (truth, mut readings) = measured(&robot, instrument, 45, seed as u64);
            for row in readings.rows.iter_mut().skip(15 + seed) {
                let own = &mut row.value;
                own.height = own.height.map(|(plane, height)| (plane, height + by));
                if let Some((ReadingFrom::Point(point), distance)) = &mut own.distance {
                    let x = truth.forward(&own.joints).unwrap();
                    let anchor = anchor(&truth, *point);
                    let aside = Vector3::new(by, 0.0, 0.0);
                    *distance += (x - anchor - aside).norm() - (x - anchor).norm();
                }
            }
            let (said, _) = said(&robot, &readings, Options::default());
            let (before, after) = match instrument {
                Instrument::Plate => ("all heights are off by ", ' '),
                _ => (
                    "the points from which distances are measured are moved by (",
                    ',',
                ),
            };
            let told = |before: &str, after: char| {
                let rest = said
                    .split_once(before)
                    .and_then(|(_, own)| own.split_once(after));
                let number = rest.and_then(|(own, _)| own.parse::<f64>().ok());
                number.unwrap_or_else(|| panic!("{by} {instrument:?}: {said}"))
            };
            // A wire does not show which of the rows around it was the first.
            let line = told("rom line ", ' ') - (17 + seed) as f64;
            assert!(line.abs() <= 2.0, "{by} {instrument:?}: {said}");
            let size = told(before, after);
            let off = if after == ',' {
                size - by
            } else {
                size - by.abs()
            };
            assert!(off.abs() < 0.1, "{by} {instrument:?}: {said}");
        }
    }
}

/// The file's forearms are 1.2 % too long: the robot can have such forearms, so they are named and no scale error is.
#[test]
fn a_wrong_length_of_the_file_is_named_and_no_cause() {
    let mut named = 0;
    for geometry in 0..6 {
        let (mut file, readings, _) = made((geometry, 40), Frame::Base, geometry, Noise::InTheFile);
        let mut parameters = file.robot.parameters();
        for arm in &mut parameters {
            arm[7] *= 1.012;
        }
        file.robot = file.robot.with_parameters(parameters).unwrap();
        let (text, accepted) = said(&file, &readings, Options::default());
        let own = text.contains("the forearms are");
        named += usize::from(own);
        // With forearms hardly longer than the upper arms, the size explains it as well, and it is refused.
        assert!(own || accepted.is_none(), "{geometry}: {text}");
        assert!(
            !text.contains("cannot represent this error"),
            "{geometry}: {text}"
        );
    }
    assert!(named >= 5, "{named}");
}
