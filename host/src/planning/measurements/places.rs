//! Where the instruments of a file are, or will be.

use super::kind::{Kind, Wishes};
use super::request::MeasurementRequest;
use super::setup::Setup;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, ObservationsToCheck, ReadingFrom};
use crate::fit::observations::{ObservedFit, PlaneFound, calibrate};
use crate::fit::options::Frame;
use delta_cal::Robot;
use delta_cal::calibration::Solver;
use delta_cal::frame::RigidTransform;
use nalgebra::Vector3;

/// Where planes, points and the frame of the coordinates are.
#[derive(Debug, Clone)]
pub(super) struct Places {
    frame: RigidTransform<f64>,
    pub(super) planes: Vec<PlaneFound>,
    pub(super) points: Vec<Vector3<f64>>,
}

impl Places {
    /// As the calibration finds them, if every row is measured and calibrates the robot. Otherwise planes are
    /// level, points are where a plan puts them, and the frame is the robot's.
    pub(super) fn of(robot: &RobotFile, samples: &ObservationsToCheck, frame: Frame) -> Self {
        let file = &samples.file;
        if samples.unmeasured.is_empty()
            && let Ok(fit) = calibrate(robot, file, frame, Solver::default())
        {
            return Self::found(fit);
        }
        let facts = &robot.instruments;
        let planes = file.planes.iter().enumerate().map(|(index, name)| {
            let known = facts.planes.iter().find(|plane| plane.name == *name);
            let height = known.map_or_else(|| level(robot, samples, index), |plane| plane.height);
            PlaneFound {
                normal: Vector3::z(),
                offset: height,
            }
        });
        Self {
            frame: RigidTransform::identity(),
            planes: planes.collect(),
            points: as_planned(robot, &file.points),
        }
    }

    fn found(fit: ObservedFit) -> Self {
        Self {
            frame: fit.frame.unwrap_or_else(RigidTransform::identity),
            planes: fit.planes,
            points: fit.points.iter().map(|point| point.place).collect(),
        }
    }

    /// What a robot would read in these rows. A row that it does not reach is left as it is.
    pub(super) fn nominal(&self, robot: &Robot<f64>, file: &ObservationsFile) -> ObservationsFile {
        let mut nominal = file.clone();
        for row in &mut nominal.rows {
            let reading = &mut row.value;
            let Ok(there) = robot.forward(&reading.joints) else {
                continue;
            };
            let measured = self.frame.apply(&there);
            for (coordinate, value) in reading.position.iter_mut().zip(measured.iter()) {
                *coordinate = coordinate.map(|_| *value);
            }
            if let Some((plane, height)) = &mut reading.height
                && let Some(plane) = self.planes.get(*plane)
            {
                *height = plane.normal.dot(&there) - plane.offset;
            }
            if let Some((from, distance)) = &mut reading.distance {
                let from = match from {
                    ReadingFrom::Pose(joints) => robot.forward(joints).ok(),
                    ReadingFrom::Point(point) => self.points.get(*point).copied(),
                };
                if let Some(from) = from {
                    *distance = (there - from).norm();
                }
            }
        }
        nominal
    }
}

/// Where a plan puts points of these names, and the others in turn; what the robot file states comes first.
fn as_planned(robot: &RobotFile, names: &[String]) -> Vec<Vector3<f64>> {
    let request = MeasurementRequest {
        points: names.len(),
        ..MeasurementRequest::new(robot, Wishes::only(Kind::Point), 0)
    };
    let planned = Setup::of(&request).points;
    let of = |name: &String| planned.iter().find(|(own, _)| own == name);
    let mut others = planned
        .iter()
        .filter(|(own, _)| !names.contains(own))
        .map(|(_, place)| *place);
    names
        .iter()
        .map(|name| match of(name) {
            Some((_, place)) => *place,
            None => others.next().unwrap_or_default(),
        })
        .collect()
}

/// The height at which a plane is as the robot that was drawn touches it; where nothing was measured, where its
/// lowest pose is.
fn level(robot: &RobotFile, samples: &ObservationsToCheck, plane: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut lowest = f64::INFINITY;
    for row in &samples.file.rows {
        let Some((own, height)) = row.value.height else {
            continue;
        };
        let Ok(there) = robot.robot.forward(&row.value.joints) else {
            continue;
        };
        if own != plane {
            continue;
        }
        lowest = lowest.min(there.z);
        if samples.unmeasured.binary_search(&row.line).is_err() {
            sum += there.z - height;
            count += 1.0;
        }
    }
    if count > 0.0 {
        sum / count
    } else if lowest.is_finite() {
        lowest
    } else {
        0.0
    }
}
