//! The arms' closure errors over their joint angles, and what the causes found make of them.

use super::cause::{Cause, CauseKind};
use super::subject::{Corrections, Counted, frame_movements};
use delta_cal::{ArmIndex, Robot};

/// Points of a curve.
const POINTS: u32 = 60;

/// One arm's closure errors over its joint angle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ArmResiduals {
    /// Joint angle (radians) and f/(2 Lb) (mm, along the forearm) of every sample that counts, with the
    /// parameters as they are once the causes found are taken into account.
    pub points: Vec<(f64, f64)>,
    /// The same of the causes found in this joint, where the other joints have their mean angles; two
    /// curves of a backlash, one for each direction. Empty if none was found.
    pub curves: Vec<Vec<(f64, f64)>>,
}

pub(super) fn arms(
    robot: &Robot<f64>,
    counted: &[Counted],
    found: &[Cause],
    corrections: Option<&Corrections>,
) -> [ArmResiduals; 3] {
    let number = counted.iter().fold(0.0, |count, _| count + 1.0);
    let mean = std::array::from_fn(|joint| {
        let sum: f64 = counted.iter().map(|c| c.sample.joints[joint]).sum();
        sum / number
    });
    ArmIndex::ALL.map(|index| {
        let arm = robot.arm(index);
        let points = counted.iter().map(|c| {
            let q = c.sample.joints[index.index()];
            let mut residual = c.sample.position - c.at.position;
            if let Some(corrections) = corrections {
                residual -= c.at.jacobian() * corrections.parameters;
                let movements = frame_movements(&c.sample.position);
                for (movement, by) in movements.iter().zip(corrections.frame) {
                    residual -= movement * by;
                }
            }
            let gradient = arm.constraint_by_position(&c.at.position, q);
            (q, gradient.dot(&residual) / (2.0 * arm.lb()))
        });
        let points: Vec<_> = points.collect();
        let own: Vec<_> = found
            .iter()
            .filter(|cause| cause.arm == Some(index))
            .collect();
        ArmResiduals {
            curves: curves(robot, index, &points, mean, &own),
            points,
        }
    })
}

fn curves(
    robot: &Robot<f64>,
    index: ArmIndex,
    points: &[(f64, f64)],
    mean: [f64; 3],
    own: &[&Cause],
) -> Vec<Vec<(f64, f64)>> {
    if own.is_empty() {
        return Vec::new();
    }
    let backlash = own.iter().any(|cause| cause.kind == CauseKind::Backlash);
    let directions: &[f64] = if backlash { &[-1.0, 1.0] } else { &[0.0] };
    let angles = points.iter().map(|point| point.0);
    let (low, high) = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| {
        (low.min(q), high.max(q))
    });
    let arm = robot.arm(index);
    let at = |q: f64, direction: f64| {
        let mut joints = mean;
        joints[index.index()] = q;
        let position = robot.forward(&joints).ok()?;
        let error: f64 = own
            .iter()
            .map(|cause| cause.joint_error(q, direction))
            .sum();
        let closure = -arm.constraint_by_joint(&position, q) * error;
        Some((q, closure / (2.0 * arm.lb())))
    };
    directions
        .iter()
        .map(|direction| {
            (0..=POINTS)
                .map(|point| low + (high - low) * f64::from(point) / f64::from(POINTS))
                .filter_map(|q| at(q, *direction))
                .collect()
        })
        .collect()
}
