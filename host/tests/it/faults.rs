//! Faults of any size are named: kind, arm, line and size; clean files have none.

use crate::support::simulated::{Instrument, file_of, measured};
use delta_cal::Robot;
use delta_cal_host::validation::{Request, Verdict, validate};
use delta_cal_host::{Frame, Options, Readings, RobotFile, calibrate};
use delta_cal_tests::geometries::geometries;
use nalgebra::{Rotation3, Vector3};

const ROWS: usize = 31;

fn number(index: usize) -> f64 {
    f64::from(u32::try_from(index).unwrap())
}

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
    /// mm at the largest radius.
    Sag(f64),
    /// mm over all rows.
    Drift(f64),
    Scale(f64),
    /// Every third row by so many mm.
    Rows(f64),
}

/// Adds a fault to readings in the base frame; returns the joint that it concerns and its row.
fn spoilt(readings: &mut Readings, fault: Fault, seed: usize) -> (usize, usize) {
    let (joint, from) = (seed % 3, 8 + 3 * (seed % 6));
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
            Fault::Eccentric(by) => {
                // The error is a function of what the encoder reads.
                let angle = q[joint];
                for _ in 0..20 {
                    q[joint] = angle - by.to_radians() * (q[joint] + 0.7).cos();
                }
            }
            Fault::Move(by, turn) if index >= from => {
                let axis = Vector3::new(0.48, -0.6, 0.64);
                let turned = Rotation3::new(axis * turn.to_radians());
                x = turned * (x - Vector3::new(0.0, 0.0, -500.0)) + Vector3::new(0.0, 0.0, -500.0);
                x += Vector3::new(0.6, 0.64, 0.48) * by;
            }
            Fault::Sag(by) => x.z -= by * x.xy().norm_squared() / largest,
            Fault::Drift(by) => {
                x += Vector3::new(0.6, 0.64, 0.48) * by * number(index) / number(ROWS);
            }
            Fault::Scale(by) => x *= 1.0 + by,
            Fault::Rows(by) if index % 3 == seed % 3 => {
                let turn = number(index * 7 % 11);
                x += Vector3::new(turn.cos(), turn.sin(), 0.3) * by;
            }
            _ => {}
        }
        own.position = x.data.0[0].map(Some);
    }
    (joint, from)
}

/// What a calibration says: kinds with arm and line, and text.
fn said(robot: &RobotFile, readings: &Readings, frame: Frame) -> String {
    match calibrate(robot, readings, &Options::in_frame(frame)) {
        Ok(report) => report.warnings.join(" "),
        Err(error) => format!("{error} {}", error.remedy().unwrap_or_default()),
    }
}

fn made(geometry: usize, seed: usize, noise: bool) -> (RobotFile, Readings, Robot<f64>) {
    let (_, nominal) = geometries().swap_remove(geometry);
    let mut robot = file_of(&nominal, [-60.0, 75.0].map(f64::to_radians), true);
    let (truth, readings) = measured(&robot, Instrument::Positions, ROWS, seed as u64);
    if !noise {
        robot.noise = None;
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
        Fault::Sag(_) => vec!["the platform is lower".to_owned()],
        Fault::Drift(_) => vec!["drift".to_owned()],
        Fault::Scale(_) => vec!["lengths are".to_owned()],
        Fault::Rows(_) => vec!["agree, all but".to_owned(), "disagree".to_owned()],
    }
}

#[test]
fn faults_of_any_size_are_named() {
    let faults = [
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
        Fault::Gear(5e-3),
        Fault::Gear(2e-2),
        Fault::Eccentric(0.1),
        Fault::Eccentric(2.0),
        Fault::Sag(0.5),
        Fault::Sag(5.0),
        Fault::Drift(0.4),
        Fault::Drift(3.0),
        Fault::Scale(1e-2),
        Fault::Scale(5e-2),
        Fault::Rows(5.0),
        Fault::Rows(50.0),
    ];
    let count = delta_cal_tests::size(1, 20);
    let mut missed = Vec::new();
    let long = count > 1;
    for (index, fault) in faults.into_iter().enumerate() {
        // Otherwise every second fault has its noise stated.
        for noise in [true, false]
            .into_iter()
            .filter(|noise| long || *noise == (index % 2 == 0))
        {
            let mut named = 0;
            for seed in 0..count {
                let (robot, mut readings, _) = made(seed % 4, seed, noise);
                let at = spoilt(&mut readings, fault, seed);
                let text = said(&robot, &readings, Frame::Base).to_lowercase();
                if words(fault, at)
                    .iter()
                    .any(|own| text.contains(&own.to_lowercase()))
                {
                    named += 1;
                } else if seed < 3 {
                    println!("  {fault:?} noise {noise} seed {seed} at {at:?}: {text}");
                }
            }
            println!("{fault:?}, noise stated {noise}: {named} of {count}");
            if 10 * named < 9 * count {
                missed.push((fault, noise, named));
            }
        }
    }
    assert_eq!(missed, []);
}

#[test]
fn clean_files_have_no_fault() {
    let count = delta_cal_tests::size(40, 400);
    let mut alarms = 0;
    for seed in 0..count {
        let (robot, readings, _) = made(seed % 5, 1000 + seed, seed % 2 == 0);
        let report = calibrate(&robot, &readings, &Options::default());
        if let Ok(report) = report
            && !report.causes.found.is_empty()
        {
            println!("{seed}: {:?}", report.causes.found);
            alarms += 1;
        }
    }
    println!("{alarms} of {count}");
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
        for noise in [true, false] {
            let (mut robot, mut readings, truth) = made(seed, seed, noise);
            robot.robot = truth;
            let clean = validate(&robot, &readings, request).unwrap();
            assert_eq!(
                (clean.verdict, clean.step),
                (Verdict::Pass, None),
                "{fault:?}"
            );
            let at = spoilt(&mut readings, fault, seed);
            let found = validate(&robot, &readings, request).unwrap();
            let step = found.step.unwrap_or_else(|| panic!("{fault:?} {noise}"));
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
