//! Which poses to add to those that are measured.

use super::candidates::Selection;
use super::expectation::{Expectation, Yardstick};
use super::search::Search;
use super::{Assumptions, PlanError, PlanRequest};
use delta_cal::Sample;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// Poses to add, and what they are worth.
#[derive(Debug, Clone, PartialEq)]
pub struct NextPoses {
    /// In the order of their worth: each is the best to add to all before it.
    pub poses: Vec<Sample<f64>>,
    /// What the measured poses give; `None` if they do not determine the robot.
    pub before: Option<Expectation>,
    /// What they give with the new ones.
    pub after: Option<Expectation>,
    /// Why no pose can be added: the limits or what the candidates tell.
    pub obstacle: Option<PlanError>,
}

/// The poses that are best added, `request.count` of them, to poses at these joint angles.
///
/// Limits that leave no pose to add are no error: the poses that are measured are judged all the same.
///
/// # Errors
/// A region that excludes everything.
pub fn next_poses(
    request: &PlanRequest<'_>,
    measured: &[Sample<f64>],
) -> Result<NextPoses, PlanError> {
    let assumptions = Assumptions::of(request.robot)?;
    let selection = Selection::new(request.robot, request.region.as_ref());
    let mut rng = Pcg32::seed_from_u64(request.seed);
    let search = Search {
        request,
        assumptions: &assumptions,
        selection: &selection,
    };
    let (poses, obstacle) = match search.added(measured, &mut rng) {
        Ok(poses) => (poses, None),
        Err(error @ (PlanError::NoPose | PlanError::Singular)) => (Vec::new(), Some(error)),
        Err(error) => return Err(error),
    };
    let yardstick = match Yardstick::new(request, &selection, &mut rng) {
        Ok(yardstick) => Some(yardstick),
        Err(PlanError::NoPose) => None,
        Err(error) => return Err(error),
    };
    let expected = |poses: &[Sample<f64>]| yardstick.as_ref()?.expectation(poses, &assumptions);
    let all: Vec<_> = measured.iter().chain(&poses).copied().collect();
    Ok(NextPoses {
        before: expected(measured),
        after: expected(&all),
        poses,
        obstacle,
    })
}
