//! A controller: what it holds, its conventions, and how its lines are written.

use super::error::ExportError;
use super::geometry::{Geometry, Holds};

/// A line of a target's parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// As the controller calls it.
    pub name: String,
    /// In the unit.
    pub value: f64,
    /// `mm` or `deg` or `rad`.
    pub unit: &'static str,
}

impl Entry {
    pub(crate) fn length(name: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            value,
            unit: "mm",
        }
    }

    pub(crate) fn degrees(name: impl Into<String>, radians: f64) -> Self {
        Self {
            name: name.into(),
            value: radians.to_degrees(),
            unit: "deg",
        }
    }
}

/// What a target writes.
#[derive(Debug, Clone, PartialEq)]
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
    /// The joint angle of each arm at its end stop, radians.
    pub home: [f64; 3],
    /// Whether the user stated it.
    pub home_stated: bool,
    /// The range of the joints, radians.
    pub limits: [f64; 2],
    /// The radius of the platform, mm.
    pub platform_radius: f64,
    /// The largest distance of a wanted position from the z axis, mm.
    pub reach: f64,
}

/// A controller.
#[derive(Debug)]
pub struct Target {
    /// The name on the command line.
    pub name: &'static str,
    /// In reports.
    pub title: &'static str,
    /// What it holds.
    pub holds: Holds,
    /// What begins a comment in its configuration.
    pub comment: &'static str,
    /// Its conventions: signs, zero angles, order of arms.
    pub conventions: &'static [&'static str],
    /// Where the conventions come from.
    pub source: &'static str,
    /// What to use instead where it keeps too little.
    pub alternative: &'static str,
    /// Writes the lines.
    pub write: fn(&Fitted) -> Result<Written, ExportError>,
}

/// To 4 decimals, without a minus before zero.
pub(crate) fn decimals(value: f64) -> String {
    format!("{:.4}", (value * 1e4).round() / 1e4 + 0.0)
}

/// What to say of end stops that nobody stated.
pub(crate) fn assumed_home(fitted: &Fitted) -> Option<String> {
    let [first, ..] = fitted.home;
    (!fitted.home_stated).then(|| {
        format!(
            "The end stops are taken at joint angles of {:.0}°, for --home-deg does not state them. The lines are wrong \
             where the arms stop elsewhere.",
            first.to_degrees()
        )
    })
}
