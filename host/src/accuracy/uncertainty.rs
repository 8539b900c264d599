//! Uncertainty of positions due to that of the parameters, at a pose and over the whole workspace.

use super::rigid_motion::RigidMotions;
use crate::files::{Convention, RobotFile, Tool, Tooled};
use crate::fit::solution::{OF_ROBOT, PARAMETERS, RobotCovariance, WITH_TRANSMISSIONS};
use crate::geometry::{Reach, centroid};
use crate::halt;
use crate::order;
use delta_cal::{Robot, Sample};
use nalgebra::{SMatrix, Vector3};
use serde::Serialize;

/// J = ∂X/∂P (3.18) of a tool at a pose (`x`, `q`) of the robot: all 24 parameters, arm by arm; with P = 51 also the
/// transmissions' and the rods' numbers. `None` at a singular pose.
pub(crate) fn jacobian<const P: usize>(
    robot: &Robot<f64>,
    tool: &Tool,
    x: &Vector3<f64>,
    q: &[f64; 3],
) -> Option<SMatrix<f64, 3, P>> {
    let blocks = robot.platform_jacobian(x, q).ok()?.by_parameters;
    let mut jacobian = SMatrix::<f64, 3, P>::zeros();
    for (arm, block) in blocks.iter().enumerate() {
        jacobian.fixed_columns_mut::<8>(8 * arm).copy_from(block);
    }
    if P == OF_ROBOT {
        let by_transmissions = robot.by_transmissions(x, q).ok()?;
        jacobian
            .columns_mut(PARAMETERS, WITH_TRANSMISSIONS - PARAMETERS)
            .copy_from(&by_transmissions);
        if let Some(rods) = &tool.parallelograms {
            jacobian
                .columns_mut(WITH_TRANSMISSIONS, OF_ROBOT - WITH_TRANSMISSIONS)
                .copy_from(&rods.columns(robot, (x, q), &tool.place)?);
        }
    }
    Some(jacobian)
}

/// tr(J C Jᵀ): the variance of a position, mm², for the covariance C of the parameters (mm, radians). `None` if it is not
/// positive.
pub(crate) fn variance<const P: usize>(
    covariance: &SMatrix<f64, P, P>,
    jacobian: &SMatrix<f64, 3, P>,
) -> Option<f64> {
    // Multiplying along the long columns of Jᵀ is three times as fast as three numbers at a time.
    let transposed = jacobian.transpose();
    let variance = (covariance * transposed).dot(&transposed);
    (variance >= 0.0).then_some(variance)
}

/// Poses of a robot that are not singular, each with J = ∂X/∂P.
pub(crate) struct Sensitivities<const P: usize>(pub(crate) Vec<(Sample<f64>, SMatrix<f64, 3, P>)>);

impl<const P: usize> Sensitivities<P> {
    pub(crate) fn of(
        robot: &Robot<f64>,
        tool: &Tool,
        poses: impl IntoIterator<Item = Sample<f64>>,
    ) -> Self {
        let known = poses.into_iter().filter_map(|pose| {
            let jacobian = jacobian(robot, tool, &pose.position, &pose.joints)?;
            Some((pose, jacobian))
        });
        Self(known.collect())
    }

    /// What removes from J the rigid motions that explain most of all J. `None` if the positions do not determine a rigid
    /// motion.
    fn rigid_motion(&self) -> Option<RigidMotion<P>> {
        let motions = RigidMotions::of(self.0.iter().map(|(pose, _)| pose.position))?;
        let all = self.0.iter();
        let explained = motions.explaining(all.map(|(pose, own)| (&pose.position, own)));
        Some(RigidMotion { motions, explained })
    }

    /// The same for relative positions: after the rigid motion that fits best.
    pub(crate) fn relative(&self) -> Option<Self> {
        Some(self.rigid_motion()?.removed_from(self))
    }

    /// The variance of the squared position error over the poses, relative to its squared mean: of a normal error of the
    /// parameters with covariance C, from E|e|⁴ = (tr S)² + 2 tr S² with S = J C Jᵀ.
    pub(crate) fn variation(&self, covariance: &SMatrix<f64, P, P>) -> f64 {
        let fourth = self.0.iter().map(|(_, jacobian)| {
            let own = jacobian * covariance * jacobian.transpose();
            own.trace() * own.trace() + 2.0 * own.norm_squared()
        });
        let mean = self.mean_square() * covariance;
        let square = mean.trace() * mean.trace() + 2.0 * mean.dot(&mean.transpose());
        fourth.sum::<f64>() / self.0.len() as f64 / square - 1.0
    }

    /// The mean W of JᵀJ: with the covariance C of the parameters, tr(W C) is the mean square of the position error.
    pub(crate) fn mean_square(&self) -> SMatrix<f64, P, P> {
        let mut sum = SMatrix::<f64, P, P>::zeros();
        for (_, jacobian) in &self.0 {
            for own in jacobian.transpose().column_iter() {
                sum.syger(1.0, &own, &own, 1.0);
            }
        }
        sum.fill_upper_triangle_with_lower_triangle();
        sum / self.0.len() as f64
    }
}

/// The rigid motion that explains most of J over some poses.
pub(crate) struct RigidMotion<const P: usize> {
    motions: RigidMotions,
    explained: SMatrix<f64, 6, P>,
}

impl<const P: usize> RigidMotion<P> {
    fn left(&self, position: &Vector3<f64>, jacobian: &SMatrix<f64, 3, P>) -> SMatrix<f64, 3, P> {
        jacobian - self.motions.at(position) * self.explained
    }

    fn removed_from(&self, all: &Sensitivities<P>) -> Sensitivities<P> {
        let left =
            |(pose, jacobian): &(Sample<f64>, _)| (*pose, self.left(&pose.position, jacobian));
        Sensitivities(all.0.iter().map(left).collect())
    }
}

/// J throughout a robot's workspace, of absolute and of relative positions.
pub(crate) struct Throughout<const P: usize> {
    pub(crate) absolute: Sensitivities<P>,
    pub(crate) relative: Sensitivities<P>,
    rigid: RigidMotion<P>,
}

impl<const P: usize> Throughout<P> {
    /// `None` if the positions do not determine a rigid motion.
    pub(crate) fn of((robot, tool): Tooled<'_>, poses: &[Sample<f64>]) -> Option<Self> {
        let absolute = Sensitivities::of(robot, tool, poses.iter().copied());
        let rigid = absolute.rigid_motion()?;
        Some(Self {
            relative: rigid.removed_from(&absolute),
            absolute,
            rigid,
        })
    }

    /// W of the mean squares tr(W C) of absolute and relative errors, C being the covariance of the robot.
    fn weights(&self) -> Weights {
        [&self.absolute, &self.relative].map(|own| {
            let mut weights = Box::new(RobotCovariance::zeros());
            weights
                .fixed_view_mut::<P, P>(0, 0)
                .copy_from(&own.mean_square());
            weights
        })
    }
}

/// W of the mean squares tr(W C) of absolute and relative position errors.
pub(crate) type Weights = [Box<RobotCovariance>; 2];

/// [`Weights`] over poses; those of transmissions and rods only where they are `uncertain`, which takes three times as long.
pub(crate) fn weights(
    tooled: Tooled<'_>,
    poses: &[Sample<f64>],
    uncertain: bool,
) -> Option<Weights> {
    if uncertain {
        Some(Throughout::<OF_ROBOT>::of(tooled, poses)?.weights())
    } else {
        Some(Throughout::<PARAMETERS>::of(tooled, poses)?.weights())
    }
}

/// Number of poses inside. Near the edges, σ changes several times within a few degrees.
pub(crate) const INSIDE: usize = 2000;
/// Most joint angles tried to find them; some robots reach few.
const TRIED: u32 = 100_000;
/// Intervals of each joint's range in which the edge is searched.
const EDGE_PARTS: u32 = 8;
/// Bisections of such an interval.
const HALVINGS: u32 = 10;

/// Poses throughout the workspace, clear of singularities
/// ([`is_clear`](delta_cal::kinematics::SingularityDistance::is_clear)).
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspacePoses {
    /// Evenly spread in joint space, 2000 if the robot reaches as many, so a mean over them weights joint space
    /// uniformly. They are the clear poses of a low-discrepancy sequence (Roberts 2018: multiples of 1/φ, 1/φ² and 1/φ³
    /// modulo 1, φ⁴ = φ + 1).
    pub inside: Vec<Sample<f64>>,
    /// On the edge: a joint at its limit, or as close to a singularity as a clear pose may be.
    pub edge: Vec<Sample<f64>>,
}

impl WorkspacePoses {
    /// For a robot.
    pub fn of(robot: &Robot<f64>, reach: &Reach) -> Self {
        Self {
            inside: inside(robot, reach),
            edge: edge(robot, reach),
        }
    }
}

/// See [`WorkspacePoses::inside`].
pub(crate) fn inside(robot: &Robot<f64>, reach: &Reach) -> Vec<Sample<f64>> {
    first_inside(robot, reach, INSIDE)
}

/// The first `count` of them.
pub(crate) fn first_inside(robot: &Robot<f64>, reach: &Reach, count: usize) -> Vec<Sample<f64>> {
    (1..=TRIED)
        .map(|index| spread_evenly(index).map(|part| reach.limits.at(part)))
        .filter_map(|joints| clear_pose(robot, reach, joints))
        .take(count)
        .collect()
}

/// The pose at these joint angles, if the robot reaches it and it is clear of singularities.
pub(super) fn clear_pose(
    robot: &Robot<f64>,
    reach: &Reach,
    joints: [f64; 3],
) -> Option<Sample<f64>> {
    halt::check();
    let position = reach.clear_position(robot, &joints).ok()?;
    let works = reach.within.is_none_or(|own| own.contains(&position));
    works.then_some(Sample { joints, position })
}

/// The clear poses of a grid over the joints' range with a joint at its limit; and, between neighbours of which only
/// one is clear, the last clear pose.
fn edge(robot: &Robot<f64>, reach: &Reach) -> Vec<Sample<f64>> {
    let (low, high) = (reach.limits.minimum(), reach.limits.maximum());
    let angle = |part: u32| reach.limits.at(f64::from(part) / f64::from(EDGE_PARTS));
    let angles = |at: [u32; 3]| at.map(|part| angle(part).clamp(low, high));
    let ends = EDGE_PARTS + 1;
    let index = |node: u32| [node / ends / ends, node / ends % ends, node % ends];
    let poses = (0..ends.pow(3)).map(|node| clear_pose(robot, reach, angles(index(node))));
    let poses: Vec<_> = poses.collect();
    let mut found = Vec::new();
    for (node, pose) in (0..).zip(&poses) {
        let at = index(node);
        let at_limit = at.iter().any(|part| *part == 0 || *part == EDGE_PARTS);
        found.extend(pose.filter(|_| at_limit));
        for (joint, step) in [ends * ends, ends, 1].into_iter().enumerate() {
            let Some(other) = poses.get((node + step) as usize) else {
                continue;
            };
            if at[joint] == EDGE_PARTS {
                continue;
            }
            let (clear, beyond) = match (pose, other) {
                (Some(pose), None) => (pose, index(node + step)),
                (None, Some(other)) => (other, at),
                _ => continue,
            };
            found.push(last_clear(robot, reach, *clear, angles(beyond)));
        }
    }
    found
}

/// The last clear pose on the way from a clear pose to joint angles that are not.
fn last_clear(
    robot: &Robot<f64>,
    reach: &Reach,
    mut clear: Sample<f64>,
    mut beyond: [f64; 3],
) -> Sample<f64> {
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

/// Number of poses, the worst of all, from which the search for the worst place starts.
const STARTS: usize = 12;
/// The search ends at steps below this fraction of the joints' range.
const FINEST: f64 = 1e-3;
/// Its first steps, as a fraction of the range.
const COARSEST: f64 = 1.0 / 16.0;

/// The expected position error, one σ: over poses evenly spread in joint space within the limits and clear of
/// singularities, and at the worst place ([`WorkspacePoses`]).
///
/// At each pose it is √tr(J C Jᵀ), with C the covariance of the parameters and J = ∂X/∂P (3.18).
///
/// Relative: after removal of the best-fitting rigid motion over all poses, J less six columns of a rigid motion, by least
/// squares. The figures to use where the robot's place in space is not measured, or is taught anew.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExpectedError {
    /// In the frame of the robot's base, rms over the workspace.
    pub absolute_rms_mm: f64,
    /// At the worst place.
    pub absolute_worst_mm: f64,
    /// Where that is.
    pub absolute_worst_at_mm: [f64; 3],
    /// After the best rigid motion, rms over the workspace.
    pub relative_rms_mm: f64,
    /// At the worst place.
    pub relative_worst_mm: f64,
    /// Where that is.
    pub relative_worst_at_mm: [f64; 3],
    /// Relative, over the tenth of the poses that are outermost, rms.
    pub relative_outermost_mm: f64,
    /// Over the others.
    pub relative_others_mm: f64,
}

impl ExpectedError {
    /// With the worst places in the axes of a robot file.
    pub(crate) fn in_axes_of(self, convention: &Convention) -> Self {
        let at = |own: [f64; 3]| convention.vector(&own.into()).into();
        Self {
            absolute_worst_at_mm: at(self.absolute_worst_at_mm),
            relative_worst_at_mm: at(self.relative_worst_at_mm),
            ..self
        }
    }

    /// For a robot with this covariance of its parameters, within the limits of a file.
    pub(crate) fn of_robot(
        file: &RobotFile,
        robot: &Robot<f64>,
        covariance: &RobotCovariance,
    ) -> Option<Self> {
        let reach = file.reach();
        let poses = WorkspacePoses::of(robot, &reach);
        let tool = file.tool();
        Self::at((robot, &tool), covariance, &reach, &poses, |_| true)
    }

    /// At poses of the robot that are known already, the worst where positions are `within`; `None` if no pose is clear of
    /// singularities.
    pub(crate) fn at(
        tooled: Tooled<'_>,
        covariance: &RobotCovariance,
        reach: &Reach,
        poses: &WorkspacePoses,
        within: impl Fn(&Vector3<f64>) -> bool,
    ) -> Option<Self> {
        if (PARAMETERS..OF_ROBOT).any(|place| covariance[(place, place)] > 0.0) {
            let there = Throughout::of(tooled, &poses.inside)?;
            Self::over(&there, tooled, covariance, (reach, &poses.edge), within)
        } else {
            let there = Throughout::of(tooled, &poses.inside)?;
            let of_parameters = covariance.fixed_view::<PARAMETERS, PARAMETERS>(0, 0);
            let known = (reach, &poses.edge[..]);
            Self::over(&there, tooled, &of_parameters.into(), known, within)
        }
    }

    /// The same where J is known.
    pub(crate) fn over<const P: usize>(
        there: &Throughout<P>,
        (robot, tool): Tooled<'_>,
        covariance: &SMatrix<f64, P, P>,
        (reach, edge): (&Reach, &[Sample<f64>]),
        within: impl Fn(&Vector3<f64>) -> bool,
    ) -> Option<Self> {
        let edge = Sensitivities::of(robot, tool, edge.iter().copied());
        let each = |of: &Sensitivities<P>| {
            let all = of.0.iter();
            let all = all.filter_map(|(pose, own)| Some((variance(covariance, own)?, *pose)));
            all.collect::<Vec<_>>()
        };
        let at = |joints: [f64; 3], left: &dyn Fn(&Vector3<f64>, &_) -> SMatrix<f64, 3, P>| {
            let pose = clear_pose(robot, reach, joints).filter(|own| within(&own.position))?;
            let own = jacobian(robot, tool, &pose.position, &pose.joints)?;
            Some((variance(covariance, &left(&pose.position, &own))?, pose))
        };
        let absolute = Extent::of(
            each(&there.absolute),
            each(&edge),
            (reach, &|joints| at(joints, &|_, own| *own)),
        )?;
        let relative = Extent::of(
            each(&there.relative),
            each(&there.rigid.removed_from(&edge)),
            (reach, &|joints| {
                at(joints, &|position, own| there.rigid.left(position, own))
            }),
        )?;
        Some(Self {
            absolute_rms_mm: absolute.rms,
            absolute_worst_mm: absolute.worst,
            absolute_worst_at_mm: absolute.worst_at,
            relative_rms_mm: relative.rms,
            relative_worst_mm: relative.worst,
            relative_worst_at_mm: relative.worst_at,
            relative_outermost_mm: relative.outermost,
            relative_others_mm: relative.others,
        })
    }
}

/// A variance, mm², and the pose where it is so large.
type At = (f64, Sample<f64>);

/// σ of positions over a workspace, mm.
struct Extent {
    rms: f64,
    worst: f64,
    worst_at: [f64; 3],
    /// Over the tenth of the poses that are outermost, rms.
    outermost: f64,
    /// Over the others.
    others: f64,
}

impl Extent {
    fn of(
        mut all: Vec<At>,
        edge: Vec<At>,
        (reach, at): (&Reach, &dyn Fn([f64; 3]) -> Option<At>),
    ) -> Option<Self> {
        let rms = |own: &[At]| {
            let sum: f64 = own.iter().map(|(variance, _)| variance).sum();
            f64::sqrt(sum / f64::max(own.len() as f64, 1.0))
        };
        let of_all = rms(&all);
        let centre = centroid(all.iter().map(|(_, pose)| pose.position));
        let far = |pose: &Sample<f64>| (pose.position - centre).norm_squared();
        order::sort_by(&mut all, |own| -far(&own.1));
        let (outer, inner) = all.split_at(all.len() / 10);
        let [outermost, others] = [outer, inner].map(rms);
        all.extend(edge);
        order::sort_by(&mut all, |own| -own.0);
        let starts = all.into_iter().take(STARTS);
        let (largest, worst) = starts
            .map(|start| worst_from(start, reach, at))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Self {
            rms: of_all,
            worst: largest.sqrt(),
            worst_at: worst.position.into(),
            outermost,
            others,
        })
    }
}

/// Steps the joints from a pose towards larger variances; halves the step when none is larger.
fn worst_from(start: At, reach: &Reach, at: &dyn Fn([f64; 3]) -> Option<At>) -> At {
    let (mut largest, mut pose) = start;
    let (low, high) = (reach.limits.minimum(), reach.limits.maximum());
    let mut step = COARSEST * (high - low);
    while step > FINEST * (high - low) {
        // At a limit several directions lead to one place.
        let mut tried = vec![pose.joints];
        let next = directions().find_map(|direction| {
            let joints = [0, 1, 2]
                .map(|joint| (pose.joints[joint] + step * direction[joint]).clamp(low, high));
            if tried.contains(&joints) {
                return None;
            }
            tried.push(joints);
            at(joints).filter(|(found, _)| *found > largest)
        });
        match next {
            Some(found) => (largest, pose) = found,
            None => step *= 0.5,
        }
    }
    (largest, pose)
}

/// The 26 non-zero combinations of −1, 0 and 1.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let digits = |code: u32| Vector3::new(code / 9, code / 3 % 3, code % 3);
    (0..27)
        .filter(|code| *code != 13)
        .map(move |code| digits(code).map(|digit| f64::from(digit) - 1.0))
}
