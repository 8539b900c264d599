//! Plans measurements.

use super::candidates::Candidates;
use super::kind::Kind;
use super::planned::Planned;
use super::precision::{Judge, Precision};
use super::request::{LEAST_MEASUREMENTS, MeasurementRequest};
use super::sequence::in_sequence;
use super::setup::{Setup, workspace};
use crate::accuracy::expected_error::ExpectedError;
use crate::planning::design::{Effort, Source, added, all_over, nearer};
use crate::planning::poses::{MOST_POSES, PlanError, RANDOM_SETS, Selection, determined};
use delta_cal::Sample;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// Poses that a region is judged over.
const REGION_POSES: usize = 300;

/// Random sets that a search begins with: fewer of more measurements, for they differ less.
fn starts(count: usize) -> usize {
    (240 / count.max(1)).clamp(4, 12)
}

/// Measurements to take, and what to expect of a calibration from them.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasurementPlan {
    /// Sorted by instrument, gauge block and point, each of them in the order of a short travel.
    pub measurements: Vec<Planned>,
    /// What was planned for.
    pub setup: Setup,
    /// Before any measurement; `None` without a tolerance.
    pub before: Option<Precision>,
    /// After them.
    pub after: Precision,
    /// The nominal robot's expected error after them, with its worst places.
    pub expected: ExpectedError,
    /// The median of what [`RANDOM_SETS`] sets of as many random measurements would give; `None` if most of
    /// them would not determine the robot.
    pub random: Option<Precision>,
}

/// Plans measurements.
///
/// # Errors
/// A number of measurements or a region without sense, instruments out of reach, or measurements that cannot
/// determine the robot without a tolerance.
///
/// ```
/// use delta_cal_host::files::example;
/// use delta_cal_host::planning::measurements::{Kind, MeasurementRequest, Wishes, plan_measurements};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (robot, _) = example::load()?;
/// let request = MeasurementRequest::new(&robot, Wishes::only(Kind::Distance), 12);
/// let plan = plan_measurements(&request)?;
/// assert!(plan.after.intrinsic < 0.5 * plan.before.unwrap().intrinsic);
/// # Ok(())
/// # }
/// ```
pub fn plan_measurements(request: &MeasurementRequest<'_>) -> Result<MeasurementPlan, PlanError> {
    let effort = Effort::thorough(starts(request.count));
    Bench::new(request)?.plan(request, &[], &effort)
}

/// What plans for the same robot and region have in common.
pub(super) struct Bench<'a> {
    selection: Selection<'a>,
    judge: Judge,
    /// Of the nominal robot, evenly spread over its workspace.
    poses: Vec<Sample<f64>>,
}

impl<'a> Bench<'a> {
    /// The request's kinds and instruments do not matter.
    pub(super) fn new(request: &'a MeasurementRequest<'_>) -> Result<Self, PlanError> {
        let mut rng = Pcg32::seed_from_u64(request.seed);
        let selection = Selection::new(request.robot, request.region.as_ref());
        let poses = workspace(request.robot);
        let judged = match request.region {
            Some(_) => selection.draw_many(REGION_POSES, &mut rng)?,
            None => poses.clone(),
        };
        Ok(Self {
            selection,
            judge: Judge::new(request.robot, &judged, &mut rng)?,
            poses,
        })
    }

    /// `begin`: a smaller plan of the same request, which one of the searches enlarges; or none.
    pub(super) fn plan(
        &self,
        request: &MeasurementRequest<'_>,
        begin: &[Planned],
        effort: &Effort,
    ) -> Result<MeasurementPlan, PlanError> {
        if request.count < LEAST_MEASUREMENTS {
            return Err(PlanError::TooFewMeasurements(request.count));
        }
        if request.count > MOST_POSES {
            return Err(PlanError::TooMany(request.count));
        }
        let setup = Setup::new(request, &self.poses);
        let coordinates = |kind: Kind| kind.coordinates().iter().filter(|read| **read).count();
        let most = request.kinds.0.iter().map(|wish| coordinates(wish.kind));
        if most.max() > Some(1) {
            self.planned::<3>(request, setup, begin, effort)
        } else {
            self.planned::<1>(request, setup, begin, effort)
        }
    }

    /// `R`: readings of a measurement at most.
    fn planned<const R: usize>(
        &self,
        request: &MeasurementRequest<'_>,
        setup: Setup,
        begin: &[Planned],
        effort: &Effort,
    ) -> Result<MeasurementPlan, PlanError> {
        let mut rng = Pcg32::seed_from_u64(request.seed);
        let (selection, judge) = (&self.selection, &self.judge);
        let source = Candidates::<R>::new(request, &setup, selection, judge, &mut rng)?;
        let count = request.count;
        let mut found = all_over(&source, count, effort, &mut rng)?;
        if !begin.is_empty() {
            let more = added(&source, begin, count.saturating_sub(begin.len()), &mut rng)?;
            let all = more.map(|more| begin.iter().cloned().chain(more).collect());
            let grown = all.and_then(|all| nearer(&source, all, effort, &mut rng));
            let both = found.into_iter().chain(grown);
            found = both.min_by(|a, b| a.value.total_cmp(&b.value));
        }
        let found = found.ok_or(PlanError::Singular)?.chosen;
        if found.len() < count {
            return Err(PlanError::TooFewOfAKind(found.len()));
        }
        let after = judge.after(&setup, &found).ok_or(PlanError::Singular)?;
        let nominal = judge.nominal(&setup, &found);
        let (covariance, expected) = nominal.ok_or(PlanError::Singular)?;
        let sigma = |arm: usize, own: usize| covariance[(8 * arm + own, 8 * arm + own)].sqrt();
        let sigmas = [0, 1, 2].map(|arm| std::array::from_fn(|own| sigma(arm, own)));
        determined(&request.robot.robot, &sigmas)?;
        let mut random = Vec::with_capacity(RANDOM_SETS);
        for set in 0..RANDOM_SETS {
            let drawn = source.draw_many(count, &mut rng)?;
            random.push(judge.after_of_one(&setup, &drawn[..count.min(drawn.len())], set));
        }
        Ok(MeasurementPlan {
            measurements: in_sequence(&found),
            before: judge.before(&setup),
            after,
            expected,
            random: median(&random),
            setup,
        })
    }
}

fn median(sets: &[Option<Precision>]) -> Option<Precision> {
    let of = |figure: &dyn Fn(&Precision) -> f64| {
        let figures = sets
            .iter()
            .map(|set| set.as_ref().map_or(f64::INFINITY, figure));
        let mut figures: Vec<_> = figures.collect();
        figures.sort_by(f64::total_cmp);
        figures
            .get(figures.len() / 2)
            .copied()
            .filter(|figure| figure.is_finite())
    };
    Some(Precision {
        intrinsic: of(&|own| own.intrinsic)?,
        absolute: of(&|own| own.absolute)?,
    })
}
