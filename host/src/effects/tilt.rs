//! The platform tilts, and takes targets beside its centre along.

use super::{At, Course, Place};
use crate::files::robot_file::{ONLY_TARGET, RobotFile, Tool};
use crate::geometry::{NUMBERS, Parallelograms};
use nalgebra::Vector3;

/// The rods, and what they move.
#[derive(Debug, Clone)]
pub(crate) struct Tilting {
    rods: Parallelograms,
    /// Where each target is stated to be, mm.
    targets: Vec<Vector3<f64>>,
}

impl Tilting {
    /// Of a robot and the targets of its readings; `None` if its rods are not known.
    pub(crate) fn of(robot: &RobotFile, targets: &[String]) -> Option<Self> {
        let rods = robot.parallelograms?;
        let place = |name: &str| {
            let mut stated = robot.instruments.targets.iter();
            let own = stated.find(|own| own.name == name);
            own.map_or_else(Vector3::zeros, |own| own.place)
        };
        let targets = match targets {
            [] => vec![place(ONLY_TARGET)],
            names => names.iter().map(|name| place(name)).collect(),
        };
        Some(Self { rods, targets })
    }

    fn target(&self, place: &Place) -> Vector3<f64> {
        self.targets.get(place.target).copied().unwrap_or_default()
    }
}

/// By each of the twelve numbers; nothing where nothing holds the platform.
pub(super) fn columns(at: &At, course: &Course, place: &Place) -> Vec<Vector3<f64>> {
    let columns = course.tilting.as_ref().and_then(|own| {
        let pose = (&at.position, &at.joints);
        own.rods.columns(&course.robot, pose, &own.target(place))
    });
    match columns {
        Some(columns) => columns.column_iter().map(Into::into).collect(),
        None => vec![Vector3::zeros(); NUMBERS],
    }
}

/// Exactly.
pub(super) fn displacement(at: &At, course: &Course, place: &Place, by: &[f64]) -> Vector3<f64> {
    let Some(own) = &course.tilting else {
        return Vector3::zeros();
    };
    let target = own.target(place);
    let tool = Tool {
        place: target,
        parallelograms: Some(own.rods.with_numbers(by)),
    };
    let there = tool.position(&course.robot, &at.joints);
    there.map_or_else(|_| Vector3::zeros(), |there| there - at.position - target)
}
