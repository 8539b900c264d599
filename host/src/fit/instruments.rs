//! What a fit found of the instruments, in the axes and units of the robot file.

use super::Solution;
use crate::effects::{EffectKind, Estimated, PlaneFound, PointFound};
use crate::files::{Convention, Readings, RobotFile, Target};
use crate::text::degrees;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::Transmission;
use nalgebra::Vector3;
use serde::Serialize;

/// A datum point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DatumReport {
    /// Its name.
    pub name: String,
    /// Where the sensor saw it less where it is stated, in the frame of the base.
    pub off_mm: [f64; 3],
}

/// A target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TargetReport {
    /// Its name.
    pub name: String,
    /// Where the robot file states it.
    pub stated_mm: [f64; 3],
    /// σ of that.
    pub sigma_mm: [f64; 3],
    /// Where the readings put it, less that.
    pub moved_mm: Option<[f64; 3]>,
}

/// X_sensor = rotation · X_robot + translation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrameReport {
    /// Row by row.
    pub rotation: [[f64; 3]; 3],
    /// mm.
    pub translation_mm: [f64; 3],
}

impl FrameReport {
    pub(crate) fn of(frame: &RigidTransform<f64>, convention: &Convention) -> Self {
        Self {
            rotation: convention.rotation(&frame.rotation).transpose().data.0,
            translation_mm: convention.vector(&frame.translation).data.0[0],
        }
    }
}

/// A plane: a height above it is `normal · X − offset`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneReport {
    /// As the samples file names it.
    pub name: String,
    /// Upward, of length 1.
    pub normal: [f64; 3],
    /// Where it crosses the z axis.
    pub z_mm: f64,
    /// Its slope.
    pub tilt_deg: f64,
}

/// A point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointReport {
    /// As the samples file names it.
    pub name: String,
    /// Its place.
    pub place_mm: [f64; 3],
    /// What its sensor reads too much.
    pub offset_mm: f64,
}

/// A joint's transmission: angle of the arm = q + gain q + cos cos q + sin sin q + cos2 cos 2q + sin2 sin 2q.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TransmissionReport {
    /// 1, 2 or 3.
    pub arm: usize,
    /// gain, then cos, sin, cos2 and sin2 in degrees.
    pub numbers: [f64; 5],
    /// One σ of each.
    pub sigmas: [f64; 5],
    /// Amplitude of the first harmonic, degrees: an eccentric gear or encoder.
    pub first_harmonic_deg: f64,
    /// Amplitude of the second.
    pub second_harmonic_deg: f64,
}

/// Planes and points stand where the target meets them.
pub(crate) fn planes(
    readings: &Readings,
    solution: &Solution,
    robot: &RobotFile,
) -> Vec<PlaneReport> {
    let convention = &robot.convention;
    let target = robot.instruments.target_place();
    let found = readings.planes.iter().zip(&solution.places.planes);
    let of_plane = |(name, plane): (&String, &PlaneFound)| PlaneReport {
        name: name.clone(),
        normal: convention.vector(&plane.normal).data.0[0],
        z_mm: convention.height((plane.offset + plane.normal.dot(&target)) / plane.normal.z),
        tilt_deg: degrees(plane.normal.xy().norm().atan2(plane.normal.z)),
    };
    found.map(of_plane).collect()
}

pub(crate) fn points(
    readings: &Readings,
    solution: &Solution,
    robot: &RobotFile,
) -> Vec<PointReport> {
    let target = robot.instruments.target_place();
    let found = readings.points.iter().zip(&solution.places.points);
    let of_point = |(name, point): (&String, &PointFound)| PointReport {
        name: name.clone(),
        place_mm: robot.convention.vector(&(point.place + target)).data.0[0],
        offset_mm: point.offset,
    };
    found.map(of_point).collect()
}

pub(crate) fn datum(robot: &RobotFile, frame: Option<&RigidTransform<f64>>) -> Vec<DatumReport> {
    let Some(frame) = frame else {
        return Vec::new();
    };
    let points = robot.instruments.datum.iter();
    let of_point = points.map(|own| DatumReport {
        name: own.name.clone(),
        off_mm: (robot.convention)
            .vector(&(frame.inverse().apply(&own.seen) - own.place))
            .into(),
    });
    of_point.collect()
}

pub(crate) fn targets(robot: &RobotFile, solution: &Solution) -> Vec<TargetReport> {
    let of_target = |own: &Target| {
        let names = &solution.readings.targets;
        let index = names.iter().position(|name| *name == own.name).unwrap_or(0);
        let mut effects = solution.effects.iter();
        let is = |effect: &&Estimated| {
            effect.effect.kind == EffectKind::Target && effect.effect.index == index
        };
        let found = effects
            .find(is)
            .filter(|found| found.sigma.iter().any(|own| *own > 0.0));
        let moved = found.map(|found| Vector3::from_row_slice(&found.by) - own.place);
        TargetReport {
            name: own.name.clone(),
            stated_mm: robot.convention.vector(&own.place).into(),
            sigma_mm: own.sigma.into(),
            moved_mm: moved.map(|own| robot.convention.vector(&own).into()),
        }
    };
    robot.instruments.targets.iter().map(of_target).collect()
}

pub(crate) fn transmissions(
    solution: &Solution,
    convention: &Convention,
) -> Vec<TransmissionReport> {
    if !solution.transmissions {
        return Vec::new();
    }
    let found = solution.robot.transmissions().into_iter().enumerate();
    let of_arm = |(arm, transmission): (usize, Transmission<f64>)| {
        let in_degrees = |[gain, harmonics @ ..]: [f64; 5]| {
            let [cos, sin, cos2, sin2] = harmonics.map(degrees);
            [gain, cos, sin, cos2, sin2]
        };
        let sigma = |index| solution.covariance[(index, index)].sqrt();
        let numbers = in_degrees(convention.transmission(transmission.numbers()));
        let [_, cos, sin, cos2, sin2] = numbers;
        TransmissionReport {
            arm: arm + 1,
            numbers,
            sigmas: in_degrees([0, 1, 2, 3, 4].map(|number| sigma(24 + 5 * arm + number))),
            first_harmonic_deg: cos.hypot(sin),
            second_harmonic_deg: cos2.hypot(sin2),
        }
    };
    found.map(of_arm).collect()
}
