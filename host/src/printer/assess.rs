//! A printer assessed: what its configuration is off, what to paste instead, and what that leaves.

use super::area::{Area, Off};
use super::next::{Next, next};
use crate::accuracy::information::prior;
use crate::calibration::Report;
use crate::export::error::ExportError;
use crate::export::positions::{Wanted, bed};
use crate::export::target::Entry;
use crate::export::{Case, Export, Settings, held, target};
use crate::import::Imported;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use serde::Serialize;

/// The printed area of a robot that states none, as a part of the upper arm's or tower's radius.
const USUAL_AREA: f64 = 0.7;
/// What is fitted on the bed counts so many times, for the first layer depends on it.
const FIRST_LAYER: usize = 5;
/// Lower than this above the bed a position is on it, mm.
const ON_THE_BED: f64 = 0.5;

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
    pub calibration: &'a Report,
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
    pub fn of(printer: &'a Imported, calibration: &'a Report) -> Result<Self, ExportError> {
        let (robot, file) = (&printer.robot, &calibration.after);
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
        let off = |controller: &Robot<f64>, frame: &RigidTransform<f64>| {
            Off::of(&file.robot, controller, frame, radius)
        };
        let after = export.controller.as_ref().zip(export.frame);
        Ok(Self {
            before: off(&robot.robot, &level.transform()),
            after: after.and_then(|(controller, frame)| off(controller, &frame.transform())),
            sigma_before: prior(robot).and_then(|covariance| area.expected(file, &covariance)),
            next: next(file, &printer.readings, &area, calibration.sigma_widened_by),
            changes: changes.collect(),
            printer,
            calibration,
            area,
            export,
        })
    }

    /// How many times what noise and tolerance allow the residuals are: 1 is expected.
    pub fn lack_of_fit(&self) -> f64 {
        lack_of_fit(self.calibration)
    }

    /// What the configuration calls the reading that fits worst.
    pub fn worst(&self) -> Option<&str> {
        worst(self.printer, self.calibration)
    }
}

/// How many times what noise and tolerance allow the residuals are: 1 is expected.
pub(crate) fn lack_of_fit(calibration: &Report) -> f64 {
    let noise = &calibration.solution.noise;
    let squares: f64 = noise.iter().map(|own| own.squares).sum();
    let freedom = calibration.solution.degrees_of_freedom();
    (squares / freedom.max(1.0)).sqrt()
}

/// What the configuration calls the reading that fits worst.
pub(crate) fn worst<'a>(printer: &'a Imported, calibration: &Report) -> Option<&'a str> {
    let sizes = calibration.samples.iter().map(|own| own.error_after_sigma);
    let named = printer.names.iter().zip(sizes);
    let (name, _) = named.max_by(|(_, one), (_, other)| one.total_cmp(other))?;
    Some(name)
}
