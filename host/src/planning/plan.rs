//! Chooses measurements and the order in which to take them.

use super::PlanError;
use super::judge::{Information, Judge, Precision};
use super::request::{Kind, LEAST, MOST, Region, Wishes, below};
use super::search::Search;
use super::selection::Selection;
use super::setup::{Planned, Setup};
use crate::accuracy::information::parameters;
use crate::accuracy::uncertainty::ExpectedError;
use crate::files::robot_file::RobotFile;
use crate::fit::Frame;
use crate::fit::solution::RobotCovariance;
use delta_cal::calibration::limits::LARGEST_SIGMA;
use delta_cal::robot::ParameterKind;
use delta_cal::{ArmIndex, Parameter, Robot, Sample};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use serde::Serialize;

/// Poses over which a region is evaluated.
const REGION_POSES: usize = 300;
/// The number of measurements tried first for a required accuracy.
const TRIED: usize = 20;

/// A request for measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest<'a> {
    /// The robot as it is known, with its instruments, their noise and its tolerance.
    pub robot: &'a RobotFile,
    /// The kinds to choose from.
    pub kinds: Wishes,
    /// The number of measurements.
    pub count: usize,
    /// The frame of coordinates.
    pub frame: Frame,
    /// Where the platform may be, in the axes of the robot file; anywhere if `None`.
    pub region: Option<Region>,
    /// Minimise the absolute position error instead of the relative one.
    pub absolute: bool,
    /// The order in which they are taken.
    pub order: Order,
    /// The same seed gives the same plan.
    pub seed: u64,
}

impl<'a> PlanRequest<'a> {
    /// `count` measurements of these kinds anywhere, minimising the relative error, in random order.
    pub fn new(robot: &'a RobotFile, kinds: Wishes, count: usize) -> Self {
        Self {
            robot,
            kinds,
            count,
            frame: Frame::Base,
            region: None,
            absolute: false,
            order: Order::Random,
            seed: 1,
        }
    }
}

/// Measurements to take, and the accuracy to expect from them.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// In order, including repeats.
    pub measurements: Vec<Planned>,
    /// The number of different measurements.
    pub count: usize,
    /// The instruments and noise assumed.
    pub setup: Setup,
    /// The expected error before any measurement; `None` without a tolerance.
    pub before: Option<Precision>,
    /// The expected error after the measurements.
    pub after: Precision,
    /// The nominal robot's expected error over its whole workspace, with the worst places.
    pub expected: ExpectedError,
}

/// Plans measurements.
///
/// # Errors
/// An impossible number of measurements or region, instruments out of reach, or measurements that cannot determine
/// the robot.
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
    Bench::new(request)?.plan(request)
}

/// The fewest measurements expected to reduce the position error to `accuracy` (mm, rms). The request's count is
/// ignored.
///
/// # Errors
/// As [`plan`], and an accuracy that no number of measurements reaches.
pub fn plan_for(request: &PlanRequest<'_>, accuracy: f64) -> Result<Plan, PlanError> {
    let bench = Bench::new(request)?;
    let of = |count: usize| {
        let request = PlanRequest {
            count,
            ..request.clone()
        };
        bench.plan(&request)
    };
    let (mut too_few, mut enough) = (LEAST - 1, None::<Plan>);
    let mut count = TRIED;
    loop {
        let mut next = count + 1;
        match of(count) {
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
    selection: Selection<'a>,
    judge: Judge,
}

impl<'a> Bench<'a> {
    fn new(request: &'a PlanRequest<'_>) -> Result<Self, PlanError> {
        let mut rng = Pcg32::seed_from_u64(request.seed);
        let selection = Selection::new(request.robot, request.region);
        let within = match request.region {
            Some(_) => Some(selection.draw_many(REGION_POSES, &mut rng)?),
            None => None,
        };
        Ok(Self {
            selection,
            judge: Judge::new(request.robot, within.as_deref(), &mut rng)?,
        })
    }

    fn plan(&self, request: &PlanRequest<'_>) -> Result<Plan, PlanError> {
        if !(LEAST..=MOST).contains(&request.count) {
            return Err(PlanError::Count(request.count));
        }
        let setup = Setup::of(request);
        let mut rng = Pcg32::seed_from_u64(request.seed);
        let weights = self.judge.weights(request.absolute);
        let (kinds, selection) = (&request.kinds, &self.selection);
        let search = Search::new(&setup, kinds, selection, &[], weights, &mut rng)?;
        let found = search.best(request.count, &mut rng)?;
        let count = found.len();
        if count < request.count {
            return Err(PlanError::TooFewOfAKind(count));
        }
        let measurements = ordered(&found, request.order, &mut rng);
        let rows: Vec<_> = measurements.iter().map(|own| setup.row(own)).collect();
        let information = Information::of(&setup.robot, &setup, &rows, &search.anchors)?;
        let covariance = information.robot_covariance();
        let covariance = covariance.ok_or(PlanError::Singular)?;
        if let Some((arm, parameter, sigma)) = unknown_parameter(&setup.robot.robot, &covariance) {
            return Err(PlanError::NotDetermined {
                arm,
                parameter,
                sigma,
            });
        }
        let after = self.judge.after(&setup, &rows, &search.anchors);
        Ok(Plan {
            before: self.judge.before(),
            after: after.ok_or(PlanError::Singular)?,
            expected: ExpectedError::of_robot(&setup.robot, &setup.robot.robot, &covariance)
                .ok_or(PlanError::NoPose)?,
            measurements,
            count,
            setup,
        })
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
    worst
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, found)| found)
}

/// Starting poses tried for a short path.
const STARTS: usize = 24;

/// The order of the measurements within each set-up: a gauge block, or a sensor at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// Random, with each instrument's first measurement repeated as its last. A drift then cannot be mistaken for an
    /// error of the parameters, and shows in the repeated measurement.
    #[default]
    Random,
    /// A short path of the joints.
    Shortest,
}

/// The instrument that has to be set up for a measurement.
fn instrument(own: &Planned) -> (usize, usize) {
    match own.kind {
        Kind::Position(_) => (0, 0),
        Kind::Distance => (1, 0),
        Kind::Plane => (2, own.plane.map_or(0, |(plane, _)| plane)),
        Kind::Point => (3, own.point.unwrap_or(0)),
    }
}

/// Sorted by set-up, and within a set-up as requested.
pub(super) fn ordered(measurements: &[Planned], order: Order, rng: &mut Pcg32) -> Vec<Planned> {
    let block = |own: &Planned| own.plane.map_or(0, |(_, block)| block);
    let mut groups: Vec<_> = measurements
        .iter()
        .map(|own| (instrument(own), block(own)))
        .collect();
    groups.sort_unstable();
    groups.dedup();
    let mut all: Vec<Planned> = Vec::with_capacity(measurements.len() + groups.len());
    let mut first = 0;
    for (index, group) in groups.iter().enumerate() {
        let members = measurements.iter();
        let members = members.filter(|own| (instrument(own), block(own)) == *group);
        let mut members: Vec<_> = members.cloned().collect();
        match order {
            Order::Shortest => all.extend(short_way(&members)),
            Order::Random => {
                for place in (1..members.len()).rev() {
                    members.swap(place, below(place + 1, rng));
                }
                all.extend(members);
                let next = groups.get(index + 1);
                if next.is_none_or(|(instrument, _)| *instrument != group.0) {
                    all.extend(all.get(first).cloned());
                    first = all.len();
                }
            }
        }
    }
    all
}

/// The distance between two poses: the largest move of a joint, radians, since all joints move at the same time.
fn apart(from: &Sample<f64>, to: &Sample<f64>) -> f64 {
    let moves = from.joints.iter().zip(&to.joints);
    moves
        .map(|(from, to)| (to - from).abs())
        .fold(0.0, f64::max)
}

/// A short path: nearest neighbour from several starting poses, of which the shortest is kept.
fn short_way(stops: &[Planned]) -> Vec<Planned> {
    let length = |way: &[Planned]| -> f64 {
        let steps = way.windows(2);
        steps.map(|pair| apart(&pair[0].pose, &pair[1].pose)).sum()
    };
    let stride = stops.len().div_ceil(STARTS).max(1);
    let firsts = (0..stops.len()).step_by(stride);
    let ways = firsts.map(|first| nearest_first(stops, first));
    ways.min_by(|a, b| length(a).total_cmp(&length(b)))
        .unwrap_or_default()
}

fn nearest_first(stops: &[Planned], first: usize) -> Vec<Planned> {
    let mut left = stops.to_vec();
    let mut here = left.swap_remove(first);
    let mut way = vec![here.clone()];
    let distance = |here: &Planned, to: &Planned| apart(&here.pose, &to.pose);
    while let Some(next) = (0..left.len())
        .min_by(|a, b| distance(&here, &left[*a]).total_cmp(&distance(&here, &left[*b])))
    {
        here = left.swap_remove(next);
        way.push(here.clone());
    }
    way
}
