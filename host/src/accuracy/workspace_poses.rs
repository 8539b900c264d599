//! A fixed set of poses that stands for the whole workspace.

use crate::files::robot_file::RobotFile;
use crate::geometry::reach::Reach;
use delta_cal::{Robot, Sample};

/// Poses inside. Near the edges the position's σ changes several times within a few degrees.
pub(crate) const INSIDE: usize = 2000;
/// Joint angles that are tried for them; a robot may get to few of them.
const TRIED: u32 = 100_000;
/// Parts of each joint's range between which the edge is looked for.
const EDGE_PARTS: u32 = 8;
/// Halvings of such a part.
const HALVINGS: u32 = 10;

/// Poses all over the workspace, clear of singularities
/// ([`is_clear`](delta_cal::kinematics::SingularityDistance::is_clear)).
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspacePoses {
    /// Evenly spread in joint space, 2000 where the robot has as many: a mean over them weighs equal
    /// volumes of joint space alike. They are the clear ones of a sequence of low discrepancy
    /// (Roberts 2018: multiples of 1/φ, 1/φ² and 1/φ³ modulo 1, φ⁴ = φ + 1).
    pub inside: Vec<Sample<f64>>,
    /// On the edge: a joint at its limit, or as near to a singularity as a clear pose may be.
    pub edge: Vec<Sample<f64>>,
}

impl WorkspacePoses {
    /// Of the robot of a file.
    pub fn of(file: &RobotFile) -> Self {
        Self::within(&file.robot, &file.reach())
    }

    /// Of a robot.
    pub fn within(robot: &Robot<f64>, reach: &Reach) -> Self {
        Self {
            inside: inside(robot, reach),
            edge: edge(robot, reach),
        }
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &Sample<f64>> {
        self.inside.iter().chain(&self.edge)
    }
}

/// See [`WorkspacePoses::inside`].
pub(crate) fn inside(robot: &Robot<f64>, reach: &Reach) -> Vec<Sample<f64>> {
    first_inside(robot, reach, INSIDE)
}

/// So many of them.
pub(crate) fn first_inside(robot: &Robot<f64>, reach: &Reach, count: usize) -> Vec<Sample<f64>> {
    (1..=TRIED)
        .map(|index| spread_evenly(index).map(|part| reach.limits.at(part)))
        .filter_map(|joints| clear_pose(robot, reach, joints))
        .take(count)
        .collect()
}

/// The pose at these joint angles, if the robot gets there and is clear of singularities.
pub(super) fn clear_pose(
    robot: &Robot<f64>,
    reach: &Reach,
    joints: [f64; 3],
) -> Option<Sample<f64>> {
    let position = reach.clear_position(robot, &joints).ok()?;
    Some(Sample { joints, position })
}

/// The clear poses of a grid that spans the joints' range with a joint at its limit, and between two
/// neighbours of which one is clear the last pose that is.
fn edge(robot: &Robot<f64>, reach: &Reach) -> Vec<Sample<f64>> {
    let ends = EDGE_PARTS + 1;
    let index = |node: u32| [node / ends / ends, node / ends % ends, node % ends];
    let angles = |at: [u32; 3]| {
        at.map(|part| {
            reach
                .limits
                .at(f64::from(part) / f64::from(EDGE_PARTS))
                .clamp(reach.limits.minimum(), reach.limits.maximum())
        })
    };
    let nodes: Vec<_> = (0..ends.pow(3))
        .map(|node| clear_pose(robot, reach, angles(index(node))))
        .collect();
    let mut found = Vec::new();
    for (node, pose) in (0..).zip(&nodes) {
        let at = index(node);
        if let Some(pose) = pose
            && at.iter().any(|part| *part == 0 || *part == EDGE_PARTS)
        {
            found.push(*pose);
        }
        for (joint, step) in [ends * ends, ends, 1].into_iter().enumerate() {
            if at[joint] == EDGE_PARTS {
                continue;
            }
            let beyond = node + step;
            let other = nodes.get(beyond as usize).and_then(Option::as_ref);
            let (clear, beyond) = match (pose, other) {
                (Some(pose), None) => (pose, angles(index(beyond))),
                (None, Some(other)) => (other, angles(at)),
                _ => continue,
            };
            found.push(last_clear(robot, reach, *clear, beyond));
        }
    }
    found
}

/// The last clear pose on the way from a clear one to joint angles that are not.
fn last_clear(
    robot: &Robot<f64>,
    reach: &Reach,
    clear: Sample<f64>,
    beyond: [f64; 3],
) -> Sample<f64> {
    let (mut clear, mut beyond) = (clear, beyond);
    for _ in 0..HALVINGS {
        let middle = [0, 1, 2].map(|joint| f64::midpoint(clear.joints[joint], beyond[joint]));
        match clear_pose(robot, reach, middle) {
            Some(pose) => clear = pose,
            None => beyond = middle,
        }
    }
    clear
}

/// A point of the sequence in the unit cube.
fn spread_evenly(index: u32) -> [f64; 3] {
    const STEP: f64 = 1.0 / 1.220_744_084_605_759_5;
    let multiple = f64::from(index);
    [STEP, STEP * STEP, STEP * STEP * STEP].map(|step| (0.5 + multiple * step).fract())
}
