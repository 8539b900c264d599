//! Looks for the faults that explain the samples.

use super::evidence::{Evidence, Scored, calibrated};
use super::explanation::{Diagnosis, Explanation};
use super::hypothesis::Fault;
use super::words::Words;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Readings;
use crate::fit::options::{Frame, Options};

/// No robot has forearms below this, mm: then the file's lengths are in a larger unit.
const LEAST_FOREARM: f64 = 10.0;

/// Of samples that are in a file, whether a calibration accepts them or not; `None` if nothing is
/// wrong with the file as a whole, or no fault explains what is.
pub(crate) fn diagnose(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Option<Diagnosis> {
    let evidence = Evidence::new(robot, readings, options)?;
    let as_they_are = evidence.median(&[]);
    let found = evidence.explanations(as_they_are);
    if found.is_empty() {
        return None;
    }
    let explain = |scored: &Scored| explanation(robot, readings, options, scored);
    Some(Diagnosis {
        as_they_are,
        explanations: found.iter().map(explain).collect(),
    })
}

fn explanation(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
    scored: &Scored,
) -> Explanation {
    let [arm, ..] = robot.robot.arms();
    let robot_in_metres = arm.lb() < LEAST_FOREARM;
    let words = Words {
        robot: &robot.name,
        samples: readings,
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
        calibrated: calibrated(robot, readings, options, &scored.faults)
            .map(|median| unit * median),
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
