//! A robot with towers, and how it is exported.

use super::geometry::{LinearGeometry, PARAMETERS, nearest_symmetric};
use super::target::{LinearFitted, LinearTarget};
use crate::export::error::ExportError;
use crate::export::exported::{Content, Export};
use crate::export::fit::{Task, solve};
use crate::export::frame::Frame;
use crate::export::loss::Loss;
use crate::export::wanted::Wanted;
use crate::files::robot_file::RobotFile;
use delta_cal::{Robot, Tolerance};
use nalgebra::Vector3;

/// The tolerance of a robot whose file states none: mm, radians, mm, no unit.
const TOLERANCE: (f64, f64, f64, f64) = (0.5, 0.003, 5.0, 0.001);

/// An error of the height counts so many times as much as one along x or y: the first layer depends on it.
const HEIGHT: f64 = 10.0;

/// The travels in the middle of where a robot is wanted.
pub(crate) fn middle(robot: &Robot<f64>, wanted: &Wanted) -> Option<[f64; 3]> {
    let mut sum = Vector3::zeros();
    let mut count = 0.0;
    for at in &wanted.evaluated {
        sum += at;
        count += 1.0;
    }
    robot.inverse(&(sum / f64::max(count, 1.0))).ok()
}

/// The robot with equal towers that stands for the one before calibration.
pub(crate) fn nominal(robot: &Robot<f64>, wanted: &Wanted) -> Option<Robot<f64>> {
    nearest_symmetric(robot, &middle(robot, wanted)?).ok()
}

/// For a controller. `level`: the motion after which z is the height above the bed.
pub(crate) fn export(
    file: &RobotFile,
    wanted: &Wanted,
    target: &'static LinearTarget,
    home: Option<[f64; 3]>,
    level: Option<Frame>,
) -> Result<Export, ExportError> {
    let robot = &file.robot;
    let (length, angle, zero, scale) = TOLERANCE;
    let tolerance = match file.tolerance {
        Some(tolerance) => tolerance,
        None => Tolerance::new(length, angle)
            .and_then(|own| own.with_linear(zero, scale))
            .map_err(|_| ExportError::Unreached)?,
    };
    let frame = level.unwrap_or_default();
    let travels = middle(robot, wanted).ok_or(ExportError::Unreached)?;
    let start = LinearGeometry::start(robot, &travels, &frame.transform());
    let (changes, frame) = solve(&Task {
        calibrated: robot,
        wanted,
        controller: &|by| start.changed(&tolerance, by).robot().ok(),
        parameters: PARAMETERS,
        frame,
        // z = 0 and the level are the bed's, and the azimuths hold the turn.
        frame_free: [true, true, false, false, false, false],
        height_weight: HEIGHT,
    })
    .ok_or(ExportError::Unreached)?;
    let (geometry, frame) = (
        start.changed(&tolerance, &changes).rounded(),
        frame.rounded(),
    );
    let controller = geometry.robot().map_err(|_| ExportError::Unreached)?;
    let loss = Loss::of_controller(robot, &controller, &frame.transform(), wanted);
    let written = (target.write)(&LinearFitted {
        geometry,
        home: home.unwrap_or([file.limits.maximum(); 3]),
        home_stated: home.is_some(),
        level: level.is_some(),
        reach: wanted
            .evaluated
            .iter()
            .fold(0.0, |reach, at| f64::max(reach, at.xy().norm())),
    });
    Ok(Export {
        name: target.name,
        title: target.title,
        comment: target.comment,
        content: Content::Fitted(PARAMETERS),
        written,
        frame: Some(frame),
        loss,
        uncalibrated: loss,
        uncalibrated_moved: loss,
        within: None,
        controller: Some(controller),
        conventions: target.conventions.to_vec(),
        source: target.source,
        alternative: "a correction table (--for correction-table), or belts whose rotation_distance holds the scale",
    })
}
