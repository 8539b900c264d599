//! Readings as rows of the core's problem: instruments, weights, and start values of their noise.

use super::Frame;
use super::solution::{Levels, Unsolved};
use crate::files::{Kind, READINGS, Reading, ReadingFrom, Readings, RobotFile};
use crate::halt;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationRow,
    Plane, Point,
};
use delta_cal::{Noise, Refusal, Tolerance};
use nalgebra::SMatrix;

/// Typical σ of a height or a distance, used where the robot file states none, mm. It is known within a factor of 3
/// either way, which sets its degrees of freedom.
pub(crate) const USUAL_HEIGHT: f64 = 0.02;
pub(crate) const USUAL_DISTANCE: f64 = 0.05;
/// The same of a touch, where the shape of the bed is known to differ from a plane.
pub(crate) const USUAL_TOUCH: f64 = 0.01;
/// An estimated σ has converged if its relative change is below this.
pub(super) const SETTLED: f64 = 0.003;
/// Without a stated tolerance, nothing determines where the robot stands in an unknown frame. A tolerance this wide
/// about the robot of the file decides that and nothing else: fraction of the forearm, and radians.
const GAUGE_LENGTH: f64 = 0.02;
const GAUGE_ANGLE: f64 = 0.035;
/// Start value of the noise of coordinates, as a fraction of the forearm; it suits trackers and cameras alike.
const FIRST_POSITION: f64 = 1e-4;

/// The instruments for a robot's readings, weighted with these σ.
pub(crate) fn instruments<'a>(
    robot: &RobotFile,
    frame: Frame,
    planes: &'a [Plane<f64>],
    points: &'a [Point<f64>],
    levels: &Levels,
) -> Result<Instruments<'a, f64>, Refusal> {
    let noise = ObservationNoise::new(levels.position, levels.height, levels.distance);
    let noise = noise.and_then(|own| match robot.instruments.distance_scale {
        Some(sigma) => own.with_scale(sigma),
        None => Ok(own),
    });
    Ok(Instruments {
        sensor_frame: frame == Frame::Sensor,
        planes,
        points,
        noise: noise.map_err(|_| Refusal::Unfinished)?,
        transmission: robot.transmission,
    })
}

/// The tolerance that a fit assumes: the stated one, or in a sensor's frame a wide one, because nothing else determines
/// where the robot stands there.
pub(crate) fn tolerance(robot: &RobotFile, frame: Frame) -> Option<Tolerance<f64>> {
    let [arm, ..] = robot.robot.arms();
    let gauge = || Tolerance::new(GAUGE_LENGTH * arm.lb(), GAUGE_ANGLE).ok();
    match frame {
        Frame::Sensor => robot.tolerance.or_else(gauge),
        Frame::Base => robot.tolerance,
    }
}

/// σ of each kind of reading: as stated in the robot file, otherwise the start value of its estimate.
pub(crate) fn levels(robot: &RobotFile) -> Option<Levels> {
    let facts = &robot.instruments;
    let joint = facts.joint_noise.unwrap_or_default();
    let [arm, ..] = robot.robot.arms();
    let first = || Noise::new(FIRST_POSITION * arm.lb(), joint).ok();
    Some(Levels {
        position: robot.noise.or_else(first)?,
        height: facts.height_noise.unwrap_or(USUAL_HEIGHT),
        distance: facts.distance_noise.unwrap_or(USUAL_DISTANCE),
    })
}

/// Whether the robot file states σ of a kind of reading; if not, it is estimated.
pub(crate) fn is_stated(robot: &RobotFile, kind: Kind) -> bool {
    robot.sigma(kind).is_some()
}

/// The planes and points of a file, with what the robot file states about them, as the platform point meets them: a target
/// beside it touches a plane, or is at a distance, where the platform point does so less the target.
pub fn places(robot: &RobotFile, file: &Readings) -> (Vec<Plane<f64>>, Vec<Point<f64>>) {
    let facts = &robot.instruments;
    let target = facts.target_place();
    let planes = file.planes.iter().map(|name| {
        let known = facts.plane(name);
        Plane {
            known: known.map(|plane| (plane.height - target.z, plane.sigma)),
            level: known.and_then(|plane| plane.tilt).map(f64::tan),
        }
    });
    let points = file.points.iter().map(|name| {
        let known = facts.point(name);
        Point {
            known: known.and_then(|point| {
                let (place, sigma) = point.place?;
                Some((place - target, sigma))
            }),
            offset: known.is_some_and(|point| point.offset_unknown),
        }
    });
    (planes.collect(), points.collect())
}

/// The rows of the core's problem.
pub(crate) fn rows<'a>(
    readings: impl Iterator<Item = &'a Reading>,
) -> Result<Vec<ObservationRow<f64>>, Unsolved> {
    readings
        .inspect(|_| halt::check())
        .map(|own| Ok(ObservationRow::new(observation(own)?)))
        .collect()
}

/// The covariance of a row's readings without the joints' part, in products of these σ, if the row states its own.
pub(crate) fn shape(
    reading: &Reading,
    levels: &Levels,
) -> Option<SMatrix<f64, READINGS, READINGS>> {
    halt::check();
    if reading.sigma.is_none() && reading.shape.is_none() {
        return None;
    }
    let mut shape = SMatrix::<f64, READINGS, READINGS>::identity();
    if let Some(own) = reading.shape {
        shape.fixed_view_mut::<3, 3>(0, 0).copy_from(&own);
    }
    let times = reading.sigma.zip(reading.kind());
    Some(shape * times.map_or(1.0, |(sigma, kind)| (sigma / levels.of(kind)).powi(2)))
}

/// A row in the core's form.
///
/// # Errors
/// More planes or points than the core can number.
pub fn observation(reading: &Reading) -> Result<Observation<f64>, Unsolved> {
    let index = |index: usize| u8::try_from(index).map_err(|_| Unsolved::TooManyInstruments);
    let height = |(plane, height)| {
        let plane = index(plane)?;
        Ok::<_, Unsolved>(Height { plane, height })
    };
    let distance = |(from, distance)| {
        let from = match from {
            ReadingFrom::Point(point) => DistanceFrom::Point(index(point)?),
            ReadingFrom::Pose(joints) => DistanceFrom::Pose(joints),
        };
        Ok::<_, Unsolved>(Distance { from, distance })
    };
    Ok(Observation {
        joints: reading.joints,
        position: reading.position,
        height: reading.height.map(height).transpose()?,
        distance: reading.distance.map(distance).transpose()?,
    })
}
