//! Plans poses.

use super::assumptions::Assumptions;
use super::candidates::Selection;
use super::clearance::Margin;
use super::error::PlanError;
use super::expectation::{Expectation, Known, Yardstick, determined};
use super::request::{LEAST_POSES, MOST_POSES, PlanRequest};
use super::search::Search;
use super::travel::{length, ordered};
use delta_cal::Sample;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// Poses to measure, and what to expect of a calibration from them.
#[derive(Debug, Clone, PartialEq)]
pub struct PosePlan {
    /// In the order of a short travel: joint angles in whole thousandths of a degree, and the
    /// nominal robot's positions there to the nanometre.
    pub poses: Vec<Sample<f64>>,
    /// The noise and the tolerance that were planned for.
    pub assumptions: Assumptions,
    /// By how much the poses are inside the limits, at least.
    pub margin: Margin,
    /// What to expect.
    pub planned: Expectation,
    /// Whether a calibration from these poses would find every parameter without the tolerance, too.
    pub determined_alone: bool,
    /// The median of what [`RANDOM_SETS`](super::RANDOM_SETS) sets of as many random poses would give: `None` if most of
    /// them would not determine the robot.
    pub random: Expectation,
    /// Travel in the order of the poses, radians ([`length`]).
    pub travel: f64,
    /// Travel in the order in which they were found.
    pub travel_unordered: f64,
}

/// Plans poses.
///
/// # Errors
/// Fewer than 8 poses or more than 500, limits or a region that exclude everything, or poses that
/// cannot determine the parameters with this noise.
///
/// ```
/// use delta_cal_host::planning::poses::{PlanRequest, plan};
/// use delta_cal_host::files::example;
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (robot, _) = example::load()?;
/// let request = PlanRequest { count: 12, ..PlanRequest::new(&robot) };
/// let plan = plan(&request)?;
/// assert!(plan.planned.workspace.rms < plan.random.workspace.rms);
/// # Ok(())
/// # }
/// ```
pub fn plan(request: &PlanRequest<'_>) -> Result<PosePlan, PlanError> {
    let assumptions = Assumptions::of(request.robot)?;
    let selection = Selection::new(request.robot, request.region.as_ref());
    let mut rng = Pcg32::seed_from_u64(request.seed);
    let (found, planned, yardstick) = chosen(request, &assumptions, &selection, &mut rng)?;
    let random = yardstick.random_median(&selection, &assumptions, &mut rng)?;
    let alone = Assumptions {
        tolerance: None,
        ..assumptions
    };
    let by_themselves = yardstick.of_nominal(&found, &alone);
    let robot = &request.robot.robot;
    let poses = ordered(&found);
    Ok(PosePlan {
        travel: length(&poses),
        travel_unordered: length(&found),
        poses,
        assumptions,
        margin: Margin::of(request.robot, &found),
        planned,
        determined_alone: by_themselves
            .is_some_and(|alone| determined(robot, &alone.parameters).is_ok()),
        random,
    })
}

/// The poses that [`plan`] plans, without what to expect of them.
///
/// # Errors
/// As [`plan`].
pub fn poses(request: &PlanRequest<'_>) -> Result<Vec<Sample<f64>>, PlanError> {
    let assumptions = Assumptions::of(request.robot)?;
    let selection = Selection::new(request.robot, request.region.as_ref());
    let mut rng = Pcg32::seed_from_u64(request.seed);
    let found = found(request, &assumptions, &selection, &mut rng)?;
    let robot = &request.robot.robot;
    let joints: Vec<_> = found.iter().map(|pose| pose.joints).collect();
    let known = Known::after(request.method, robot, &joints, &assumptions);
    determined(robot, &known.ok_or(PlanError::Singular)?.sigmas())?;
    Ok(ordered(&found))
}

/// What to expect of the poses that [`plan`] plans.
///
/// # Errors
/// As [`plan`].
pub fn expected(request: &PlanRequest<'_>) -> Result<Expectation, PlanError> {
    let assumptions = Assumptions::of(request.robot)?;
    let selection = Selection::new(request.robot, request.region.as_ref());
    let mut rng = Pcg32::seed_from_u64(request.seed);
    chosen(request, &assumptions, &selection, &mut rng).map(|(_, planned, _)| planned)
}

/// The best poses, as they were found.
fn found(
    request: &PlanRequest<'_>,
    assumptions: &Assumptions,
    selection: &Selection<'_>,
    rng: &mut Pcg32,
) -> Result<Vec<Sample<f64>>, PlanError> {
    if request.count < LEAST_POSES {
        return Err(PlanError::TooFew(request.count));
    }
    if request.count > MOST_POSES {
        return Err(PlanError::TooMany(request.count));
    }
    let search = Search {
        request,
        assumptions,
        selection,
    };
    search.run(rng)
}

/// The same, what to expect of them, and by what that is judged.
fn chosen<'a>(
    request: &'a PlanRequest<'_>,
    assumptions: &Assumptions,
    selection: &Selection<'_>,
    rng: &mut Pcg32,
) -> Result<(Vec<Sample<f64>>, Expectation, Yardstick<'a>), PlanError> {
    let found = found(request, assumptions, selection, rng)?;
    let yardstick = Yardstick::new(request, selection, rng)?;
    let planned = yardstick
        .expectation(&found, assumptions)
        .ok_or(PlanError::Singular)?;
    determined(&request.robot.robot, &planned.parameters)?;
    Ok((found, planned, yardstick))
}
