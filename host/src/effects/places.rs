//! The places of the instruments: the sensor's frame, planes and points.

use crate::files::{READINGS, Reading, ReadingFrom};
use crate::halt;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use nalgebra::Vector3;

/// The place of a plane: a height above it is `normal · X − offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneFound {
    /// Unit vector, upward.
    pub normal: Vector3<f64>,
    /// mm.
    pub offset: f64,
}

/// The place of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointFound {
    /// Position, mm.
    pub place: Vector3<f64>,
    /// Offset of its sensor's readings, mm.
    pub offset: f64,
}

/// The places of the instruments.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Places {
    /// Transformation from the robot's frame to that of the coordinates; `None` if they are the same.
    pub frame: Option<RigidTransform<f64>>,
    /// The planes in the order of the file.
    pub planes: Vec<PlaneFound>,
    /// The points in the order of the file.
    pub points: Vec<PointFound>,
    /// The relative error common to all distances between two poses.
    pub distance_scale: f64,
}

impl Places {
    /// A complete position as the robot computes it and as it was measured, both in the robot's frame.
    pub(crate) fn attained(
        &self,
        robot: &Robot<f64>,
        reading: &Reading,
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        halt::check();
        let computed = robot.forward(&reading.joints).ok()?;
        let read = reading.sample()?.position;
        let is = self
            .frame
            .map_or(read, |frame| frame.inverse().apply(&read));
        Some((computed, is))
    }

    /// The readings of a row expected of a robot: x, y, z, height, distance; `None` where nothing was read or the robot
    /// does not reach the row.
    pub fn expected(&self, robot: &Robot<f64>, reading: &Reading) -> [Option<f64>; READINGS] {
        halt::check();
        let Ok(position) = robot.forward(&reading.joints) else {
            return [None; READINGS];
        };
        let seen = self.frame.map_or(position, |frame| frame.apply(&position));
        let height = reading.height.and_then(|(plane, _)| {
            let plane = self.planes.get(plane)?;
            Some(plane.normal.dot(&position) - plane.offset)
        });
        let distance = reading.distance.and_then(|(from, _)| match from {
            ReadingFrom::Point(point) => {
                let point = self.points.get(point)?;
                Some((position - point.place).norm() + point.offset)
            }
            ReadingFrom::Pose(joints) => {
                let distance = (position - robot.forward(&joints).ok()?).norm();
                Some(distance * (1.0 + self.distance_scale))
            }
        });
        let [x, y, z] = [0, 1, 2].map(|axis| reading.position[axis].map(|_| seen[axis]));
        [x, y, z, height, distance]
    }
}
