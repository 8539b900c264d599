//! Wrong numbers of the robot file, common to all arms: the robot is not as far from them as the tolerance allows.

use super::EffectKind;
use delta_cal::robot::{Parameter, ParameterKind};
use delta_cal::{Real, Robot};
use nalgebra::Vector3;

/// Step of a difference quotient.
const STEP: f64 = 1e-6;

/// Displacement of the position at joint angles by this much of a number: a fraction of it, or an angle an arm.
pub(super) fn displacement(
    kind: EffectKind,
    robot: &Robot<f64>,
    joints: &[f64; 3],
    by: &[f64],
) -> Option<Vector3<f64>> {
    let here = robot.forward(joints).ok()?;
    let there = match kind {
        EffectKind::Gears => robot.forward(&joints.map(|q| q * (1.0 + by[0]))),
        _ => changed(kind, robot, by)?.forward(joints),
    };
    Some(there.ok()? - here)
}

/// Its derivative by each unknown.
pub(super) fn columns(
    kind: EffectKind,
    robot: &Robot<f64>,
    joints: &[f64; 3],
) -> Vec<Vector3<f64>> {
    let unknowns = 0..kind.unknowns();
    let of = |unknown: usize| {
        let mut by = [0.0; 3];
        by[unknown] = STEP;
        displacement(kind, robot, joints, &by).unwrap_or_default() / STEP
    };
    unknowns.map(of).collect()
}

fn changed(kind: EffectKind, robot: &Robot<f64>, by: &[f64]) -> Option<Robot<f64>> {
    let drive = robot.drive();
    let mut parameters = robot.parameters();
    for (arm, own) in parameters.iter_mut().enumerate() {
        let factor = 1.0 + by[0];
        match kind {
            EffectKind::Zeros => turn(own, by[arm]),
            EffectKind::Radius => (own[0], own[1]) = (own[0] * factor, own[1] * factor),
            EffectKind::Forearm => own[7] *= factor,
            EffectKind::UpperArm => (own[5], own[6]) = (own[5] * factor, own[6] * factor),
            _ => {
                for (value, parameter) in own.iter_mut().zip(drive.places()) {
                    let scales = parameter.is_some_and(|own| {
                        own.kind() == ParameterKind::Length || own == Parameter::Scale
                    });
                    if scales {
                        *value *= factor;
                    }
                }
            }
        }
    }
    robot.with_parameters(parameters).ok()
}

/// Turns an arm's upper arm by an angle about its joint.
fn turn(parameters: &mut [f64; 8], by: f64) {
    let (sine, cosine) = by.sine_cosine();
    let [x, y] = [parameters[5], parameters[6]];
    (parameters[5], parameters[6]) = (cosine * x - sine * y, sine * x + cosine * y);
}

/// The robot with all joint zeros changed by an angle.
pub(crate) fn turned(robot: &Robot<f64>, by: f64) -> Option<Robot<f64>> {
    changed(EffectKind::Zeros, robot, &[by; 3])
}
