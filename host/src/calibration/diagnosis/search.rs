//! Looks for the faults that explain the samples.

use super::evidence::{Evidence, Scored, calibrated};
use super::explanation::{Diagnosis, DiagnosisEvidence, Explanation};
use super::hypothesis::{AngleUnit, Fault};
use super::words::Words;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::options::{Frame, Options};

/// A fit without a guess explains the samples if it is this many times nearer…
const CLEARLY: f64 = 4.0;
/// …and leaves no more than this part of the forearm.
const FITS: f64 = 0.01;
/// No robot has forearms below this, mm: then the file's lengths are in a larger unit.
const LEAST_FOREARM: f64 = 10.0;

/// Of samples that are in a file, whether a calibration accepts them or not; `None` if nothing is
/// wrong with the file as a whole, or no fault explains what is.
pub(crate) fn diagnose(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Option<Diagnosis> {
    let evidence = Evidence::new(robot, samples, options)?;
    let as_they_are = evidence.median(&[]);
    let found = evidence.explanations(as_they_are);
    let (as_they_are, kind, found) = if found.is_empty() && options.no_guess {
        let (as_they_are, found) = by_fits(robot, samples, options);
        (as_they_are, DiagnosisEvidence::Fit, found)
    } else {
        (as_they_are, DiagnosisEvidence::RobotFile, found)
    };
    if found.is_empty() {
        return None;
    }
    let explain = |scored: &Scored| explanation(robot, samples, options, scored);
    Some(Diagnosis {
        as_they_are,
        evidence: kind,
        explanations: found.iter().map(explain).collect(),
    })
}

fn explanation(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
    scored: &Scored,
) -> Explanation {
    let [arm, ..] = robot.robot.arms();
    let robot_in_metres = arm.lb() < LEAST_FOREARM;
    let words = Words {
        robot: &robot.name,
        samples,
        frame: if scored.faults.contains(&Fault::Elsewhere) {
            Frame::Sensor
        } else {
            options.frame
        },
        robot_in_metres,
    };
    // What is told as millimetres are the file's lengths as they stand.
    let unit = if robot_in_metres {
        of_robot(&scored.faults)
    } else {
        1.0
    };
    let all = |of: &dyn Fn(&Fault) -> String, between: &str| {
        let parts: Vec<_> = scored.faults.iter().map(of).collect();
        parts.join(between)
    };
    Explanation {
        cause: all(&|fault| words.cause(fault), " and "),
        remedy: all(&|fault| words.remedy(fault), ", and "),
        without: unit * scored.median,
        calibrated: calibrated(robot, samples, options, &scored.faults).map(|median| unit * median),
    }
}

/// How many millimetres the unit of the robot file's lengths has, if that is the fault.
fn of_robot(faults: &[Fault]) -> f64 {
    let lengths = faults.iter().filter_map(|fault| match fault {
        Fault::Length(unit) if unit.robot.is_some() => Some(1.0 / unit.factor),
        _ => None,
    });
    lengths.product()
}

/// The robot file being no guess, only what no robot could do tells: joint angles in another unit.
fn by_fits(robot: &RobotFile, samples: &SamplesFile, options: Options) -> (f64, Vec<Scored>) {
    let fitted = |faults: &[Fault]| calibrated(robot, samples, options, faults);
    let as_they_are = fitted(&[]).unwrap_or(f64::INFINITY);
    let [arm, ..] = robot.robot.arms();
    let least = FITS * arm.lb();
    if as_they_are <= least {
        return (as_they_are, Vec::new());
    }
    let found = [AngleUnit::Radians, AngleUnit::Degrees]
        .into_iter()
        .filter_map(|unit| {
            let faults = vec![Fault::Angles([true; 3], unit)];
            let median = fitted(&faults)?;
            let explains = median <= least && median * CLEARLY <= as_they_are;
            explains.then_some(Scored { faults, median })
        });
    (as_they_are, found.collect())
}
