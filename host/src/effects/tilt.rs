//! The platform tilts, and takes targets beside its centre along.

use super::{At, Course, Place};
use crate::files::{ONLY_TARGET, RobotFile, Tool};
use crate::geometry::{NUMBERS, Parallelograms};
use nalgebra::Vector3;

/// What holds the platform, and what is on it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Platform {
    /// `None` if its rods are not known.
    pub(crate) rods: Option<Parallelograms>,
    /// Where each target is stated to be, mm.
    targets: Vec<Vector3<f64>>,
}

impl Platform {
    pub(crate) fn of(robot: &RobotFile, targets: &[String]) -> Self {
        let place = |name: &str| {
            let own = robot.instruments.target(name);
            own.map_or_else(Vector3::zeros, |own| own.place)
        };
        let targets = match targets {
            [] => vec![place(ONLY_TARGET)],
            names => names.iter().map(|name| place(name)).collect(),
        };
        Self {
            rods: robot.parallelograms,
            targets,
        }
    }

    /// How many there are.
    pub(crate) fn targets(&self) -> usize {
        self.targets.len()
    }

    pub(super) fn target(&self, index: usize) -> Vector3<f64> {
        self.targets.get(index).copied().unwrap_or_default()
    }
}

/// By each of the twelve numbers; nothing where nothing holds the platform.
pub(super) fn columns(at: &At, course: &Course, place: &Place) -> Vec<Vector3<f64>> {
    let columns = course.platform.rods.and_then(|rods| {
        let (pose, target) = ((&at.position, &at.joints), course.target(place));
        rods.columns(&course.robot, pose, &target)
    });
    match columns {
        Some(columns) => columns.column_iter().map(Into::into).collect(),
        None => vec![Vector3::zeros(); NUMBERS],
    }
}

/// Exactly.
pub(super) fn displacement(at: &At, course: &Course, place: &Place, by: &[f64]) -> Vector3<f64> {
    let Some(rods) = &course.platform.rods else {
        return Vector3::zeros();
    };
    let target = course.target(place);
    let tool = Tool {
        place: target,
        parallelograms: Some(rods.with_numbers(by)),
    };
    let there = tool.position(&course.robot, &at.joints);
    there.map_or_else(|_| Vector3::zeros(), |there| there - at.position - target)
}
