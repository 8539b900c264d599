//! Where a printer prints, and how far off it is there.

use crate::accuracy::uncertainty::{ExpectedError, PositionUncertainty, WorkspacePoses};
use crate::files::robot_file::RobotFile;
use crate::fit::solution::RobotCovariance;
use delta_cal::frame::RigidTransform;
use delta_cal::{Robot, Sample};
use nalgebra::{Vector2, Vector3};
use serde::Serialize;
use std::f64::consts::TAU;

/// Circles of positions around the centre, and positions on each.
const CIRCLES: u32 = 4;
const ON_A_CIRCLE: u32 = 12;
/// Layers, from the bed up to this part of the height that the carriages allow.
const LAYERS: u32 = 4;
const UP_TO: f64 = 0.6;

/// A grid of poses over the printed area.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    /// Of the bed, mm.
    pub radius: f64,
    /// On the bed, and above it.
    pub poses: Vec<Sample<f64>>,
}

impl Area {
    /// What a robot reaches of the cylinder above its bed.
    pub fn of(file: &RobotFile, radius: f64) -> Self {
        let robot = &file.robot;
        let highest = robot.forward(&[file.limits.maximum(); 3]);
        let top = highest.map_or(0.0, |at| at.z.max(0.0));
        let mut poses = Vec::new();
        for layer in 0..LAYERS {
            let z = UP_TO * top * f64::from(layer) / f64::from(LAYERS);
            for at in bed(radius, CIRCLES, ON_A_CIRCLE) {
                let position = Vector3::new(at[0], at[1], z);
                if let Ok(joints) = robot.inverse(&position)
                    && joints.iter().all(|joint| {
                        (file.limits.minimum()..=file.limits.maximum()).contains(joint)
                    })
                {
                    poses.push(Sample { joints, position });
                }
            }
        }
        Self { radius, poses }
    }

    /// The positions.
    pub fn positions(&self) -> Vec<Vector3<f64>> {
        self.poses.iter().map(|pose| pose.position).collect()
    }

    /// The position error that a robot with this covariance of its parameters is expected to have, one σ, rms, mm:
    /// after the best rigid motion.
    pub fn expected(&self, file: &RobotFile, covariance: &RobotCovariance) -> Option<f64> {
        let uncertainty = PositionUncertainty {
            robot: &file.robot,
            covariance,
        };
        let poses = WorkspacePoses {
            inside: self.poses.clone(),
            edge: Vec::new(),
        };
        let error = ExpectedError::of(&uncertainty, &file.reach(), &poses)?;
        Some(error.intrinsic.rms)
    }
}

/// The centre and circles around it, the largest of this radius.
pub(super) fn bed(radius: f64, circles: u32, on_a_circle: u32) -> Vec<[f64; 2]> {
    let mut places = vec![[0.0; 2]];
    for circle in 1..=circles {
        let out = radius * f64::from(circle) / f64::from(circles);
        for index in 0..on_a_circle {
            let (sine, cosine) = (TAU * f64::from(index) / f64::from(on_a_circle)).sin_cos();
            places.push([out * cosine, out * sine]);
        }
    }
    places
}

/// How far a nozzle is from where its controller believes, over the area.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Off {
    /// Of its height over the bed: rms, mm.
    #[serde(rename = "height_rms_mm")]
    pub height: f64,
    /// The largest of these.
    #[serde(rename = "height_worst_mm")]
    pub worst_height: f64,
    /// What 100 mm on the bed become, mm.
    #[serde(rename = "hundred_mm_become_mm")]
    pub hundred: f64,
}

impl Off {
    /// Of a controller with these kinematics, whose frame is this one of the calibrated robot's.
    pub(super) fn of(
        calibrated: &Robot<f64>,
        controller: &Robot<f64>,
        frame: &RigidTransform<f64>,
        radius: f64,
    ) -> Option<Self> {
        let mut pairs = Vec::new();
        for [x, y] in bed(radius, CIRCLES, ON_A_CIRCLE) {
            let wanted = Vector3::new(x, y, 0.0);
            let joints = controller.inverse(&wanted).ok();
            let is = joints.and_then(|joints| calibrated.forward(&joints).ok());
            if let Some(is) = is {
                pairs.push((wanted, frame.apply(&is)));
            }
        }
        if pairs.len() < 3 {
            return None;
        }
        #[allow(clippy::cast_precision_loss)] // some dozens
        let count = pairs.len() as f64;
        let squares = pairs.iter().map(|(wanted, is)| (is.z - wanted.z).powi(2));
        let worst = pairs.iter().map(|(wanted, is)| (is.z - wanted.z).abs());
        let mean = pairs.iter().map(|(_, is)| is.xy()).sum::<Vector2<f64>>() / count;
        let along = pairs
            .iter()
            .map(|(wanted, is)| wanted.xy().dot(&(is.xy() - mean)));
        let lengths = pairs.iter().map(|(wanted, _)| wanted.xy().norm_squared());
        Some(Self {
            height: (squares.sum::<f64>() / count).sqrt(),
            worst_height: worst.fold(0.0, f64::max),
            hundred: 100.0 * along.sum::<f64>() / lengths.sum::<f64>(),
        })
    }
}
