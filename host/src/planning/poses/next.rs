//! Which poses to add to those that are measured.

use super::candidates::{Margin, Selection};
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
}

/// The poses that are best added, `request.count` of them, to poses at these joint angles.
///
/// # Errors
/// Limits or a region that exclude everything.
pub fn next_poses(
    request: &PlanRequest<'_>,
    measured: &[Sample<f64>],
) -> Result<NextPoses, PlanError> {
    let assumptions = Assumptions::of(request.robot)?;
    let margin = Margin::of(request.robot);
    let selection = Selection::new(request.robot, margin, request.region.as_ref());
    let mut rng = Pcg32::seed_from_u64(request.seed);
    let search = Search {
        request,
        assumptions: &assumptions,
        selection: &selection,
    };
    let poses = search.added(measured, &mut rng)?;
    let yardstick = Yardstick::new(request, &selection, &mut rng)?;
    let all: Vec<_> = measured.iter().chain(&poses).copied().collect();
    Ok(NextPoses {
        before: yardstick.expectation(measured, &assumptions),
        after: yardstick.expectation(&all, &assumptions),
        poses,
    })
}
