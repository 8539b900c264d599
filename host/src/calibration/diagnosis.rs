//! Faults of a samples file as a whole: exchanged columns, a wrong sign, another unit, a mirrored frame. Each fault is
//! undone and the samples compared with the robot of the file; the faults without which they agree clearly better are
//! named. Nothing is ever corrected.

mod evidence;
mod fault;

use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Readings;
use crate::fit::{Frame, Options};
use evidence::{Evidence, Scored, calibrated};
use fault::{Fault, Words};
use serde::Serialize;
use std::fmt;

/// No robot has shorter forearms, mm: the file's lengths are then in a larger unit.
const LEAST_FOREARM: f64 = 10.0;

/// Diagnoses the samples, whether or not a calibration accepts them; `None` if the file as a whole is right, or no
/// fault explains it.
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
    // Distances are in the robot file's unit of length: this converts them to mm.
    let unit = if robot_in_metres {
        of_robot(&scored.faults)
    } else {
        1.0
    };
    let [cause, remedy] = words.upwards(&scored.faults).unwrap_or_else(|| {
        let each: Vec<_> = scored.faults.iter().map(|fault| words.of(fault)).collect();
        let all = |place: usize| each.iter().map(move |own: &[String; 2]| own[place].clone());
        let [causes, remedies] = [0, 1].map(|place| all(place).collect::<Vec<_>>());
        [causes.join(" and "), remedies.join(", and ")]
    });
    Explanation {
        cause,
        remedy,
        without: unit * scored.median,
        calibrated: calibrated(robot, readings, options, &scored.faults)
            .map(|median| unit * median),
    }
}

/// Millimetres per unit of the robot file's lengths, if their unit is the fault.
fn of_robot(faults: &[Fault]) -> f64 {
    let lengths = faults.iter().filter_map(|fault| match fault {
        Fault::Length(unit) if unit.robot.is_some() => Some(1.0 / unit.factor),
        _ => None,
    });
    lengths.product()
}

/// Most explanations named; others that are as good are only counted.
const NAMED: usize = 4;

/// Explanations for samples that cannot be right as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Median distance of the measured points from those of the robot file, mm; infinite if the robot does not reach
    /// them or they are in one spot.
    pub as_they_are: f64,
    /// Explanations, best first, all about equally good. At least one.
    pub explanations: Vec<Explanation>,
}

/// A fault, or two together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// The fault in words.
    pub cause: String,
    /// The remedy.
    pub remedy: String,
    /// [`Diagnosis::as_they_are`] without the faults, mm.
    pub without: f64,
    /// The same after a calibration without the faults; `None` if the calibration is refused.
    pub calibrated: Option<f64>,
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [best, others @ ..] = &self.explanations[..] else {
            return Ok(());
        };
        write!(
            formatter,
            "Probably {}. Without it half of the points are within {} mm of the robot file",
            best.cause,
            figures(best.without),
        )?;
        if let Some(calibrated) = best.calibrated {
            let calibrated = figures(calibrated);
            write!(formatter, " ({calibrated} mm after calibration)")?;
        }
        if self.as_they_are.is_finite() {
            write!(
                formatter,
                "; as they are, {} mm. ",
                figures(self.as_they_are)
            )?;
        } else {
            formatter.write_str(". ")?;
        }
        for other in others.iter().take(NAMED - 1) {
            write!(formatter, "Equally likely: {}. ", other.cause)?;
        }
        if let Some(more) = others.len().checked_sub(NAMED - 1).filter(|more| *more > 0) {
            write!(formatter, "{more} more are as likely. ")?;
        }
        formatter.write_str("Nothing was corrected")
    }
}

/// Formats to three significant digits.
fn figures(value: f64) -> String {
    match value {
        value if value >= 100.0 => format!("{value:.0}"),
        value if value >= 10.0 => format!("{value:.1}"),
        value if value >= 1.0 => format!("{value:.2}"),
        value if value >= 1e-3 => format!("{value:.4}"),
        value => format!("{value:.0e}"),
    }
}

impl Diagnosis {
    /// The remedies of the first explanation and of the alternatives.
    pub fn remedy(&self) -> String {
        let mut remedies: Vec<_> = Vec::new();
        for explanation in self.explanations.iter().take(NAMED) {
            if !remedies.contains(&explanation.remedy.as_str()) {
                remedies.push(&explanation.remedy);
            }
        }
        remedies.join("; or ")
    }
}
