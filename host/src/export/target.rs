//! A target: what it holds of a robot, its conventions, and how its lines are written.

use super::error::ExportError;
use super::geometry::{Geometry, Holds, to_decimals};
use crate::files::convention::Convention;
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use serde::Serialize;

/// A line of a target's parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// As the controller calls it.
    pub name: String,
    /// In the unit.
    pub value: f64,
    /// `mm`, `in` or `deg`.
    pub unit: &'static str,
}

impl Entry {
    pub(super) fn length(name: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            value,
            unit: "mm",
        }
    }

    /// Of a length in mm.
    pub(super) fn inches(name: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            value: value / 25.4,
            unit: "in",
        }
    }

    pub(super) fn degrees(name: impl Into<String>, radians: f64) -> Self {
        Self {
            name: name.into(),
            value: radians.to_degrees(),
            unit: "deg",
        }
    }

    /// From 0° to 360°.
    pub(super) fn azimuth(name: impl Into<String>, radians: f64) -> Self {
        let mut entry = Self::degrees(name, radians);
        entry.value = entry.value.rem_euclid(360.0);
        entry
    }
}

/// What a target writes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Written {
    /// Every parameter.
    pub entries: Vec<Entry>,
    /// The lines to paste.
    pub lines: String,
    /// What to heed with these values.
    pub warnings: Vec<String>,
}

/// What the lines are written from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// As it is written.
    pub geometry: Geometry,
    /// The joint of each arm at its end stop: radians, or mm of travel.
    pub home: [f64; 3],
    /// Whether the user stated it.
    pub home_stated: bool,
    /// With towers: whether z = 0 is the bed that was measured.
    pub level: bool,
    /// The range of the joints: radians, or mm of travel.
    pub limits: [f64; 2],
    /// The radius of the platform, mm.
    pub platform_radius: f64,
    /// How the robot file's controller counts.
    pub convention: Convention,
    /// From the platform point to the tool, mm.
    pub target: Option<Vector3<f64>>,
    /// Whether lengths are to be in inches.
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

    /// What to say of end stops, and of a bed, that nobody stated.
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
                "The end stops are assumed at {place}. The lines are wrong if they are elsewhere: state them with \
                 --home."
            ));
        }
        if linear && !self.level {
            warnings.push(
                "z = 0 and the level are those of the robot file. After a calibration from heights the bed is \
                 elsewhere: name the file of the heights with --bed."
                    .to_owned(),
            );
        }
        warnings
    }
}

/// How a target receives a robot.
#[derive(Debug)]
pub enum Content {
    /// As parameters of its own kinematics, which are fitted.
    Fitted {
        /// What it holds.
        holds: Holds,
        /// Writes the lines.
        write: fn(&Fitted) -> Result<Written, ExportError>,
    },
    /// As all 24 parameters.
    Everything,
    /// As corrections of the positions that a controller with the nominal robot is told.
    Corrections,
}

/// A target.
#[derive(Debug)]
pub struct Target {
    /// The name on the command line.
    pub name: &'static str,
    /// In reports.
    pub title: &'static str,
    /// Whose robots it takes; `None` for all.
    pub drive: Option<Drive>,
    /// How it receives a robot.
    pub content: Content,
    /// What begins a comment in its configuration.
    pub comment: &'static str,
    /// Its conventions: signs, zero angles, order of arms.
    pub conventions: &'static [&'static str],
    /// Where the conventions come from.
    pub source: &'static str,
    /// What to use instead where it keeps too little.
    pub alternative: &'static str,
}

/// To 4 decimals, without a minus before zero.
pub(super) fn decimals(value: f64) -> String {
    format!("{:.4}", to_decimals(value))
}

/// Entries named `M665 X` as words of a line, `X0.1000`.
pub(super) fn words(entries: &[Entry]) -> String {
    let word = |entry: &Entry| {
        let letter = entry.name.rsplit(' ').next().unwrap_or_default();
        format!("{letter}{}", decimals(entry.value))
    };
    entries.iter().map(word).collect::<Vec<_>>().join(" ")
}
