//! A target: the parameters that it holds, its conventions, and the lines that it reads.

use super::error::ExportError;
use super::geometry::{Geometry, Holds, to_decimals};
use crate::files::convention::Convention;
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use serde::Serialize;

/// A parameter of a target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// Its name in the controller.
    pub name: String,
    /// The value in the unit.
    pub value: f64,
    /// `mm`, `in` or `deg`.
    pub unit: &'static str,
}

impl Entry {
    fn new(name: impl Into<String>, value: f64, unit: &'static str) -> Self {
        Self {
            name: name.into(),
            value,
            unit,
        }
    }

    pub(super) fn length(name: impl Into<String>, value: f64) -> Self {
        Self::new(name, value, "mm")
    }

    /// A length in mm, stated in inches.
    pub(super) fn inches(name: impl Into<String>, value: f64) -> Self {
        Self::new(name, value / 25.4, "in")
    }

    pub(super) fn degrees(name: impl Into<String>, radians: f64) -> Self {
        Self::new(name, radians.to_degrees(), "deg")
    }

    /// An angle from 0° to 360°.
    pub(super) fn azimuth(name: impl Into<String>, radians: f64) -> Self {
        Self::new(name, radians.to_degrees().rem_euclid(360.0), "deg")
    }
}

/// The parameters of a target, and the lines to paste.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Written {
    /// All parameters.
    pub entries: Vec<Entry>,
    /// The lines to paste.
    pub lines: String,
    /// Warnings about these values.
    pub warnings: Vec<String>,
}

/// The values from which lines are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// The fitted geometry, rounded.
    pub geometry: Geometry,
    /// The joint of each arm at its end stop: radians, or mm of travel.
    pub home: [f64; 3],
    /// Whether the user stated `home`.
    pub home_stated: bool,
    /// With towers: whether z = 0 is the measured bed.
    pub level: bool,
    /// The range of the joints: radians, or mm of travel.
    pub limits: [f64; 2],
    /// The radius of the platform, mm.
    pub platform_radius: f64,
    /// The robot file's convention.
    pub convention: Convention,
    /// The vector from the platform point to the tool, mm.
    pub target: Option<Vector3<f64>>,
    /// Whether the target's lengths are in inches.
    pub inches: bool,
    /// The largest distance of a wanted position from the z axis, mm.
    pub reach: f64,
}

impl Fitted {
    /// With towers: the height of the nozzle at x = y = 0 with each carriage at its end stop, mm.
    pub(super) fn tower_endstops(&self) -> [f64; 3] {
        let mut endstops = self.home;
        for (endstop, tower) in endstops.iter_mut().zip(&self.geometry.arms) {
            let square = tower.lower * tower.lower - tower.radius * tower.radius;
            *endstop += tower.height - square.max(0.0).sqrt();
        }
        endstops
    }

    /// Warnings about end stops and a bed that the user did not state.
    pub(super) fn assumptions(&self) -> Vec<String> {
        let [home, ..] = self.home;
        let linear = self.geometry.drive == Drive::Linear;
        let mut warnings = Vec::new();
        if !self.home_stated {
            let place = if linear {
                format!("a travel of {home:.3} mm, the largest of [joints]")
            } else {
                format!("joint angles of {:.0}°", home.to_degrees())
            };
            warnings.push(format!(
                "The end stops are assumed at {place}. If they are elsewhere the lines are wrong: state them with --home."
            ));
        }
        if linear && !self.level {
            warnings.push(
                "z = 0 and level are the robot file's. After a calibration from heights the bed is elsewhere: give the \
                 file of the heights with --bed."
                    .to_owned(),
            );
        }
        warnings
    }
}

/// The form in which a target receives a robot.
#[derive(Debug)]
pub enum Content {
    /// Fitted parameters of its own kinematics.
    Fitted {
        /// The parameters that it holds.
        holds: Holds,
        /// Writes the lines.
        write: fn(&Fitted) -> Result<Written, ExportError>,
    },
    /// All 24 parameters.
    Everything,
    /// Corrections of the positions commanded to a controller with the nominal robot.
    Corrections,
}

/// A target.
#[derive(Debug)]
pub struct Target {
    /// The name on the command line.
    pub name: &'static str,
    /// The name in reports.
    pub title: &'static str,
    /// The drives that it supports; `None` for all.
    pub drive: Option<Drive>,
    /// The form in which it receives a robot.
    pub content: Content,
    /// The start of a comment in its configuration.
    pub comment: &'static str,
    /// Its conventions: signs, zero angles, order of arms.
    pub conventions: &'static [&'static str],
    /// The source of the conventions.
    pub source: &'static str,
    /// The alternative if it keeps too little of the calibration.
    pub alternative: &'static str,
}

/// 4 decimals, without −0.
pub(super) fn decimals(value: f64) -> String {
    format!("{:.4}", to_decimals(value))
}

/// The letters of the towers in G-code.
pub(super) const AXES: [&str; 3] = ["X", "Y", "Z"];

/// Entries named `M665 X` as words of a line, `X0.1000`.
pub(super) fn words(entries: &[Entry]) -> String {
    let word = |entry: &Entry| {
        let letter = entry.name.rsplit(' ').next().unwrap_or_default();
        format!("{letter}{}", decimals(entry.value))
    };
    entries.iter().map(word).collect::<Vec<_>>().join(" ")
}
