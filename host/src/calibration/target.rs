//! Points that are measured elsewhere on the platform than at the platform point.

use crate::files::robot_file::RobotFile;
use crate::fit::options::Frame;
use delta_cal::Sample;
use nalgebra::Vector3;

/// The points are off by the same if their mean offset is so many times their scatter about it…
const SAME: f64 = 4.0;
/// …and more than this part of the forearm.
const LEAST: f64 = 0.005;
/// …and more than so many σ of the arms' height as the tolerance has it: end stops move all points, too.
const SIGMAS: f64 = 3.0;

/// That the measured point may be a reflector or a tip, where all points are off by nearly the same.
#[allow(clippy::cast_precision_loss)] // far fewer than 2^52
pub(super) fn beside_the_platform_point<'a>(
    robot: &RobotFile,
    frame: Frame,
    measured: impl Iterator<Item = &'a Sample<f64>>,
) -> Option<String> {
    if frame == Frame::Sensor || robot.instruments.target.is_some() {
        return None;
    }
    let offset = |sample: &Sample<f64>| {
        let expected = robot.robot.forward(&sample.joints).ok()?;
        Some(sample.position - expected)
    };
    let offsets: Vec<Vector3<f64>> = measured.filter_map(offset).collect();
    let number = offsets.len() as f64;
    let mean = offsets.iter().sum::<Vector3<f64>>() / number;
    let squares: f64 = offsets.iter().map(|own| (own - mean).norm_squared()).sum();
    let scatter = (squares / number).sqrt();
    let [arm, ..] = robot.robot.arms();
    let [_, _, height, ..] = robot
        .tolerance
        .map_or([0.0; 8], |tolerance| tolerance.of_places(arm));
    let least = (LEAST * arm.lb()).max(SIGMAS * height);
    // Of no points at all the mean is no number.
    if !(mean.norm() > SAME * scatter && mean.norm() > least) {
        return None;
    }
    let level = mean.xy().norm() < mean.z.abs() / SAME;
    let place = match (level, mean.z < 0.0) {
        (true, true) => "below",
        (true, false) => "above",
        _ => "beside",
    };
    let [x, y, z] = mean.data.0[0];
    Some(format!(
        "all measured points are {:.1} mm {place} where {} puts the platform point, within {scatter:.1} \
         mm. If a reflector or a tip is measured that is mounted there, state its place in {}: \
         [target] with x_mm = {x:.1}, y_mm = {y:.1}, z_mm = {z:.1}, better as measured on the \
         platform; if the samples' frame is not exactly the robot's, use --frame sensor",
        mean.norm(),
        robot.name,
        robot.name,
    ))
}
