//! Points that are measured elsewhere on the platform than at the platform point.

use super::findings::Finding;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Readings;
use crate::fit::options::Frame;
use nalgebra::Vector3;

/// The points are off by the same if their mean offset is so many times their scatter about it…
const SAME: f64 = 4.0;
/// …and more than this part of the forearm.
const LEAST: f64 = 0.005;
/// …and more than so many σ of the arms' height as the tolerance has it: end stops move all points, too.
const SIGMAS: f64 = 3.0;

/// That the measured point may be a reflector or a tip, where all points are off by nearly the same.
#[allow(clippy::cast_precision_loss)] // far fewer than 2^52
pub(super) fn beside_the_platform_point(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
) -> Option<Finding> {
    if frame == Frame::Sensor || robot.instruments.target.is_some() {
        return None;
    }
    let offsets: Vec<Vector3<f64>> = readings
        .samples()
        .filter_map(|row| Some(row.value.position - robot.robot.forward(&row.value.joints).ok()?))
        .collect();
    let number = offsets.len() as f64;
    let mean = offsets.iter().sum::<Vector3<f64>>() / number;
    let squares: f64 = offsets.iter().map(|own| (own - mean).norm_squared()).sum();
    let scatter_mm = (squares / number).sqrt();
    let [arm, ..] = robot.robot.arms();
    let [_, _, height, ..] = robot
        .tolerance
        .map_or([0.0; 8], |tolerance| tolerance.of_places(arm));
    let least = (LEAST * arm.lb()).max(SIGMAS * height);
    // Of no points at all the mean is no number.
    let offset_mm = mean.data.0[0];
    (mean.norm() > SAME * scatter_mm && mean.norm() > least).then_some(Finding::Target {
        offset_mm,
        scatter_mm,
    })
}
