//! Chooses measurements and the order in which to take them; and poses to validate with, none of which the calibration used.

use super::PlanError;
use super::judge::{Judge, Precision};
use super::request::{Kind, LEAST, MOST, Order, PlanRequest};
use super::search::Search;
use super::selection::Selection;
use super::setup::{Planned, Setup};
use crate::accuracy::information::parameters;
use crate::accuracy::uncertainty::{ExpectedError, WorkspacePoses};
use crate::files::ReadingFrom;
use crate::fit::Frame;
use crate::fit::solution::RobotCovariance;
use crate::geometry::below;
use crate::halt::Steps;
use delta_cal::calibration::limits::LARGEST_SIGMA;
use delta_cal::robot::ParameterKind;
use delta_cal::{ArmIndex, Parameter, Robot, Sample};
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use serde::Serialize;

/// Poses over which a region is evaluated.
const REGION_POSES: usize = 300;
/// The number of measurements tried first for a required accuracy.
const TRIED: usize = 20;
/// A third target beside the centre shows all of a platform's tilt.
const MOST_TARGETS: usize = 3;
/// Starting poses tried for a short path.
const STARTS: usize = 24;
/// A pose is another one if some joint differs by more than this fraction of its range.
const APART: f64 = 0.02;
/// Draws for each pose, at most.
const DRAWS: usize = 20;

/// Measurements to take, and the accuracy to expect from them, in the units and axes of the robot file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Name of the robot file.
    pub robot_file: String,
    /// The kinds to choose from, as in `--measure`.
    pub measure: String,
    /// The number of different measurements.
    pub count: usize,
    /// As requested.
    pub order: Order,
    /// As requested.
    pub seed: u64,
    /// Whether the absolute position error is minimised.
    pub absolute: bool,
    /// The requested region.
    pub within: Option<String>,
    /// Noise and tolerance, in words.
    pub assumptions: String,
    /// The height of each plane, where the target touches it, mm.
    pub planes: Vec<(String, f64)>,
    /// The position of each point, mm.
    pub points: Vec<(String, [f64; 3])>,
    /// In order, including repeats.
    pub measurements: Vec<Planned>,
    /// The expected error before any measurement, over the workspace or the region; `None` without a tolerance.
    pub before: Option<Precision>,
    /// The expected error after the measurements.
    #[serde(rename = "planned")]
    pub after: Precision,
    /// What as many measurements of one, two and three targets bring, if the platform's tilt is to be found; further targets
    /// than those stated are turned by 120° about the platform's axis.
    pub by_targets: Vec<Precision>,
    /// The nominal robot's expected error over its workspace or the region, with the worst places.
    #[serde(rename = "expected_error")]
    pub expected: ExpectedError,
    /// The instruments and noise assumed.
    #[serde(skip)]
    pub setup: Setup,
}

/// Plans measurements.
///
/// # Errors
/// An impossible number of measurements or region, instruments out of reach, measurements that cannot determine the
/// robot, or an accuracy that no number of measurements reaches.
///
/// ```
/// use delta_cal_host::files::example;
/// use delta_cal_host::planning::{Kind, PlanRequest, Wishes, plan};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (robot, _) = example::load()?;
/// let plan = plan(&PlanRequest::new(&robot, Wishes::only(Kind::Distance), 12))?;
/// assert!(plan.after.relative < 0.5 * plan.before.unwrap().relative);
/// # Ok(())
/// # }
/// ```
pub fn plan(request: &PlanRequest<'_>) -> Result<Plan, PlanError> {
    let bench = Bench::new(request)?;
    let Some(accuracy) = request.accuracy else {
        return bench.plan(request.count);
    };
    let (mut too_few, mut enough) = (LEAST - 1, None::<Plan>);
    let mut count = TRIED;
    loop {
        let mut next = count + 1;
        match bench.plan(count) {
            Err(PlanError::Singular | PlanError::NotDetermined { .. }) if enough.is_some() => {
                too_few = count;
            }
            tried => {
                let plan = tried?;
                let error = plan.after.of(request.absolute);
                next = needed(count, error / accuracy);
                if error <= accuracy {
                    enough = Some(plan);
                } else if enough.is_none() && next.max(count + 1) > MOST {
                    return Err(PlanError::TooAccurate {
                        wanted: accuracy,
                        reached: error * (count as f64 / MOST as f64).sqrt(),
                    });
                } else {
                    too_few = count;
                }
            }
        }
        count = match enough {
            Some(plan) if plan.count - too_few <= 1 => return Ok(plan),
            Some(ref plan) => next.clamp(too_few + 1, plan.count - 1),
            None => next.max(count + count.div_ceil(20)).min(MOST),
        };
    }
}

/// The fewest measurements that can reduce the error of so many by a factor: it falls at most as 1/√n.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a large number saturates
fn needed(count: usize, factor: f64) -> usize {
    (count as f64 * factor.powi(2)).ceil() as usize
}

/// What plans with different counts share.
struct Bench<'a> {
    request: &'a PlanRequest<'a>,
    setup: Setup,
    selection: Selection<'a>,
    /// Poses in the region.
    within: Option<Vec<Sample<f64>>>,
    judge: Judge,
}

impl<'a> Bench<'a> {
    fn new(request: &'a PlanRequest<'_>) -> Result<Self, PlanError> {
        request.place()?;
        if request.frame == Frame::Sensor && !request.kinds.positions() {
            return Err(PlanError::NoCoordinates);
        }
        let mut rng = Pcg32::seed_from_u64(request.seed);
        let selection = Selection::new(request.robot, request.region);
        let within = match request.region {
            Some(_) => Some(selection.draw_many(REGION_POSES, &mut rng)?),
            None => None,
        };
        Ok(Self {
            request,
            setup: Setup::of(request, within.as_deref()),
            selection,
            judge: Judge::new(request.robot, within.as_deref(), &mut rng)?,
            within,
        })
    }

    fn plan(&self, count: usize) -> Result<Plan, PlanError> {
        if !(LEAST..=MOST).contains(&count) {
            return Err(PlanError::Count(count));
        }
        let (request, setup) = (self.request, &self.setup);
        let mut rng = Pcg32::seed_from_u64(request.seed);
        let (search, found) = self.searched(setup, count, &mut rng)?;
        if found.len() < count {
            return Err(PlanError::TooFewOfAKind(found.len()));
        }
        let measurements = ordered(&found, request.order, &mut rng);
        let rows: Vec<_> = measurements.iter().map(|own| own.reading).collect();
        let robot = &setup.robot.robot;
        let covariance = search.information(&rows)?.robot_covariance();
        let covariance = covariance.ok_or(PlanError::Singular)?;
        if let Some((arm, parameter, sigma)) = unknown_parameter(robot, &covariance) {
            return Err(PlanError::NotDetermined {
                arm,
                parameter,
                sigma,
            });
        }
        let after = self.judge.after(setup, &rows, &search.anchors);
        let tilts = setup.robot.parallelograms.is_some() && request.kinds.positions();
        let numbers = (1..=MOST_TARGETS).filter(|_| tilts);
        let by_targets = numbers.filter_map(|targets| self.with_targets(targets, count));
        let convention = &setup.robot.convention;
        let expected = match (request.region, self.within.clone()) {
            (Some(region), Some(inside)) => {
                let edge = Vec::new();
                let (poses, region) = (WorkspacePoses { inside, edge }, region.turned(convention));
                let within = |at: &Vector3<f64>| region.contains(at);
                ExpectedError::at(
                    (robot, &setup.robot.tool()),
                    &covariance,
                    &setup.robot.reach(),
                    &poses,
                    within,
                )
            }
            _ => ExpectedError::of_robot(&setup.robot, robot, &covariance),
        };
        let planes = setup.planes.iter().zip(&setup.places.planes);
        let height = |offset: f64| {
            convention
                .vector(&(Vector3::z() * (offset + setup.target.z)))
                .z
        };
        let points = setup.points.iter().zip(&setup.places.points);
        let place = |at: &Vector3<f64>| convention.vector(&(at + setup.target)).into();
        Ok(Plan {
            robot_file: request.robot.name.clone(),
            measure: request.kinds.to_string(),
            count,
            order: request.order,
            seed: request.seed,
            absolute: request.absolute,
            within: request.region.map(|own| own.to_string()),
            assumptions: setup.assumptions(&measurements),
            planes: planes
                .map(|(own, at)| (own.name.clone(), height(at.offset)))
                .collect(),
            points: points
                .map(|(own, at)| (own.name.clone(), place(&at.place)))
                .collect(),
            before: self.judge.before(),
            after: after.ok_or(PlanError::Singular)?,
            by_targets: by_targets.collect(),
            expected: expected.ok_or(PlanError::NoPose)?.in_axes_of(convention),
            measurements,
            setup: setup.clone(),
        })
    }
}

impl Bench<'_> {
    /// The best measurements of a set-up, and the search that found them.
    fn searched<'a>(
        &'a self,
        setup: &'a Setup,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<(Search<'a>, Vec<Planned>), PlanError> {
        let weights = self.judge.weights(self.request.absolute);
        let kinds = &self.request.kinds;
        let search = Search::new(setup, kinds, &self.selection, &[], weights, rng)?;
        let unseen = Steps::default();
        let steps = self.request.steps.unwrap_or(&unseen);
        let found = search.best(count, rng, steps)?;
        Ok((search, found))
    }

    /// What so many measurements of so many targets bring; `None` if they determine nothing.
    fn with_targets(&self, targets: usize, count: usize) -> Option<Precision> {
        let setup = &self.setup.with_targets(targets)?;
        let mut rng = Pcg32::seed_from_u64(self.request.seed);
        let (search, found) = self.searched(setup, count, &mut rng).ok()?;
        let rows: Vec<_> = found.iter().map(|own| own.reading).collect();
        self.judge.after(setup, &rows, &search.anchors)
    }
}

/// The parameter, if any, whose σ (mm, radians) would make a calibration refuse, the worst first.
pub(super) fn unknown_parameter(
    robot: &Robot<f64>,
    covariance: &RobotCovariance,
) -> Option<(ArmIndex, Parameter, f64)> {
    let parts = parameters(robot).map(|(arm, parameter)| {
        let index = 8 * arm.index() + parameter.index();
        let sigma = covariance[(index, index)].sqrt();
        let size = match parameter.kind() {
            ParameterKind::Length => robot.arm(arm).upper_arm_length(),
            ParameterKind::Angle | ParameterKind::Ratio => 1.0,
        };
        (sigma / (LARGEST_SIGMA * size), (arm, parameter, sigma))
    });
    let worst = parts.filter(|(part, _)| !(*part <= 1.0));
    let worst = worst.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(worst.1)
}

/// Sorted by set-up, and within a set-up as requested.
fn ordered(measurements: &[Planned], order: Order, rng: &mut Pcg32) -> Vec<Planned> {
    // The instrument that has to be set up, and the gauge block, whose heights are not negative.
    let set_up = |own: &Planned| {
        let instrument = match own.kind {
            Kind::Position(_) => (0, 0),
            Kind::Distance => (1, 0),
            Kind::Plane => (2, own.reading.height.map_or(0, |(plane, _)| plane)),
            Kind::Point => match own.reading.distance {
                Some((ReadingFrom::Point(point), _)) => (3, point),
                _ => (3, 0),
            },
        };
        (instrument, own.block_mm.map_or(0, f64::to_bits))
    };
    let mut sorted = measurements.to_vec();
    sorted.sort_by_key(set_up);
    let mut all: Vec<Planned> = Vec::with_capacity(sorted.len());
    for instrument in sorted.chunk_by(|one, other| set_up(one).0 == set_up(other).0) {
        let first = all.len();
        for group in instrument.chunk_by(|one, other| set_up(one) == set_up(other)) {
            let mut group = group.to_vec();
            if order == Order::Shortest {
                group = short_way(&group);
            } else {
                for place in (1..group.len()).rev() {
                    group.swap(place, below(place + 1, rng));
                }
            }
            all.extend(group);
        }
        if order == Order::Random {
            all.extend(all.get(first).cloned());
        }
    }
    all
}

/// The time between two poses: the largest move of a joint, radians, since all joints move at the same time.
fn apart(from: &Planned, to: &Planned) -> f64 {
    let joints = from.reading.joints.iter().zip(&to.reading.joints);
    let moves = joints.map(|(from, to)| (to - from).abs());
    moves.fold(0.0, f64::max)
}

/// A short path: nearest neighbour from several starting poses, of which the shortest is kept.
fn short_way(stops: &[Planned]) -> Vec<Planned> {
    let way_from = |first: usize| {
        let mut way = stops.to_vec();
        way.swap(0, first);
        for place in 1..way.len() {
            let distance = |stop: &usize| apart(&way[place - 1], &way[*stop]);
            let stops = place..way.len();
            let next = stops.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            way.swap(place, next.unwrap_or(place));
        }
        let length: f64 = way.windows(2).map(|pair| apart(&pair[0], &pair[1])).sum();
        (way, length)
    };
    let stride = stops.len().div_ceil(STARTS).max(1);
    let ways = (0..stops.len()).step_by(stride).map(way_from);
    let shortest = ways.min_by(|a, b| a.1.total_cmp(&b.1));
    shortest.map_or_else(Vec::new, |(way, _)| way)
}

/// Positions to measure at the request's number of random poses, other than those at these joints (radians, mm).
///
/// # Errors
/// An impossible number, or a region out of reach.
pub fn others(request: &PlanRequest<'_>, used: &[[f64; 3]]) -> Result<Vec<Planned>, PlanError> {
    if !(LEAST..=MOST).contains(&request.count) {
        return Err(PlanError::Count(request.count));
    }
    let mut rng = Pcg32::seed_from_u64(request.seed);
    let selection = Selection::new(request.robot, request.region);
    let setup = Setup::of(request, None);
    let limits = &request.robot.limits;
    let least = APART * (limits.maximum() - limits.minimum());
    let is_other = |joints: &[f64; 3]| {
        let near = |own: &[f64; 3]| (0..3).all(|joint| (own[joint] - joints[joint]).abs() <= least);
        !used.iter().any(near)
    };
    let mut poses = selection.draw_many(DRAWS * request.count, &mut rng)?;
    poses.retain(|pose| is_other(&pose.joints) && setup.is_above_planes(&pose.position));
    poses.truncate(request.count);
    if poses.len() < request.count {
        return Err(PlanError::NoPose);
    }
    let targets = (0..setup.targets.len().max(1)).cycle();
    let planned = targets.zip(&poses);
    Ok(planned
        .map(|(target, pose)| setup.planned(Kind::XYZ, target, pose))
        .collect())
}

/// The same measurements with names, a prefix and a number, and repeated so many times, one round after another.
pub fn labelled(mut rows: Vec<Planned>, prefix: Option<&str>, repeats: usize) -> Vec<Planned> {
    let again =
        rows.len() > 1 && rows.first().map(|own| own.joints) == rows.last().map(|own| own.joints);
    if repeats > 1 && again {
        rows.pop();
    }
    let width = rows.len().to_string().len();
    if let Some(prefix) = prefix.or((repeats > 1).then_some("P")) {
        for (number, row) in (1..).zip(&mut rows) {
            row.name = Some(format!("{prefix}{number:0width$}"));
        }
    }
    if repeats <= 1 {
        return rows;
    }
    let rounds = (1..=repeats).flat_map(|round| {
        rows.iter().map(move |row| Planned {
            repeat: Some(round),
            ..row.clone()
        })
    });
    rounds.collect()
}
