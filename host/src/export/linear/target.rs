//! A controller of a robot with towers: its conventions, and how its lines are written.

use super::geometry::LinearGeometry;
use crate::export::target::Written;

/// What the lines are written from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearFitted {
    /// As it is written.
    pub geometry: LinearGeometry,
    /// The travel of each carriage at its end stop, mm.
    pub home: [f64; 3],
    /// Whether the user stated it.
    pub home_stated: bool,
    /// Whether z = 0 is the bed that was measured.
    pub level: bool,
    /// The largest distance of a wanted position from the z axis, mm.
    pub reach: f64,
}

/// A controller.
#[derive(Debug)]
pub struct LinearTarget {
    /// The name on the command line.
    pub name: &'static str,
    /// In reports.
    pub title: &'static str,
    /// What begins a comment in its configuration.
    pub comment: &'static str,
    /// Its conventions: signs, order of towers.
    pub conventions: &'static [&'static str],
    /// Where the conventions come from.
    pub source: &'static str,
    /// Writes the lines.
    pub write: fn(&LinearFitted) -> Written,
}

/// What to heed whatever the controller.
pub(super) fn warnings(fitted: &LinearFitted) -> Vec<String> {
    let mut warnings = Vec::new();
    let [first, ..] = fitted.home;
    if !fitted.home_stated {
        warnings.push(format!(
            "The end stops are taken at a travel of {first:.3} mm, the largest of [joints], for --home-mm does not \
             state them. The lines are wrong where the carriages stop elsewhere.",
        ));
    }
    if !fitted.level {
        warnings.push(
            "z = 0 and the level are those of the robot file, for --bed names no heights above the bed. After a \
             calibration from heights the bed is elsewhere: name their file."
                .to_owned(),
        );
    }
    warnings
}
