//! The position error that a calibrated robot is expected to have, over the whole workspace.

use crate::accuracy::position_uncertainty::{PositionSigma, PositionUncertainty};
use crate::accuracy::rigid_motion::RigidMotions;
use crate::accuracy::workspace_poses::{WorkspacePoses, clear_pose};
use crate::geometry::reach::Reach;
use delta_cal::{Robot, Sample};
use nalgebra::{SMatrix, Vector3};

/// Poses from which the worst place is looked for: the worst of all.
const STARTS: usize = 12;
/// The search for the worst place ends at steps below this part of the joints' range.
const FINEST: f64 = 1e-3;
/// It begins with steps of this part.
const COARSEST: f64 = 1.0 / 16.0;

/// The expected position error, one σ: over poses evenly spread in joint space within the limits and
/// clear of singularities, and at the worst place ([`WorkspacePoses`]).
///
/// With the covariance C of the parameters it is, at each pose, √tr(J C Jᵀ), J = ∂X/∂P (3.18).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedError {
    /// In the frame in which the robot was measured.
    pub absolute: PositionSigma,
    /// What remains after the rigid motion that explains most of the error over all poses: J less the
    /// six columns of a rigid motion, by least squares. It counts where the robot's place in space is
    /// not measured, or taught anew.
    pub intrinsic: PositionSigma,
}

impl ExpectedError {
    /// `None` if no pose is clear of singularities.
    pub fn of<const P: usize>(
        uncertainty: &PositionUncertainty<'_, P>,
        reach: &Reach,
        poses: &WorkspacePoses,
    ) -> Option<Self> {
        let points = poses.inside.iter().map(|pose| pose.position);
        let motions = RigidMotions::of(points)?;
        let jacobians = poses.inside.iter().filter_map(|pose| {
            let jacobian = uncertainty.jacobian(&pose.position, &pose.joints)?;
            Some((pose.position, jacobian))
        });
        let explained = motions.explaining(jacobians);
        let over = |variance: &dyn Fn(&Sample<f64>) -> Option<f64>| {
            let search = Search {
                robot: uncertainty.robot,
                reach,
                variance,
            };
            over(&poses.inside, &poses.edge, &search)
        };
        Some(Self {
            absolute: over(&|pose| variance(uncertainty, pose, None))?,
            intrinsic: over(&|pose| variance(uncertainty, pose, Some((&motions, &explained))))?,
        })
    }
}

type Explained<'a, const P: usize> = (&'a RigidMotions, &'a SMatrix<f64, 6, P>);

/// tr(J C Jᵀ) at a pose; of what is left of J by the rigid motions that explain most of it.
fn variance<const P: usize>(
    uncertainty: &PositionUncertainty<'_, P>,
    pose: &Sample<f64>,
    explained: Option<Explained<'_, P>>,
) -> Option<f64> {
    let mut jacobian = uncertainty.jacobian(&pose.position, &pose.joints)?;
    if let Some((motions, explained)) = explained {
        jacobian -= motions.at(&pose.position) * explained;
    }
    // The long columns of Jᵀ: three numbers at a time would take three times as long.
    let transposed = jacobian.transpose();
    let variance = (uncertainty.covariance * transposed).dot(&transposed);
    (variance >= 0.0).then_some(variance)
}

/// The mean of a variance inside, and the largest: steps from the worst poses of all lead to worse
/// ones between them.
fn over(
    inside: &[Sample<f64>],
    edge: &[Sample<f64>],
    search: &Search<'_>,
) -> Option<PositionSigma> {
    let (mut sum, mut count) = (0.0, 0_u32);
    let mut found = Vec::with_capacity(inside.len() + edge.len());
    for pose in inside {
        if let Some(variance) = (search.variance)(pose) {
            sum += variance;
            count += 1;
            found.push((variance, *pose));
        }
    }
    let outside = edge.iter();
    found.extend(outside.filter_map(|pose| Some(((search.variance)(pose)?, *pose))));
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (largest, at) = found
        .into_iter()
        .take(STARTS)
        .map(|start| search.worst_from(start))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(PositionSigma {
        rms: (sum / f64::from(count)).sqrt(),
        max: largest.sqrt(),
        max_at: at.position,
        poses: count,
    })
}

/// A variance at a pose, and where poses are.
struct Search<'a> {
    robot: &'a Robot<f64>,
    reach: &'a Reach,
    variance: &'a dyn Fn(&Sample<f64>) -> Option<f64>,
}

impl Search<'_> {
    /// Steps of the joints to larger variances, halved where there is none.
    fn worst_from(&self, start: (f64, Sample<f64>)) -> (f64, Sample<f64>) {
        let (mut largest, mut at) = start;
        let limits = &self.reach.limits;
        let range = limits.maximum() - limits.minimum();
        let mut step = COARSEST * range;
        while step > FINEST * range {
            let next = directions().find_map(|direction| {
                let joints = [0, 1, 2].map(|joint| {
                    (at.joints[joint] + step * direction[joint])
                        .clamp(limits.minimum(), limits.maximum())
                });
                let pose = clear_pose(self.robot, self.reach, joints)?;
                let found = (self.variance)(&pose)?;
                (found > largest).then_some((found, pose))
            });
            match next {
                Some((found, pose)) => (largest, at) = (found, pose),
                None => step *= 0.5,
            }
        }
        (largest, at)
    }
}

/// The 26 combinations of −1, 0 and 1 but for none.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let digits = |code: u32| Vector3::new(code / 9, code / 3 % 3, code % 3);
    (0..27)
        .filter(|code| *code != 13)
        .map(move |code| digits(code).map(|digit| f64::from(digit) - 1.0))
}
