//! A printer assessed: what its configuration is off, what to paste instead, and what that leaves.

use super::area::{Area, Off};
use super::next::{Next, next};
use crate::calibration::observations::prior;
use crate::export::error::ExportError;
use crate::export::positions::{Wanted, bed};
use crate::export::target::Entry;
use crate::export::{Case, Export, Settings, held, target};
use crate::files::robot_file::RobotFile;
use crate::import::Imported;
use serde::Serialize;

/// The printed area of a robot that states none, as a part of the upper arm's or tower's radius.
const USUAL_AREA: f64 = 0.7;
/// What is fitted on the bed counts so many times, for the first layer depends on it.
const FIRST_LAYER: usize = 5;
/// Lower than this above the bed a position is on it, mm.
const ON_THE_BED: f64 = 0.5;

/// What the calibration found that an assessment needs.
#[derive(Debug, Clone, Copy)]
pub struct Calibrated<'a> {
    /// The calibrated robot.
    pub robot: &'a RobotFile,
    /// Residuals over what noise and tolerance allow: 1 is expected.
    pub lack_of_fit: f64,
    /// By what every σ is multiplied.
    pub widening: f64,
    /// The place of the reading that fits worst.
    pub worst: Option<usize>,
    /// How many combinations of the parameters are known better than the tolerance.
    pub combinations: usize,
    /// Whether the readings show the size of printed parts.
    pub scale_known: bool,
}

/// A parameter of the controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// As the controller calls it.
    pub name: String,
    /// In the configuration.
    pub before: f64,
    /// In the lines to paste.
    pub after: f64,
    /// `mm` or `deg`.
    pub unit: &'static str,
}

/// What is known of a printer.
#[derive(Debug, Clone)]
pub struct Assessment<'a> {
    /// Its configuration.
    pub printer: &'a Imported,
    /// The calibration.
    pub calibrated: Calibrated<'a>,
    /// Where it prints.
    pub area: Area,
    /// What its configuration is off; `None` if it does not reach its bed.
    pub before: Option<Off>,
    /// What the lines to paste are off.
    pub after: Option<Off>,
    /// The expected error before any measurement, one σ, rms over the printed area, mm.
    pub sigma_before: Option<f64>,
    /// What to measure next; `None` if it cannot be told.
    pub next: Option<Next>,
    /// What the controller is told, and what it would be told.
    pub changes: Vec<Change>,
    /// The lines to paste.
    pub export: Export,
}

impl<'a> Assessment<'a> {
    /// Of a configuration and the calibration from its readings.
    ///
    /// # Errors
    /// The controller cannot hold the calibrated robot.
    pub fn of(printer: &'a Imported, calibrated: Calibrated<'a>) -> Result<Self, ExportError> {
        let (robot, file) = (&printer.robot, calibrated.robot);
        let arms = robot.robot.arms().iter().map(|arm| arm.d().xy().norm());
        let usual = USUAL_AREA * arms.fold(f64::INFINITY, f64::min);
        let radius = printer.bed_radius.unwrap_or(usual);
        let area = Area::of(file, radius);
        let positions = area.positions();
        let mut fitted = positions.clone();
        let lowest = positions.iter().filter(|at| at.z.abs() < ON_THE_BED);
        for at in lowest {
            fitted.extend([*at; FIRST_LAYER - 1]);
        }
        let wanted = Wanted {
            within: Some(radius),
            fitted,
            evaluated: positions,
        };
        let level = bed(&file.robot, &printer.readings).unwrap_or_default();
        let target = target(printer.firmware.name(), robot.robot.drive())?;
        let export = Case {
            robot: file,
            nominal: Some(&robot.robot),
            wanted: &wanted,
            settings: Settings {
                home: Some(printer.home),
                level: Some(level),
                height: Some(0.0),
                ..Settings::default()
            },
        }
        .export(target)?;
        let held = held(robot, printer.home, target)?.entries;
        let pairs = held.into_iter().zip(&export.written.entries);
        let changes = pairs.map(|(Entry { name, value, unit }, after)| Change {
            name,
            before: value,
            after: after.value,
            unit,
        });
        let off = |controller, frame: &_| Off::of(&file.robot, controller, frame, radius);
        let after = export.controller.as_ref().zip(export.frame);
        Ok(Self {
            before: off(&robot.robot, &level.transform()),
            after: after.and_then(|(controller, frame)| off(controller, &frame.transform())),
            sigma_before: prior(robot).and_then(|covariance| area.expected(file, &covariance)),
            next: next(file, &printer.readings, &area, calibrated.widening),
            changes: changes.collect(),
            printer,
            calibrated,
            area,
            export,
        })
    }
}
