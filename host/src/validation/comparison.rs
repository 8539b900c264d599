//! Two files of one robot: how far its positions moved over the workspace, and whether that is more than their σ.

use crate::accuracy::expanded::of_vectors;
use crate::accuracy::rigid_motion::{RigidMotions, moved};
use crate::accuracy::uncertainty::inside;
use crate::files::input::InputError;
use crate::files::robot_file::RobotFile;
use serde::Serialize;

/// A change of so many σ is more than chance.
const CHANGED: f64 = 2.0;

/// How positions moved from one file to another of the same robot, mm, in the axes of the second.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The older file.
    pub from: String,
    /// The newer file.
    pub to: String,
    /// Poses that are compared.
    pub poses: usize,
    /// Mean, rms and largest absolute change along x, y and z and in space, in the frame of the base.
    pub absolute_mm: [[f64; 3]; 4],
    /// The same after the best rigid motion.
    pub relative_mm: [[f64; 3]; 4],
    /// σ of the absolute and of the relative change, rms over the workspace: the expected errors that both files state.
    pub sigma_mm: Option<[f64; 2]>,
    /// Whether the absolute and the relative change exceed 2 σ.
    pub changed: Option<[bool; 2]>,
}

impl Comparison {
    /// Compares two files at poses all over the newer robot's workspace.
    ///
    /// # Errors
    /// The drives differ, or the workspaces have no pose in common.
    pub fn of(from: &RobotFile, to: &RobotFile) -> Result<Self, InputError> {
        let fault = |cause: &str| {
            InputError::new(&from.name, cause)
                .with_remedy("give two files of the same robot, the older one first")
        };
        if from.robot.drive() != to.robot.drive() {
            return Err(fault("one robot has towers and the other has not"));
        }
        let poses = inside(&to.robot, &to.reach());
        let moved = moved(&from.robot, &poses);
        let motions = RigidMotions::of(moved.iter().map(|(at, _)| *at));
        let motions = motions.ok_or_else(|| fault("the two robots have no workspace in common"))?;
        let stated = |own: &nalgebra::Vector3<f64>| to.convention.vector(own);
        let absolute: Vec<_> = moved.iter().map(|(_, by)| stated(by)).collect();
        let relative: Vec<_> = motions.removed(&moved).iter().map(stated).collect();
        let expected = from.instruments.expected.zip(to.instruments.expected);
        let sigma_mm = expected.map(|(a, b)| [0, 1].map(|kind| f64::hypot(a[kind], b[kind])));
        let (absolute_mm, relative_mm) = (of_vectors(&absolute), of_vectors(&relative));
        let rms = [absolute_mm[3][1], relative_mm[3][1]];
        Ok(Self {
            from: from.name.clone(),
            to: to.name.clone(),
            poses: moved.len(),
            absolute_mm,
            relative_mm,
            sigma_mm,
            changed: sigma_mm.map(|sigma| [0, 1].map(|kind| rms[kind] > CHANGED * sigma[kind])),
        })
    }
}
