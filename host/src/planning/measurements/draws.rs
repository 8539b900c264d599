//! Measurements at random poses that can be taken with the instruments where they are.

use super::kind::{Kind, Wishes};
use super::planned::Planned;
use super::setup::Setup;
use crate::planning::poses::{PlanError, Selection};
use delta_cal::{Parameter, Robot, Sample};
use nalgebra::Vector3;
use rand_core::Rng;
use rand_pcg::Pcg32;

/// Draws without a usable measurement before there is said to be none.
const HOPELESS: usize = 20_000;
/// Draws a candidate at most, on average.
const DRAWS: usize = 400;
/// Poses that show how steep the workspace is.
const DRAWN: usize = 200;
/// Where an error along a forearm moves the platform by more than this factor, the robot is far from linear, and
/// a calibration from poses that are all so may lead nowhere.
const STEEP: f64 = 3.0;

/// Random measurements of some kinds that can be taken where the instruments are, in turn.
///
/// # Errors
/// Limits that leave no such measurement.
pub fn random_measurements(
    setup: &Setup,
    kinds: &Wishes,
    count: usize,
    rng: &mut Pcg32,
) -> Result<Vec<Planned>, PlanError> {
    let selection = Selection::new(&setup.robot, None);
    Draws::new(setup, &selection, rng)?.of_kinds(kinds, count, rng)
}

/// Where measurements are drawn from.
pub(super) struct Draws<'a> {
    setup: &'a Setup,
    pub(super) selection: &'a Selection<'a>,
    /// [`STEEP`], or what half of the workspace is where that is more.
    steep: f64,
}

impl<'a> Draws<'a> {
    pub(super) fn new(
        setup: &'a Setup,
        selection: &'a Selection<'a>,
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        let drawn = selection.draw_many(DRAWN, rng)?;
        let mut steepness: Vec<_> = drawn
            .iter()
            .map(|pose| steepness(&setup.robot.robot, pose))
            .collect();
        steepness.sort_by(f64::total_cmp);
        let half = steepness.get(DRAWN / 2).copied().unwrap_or(STEEP);
        Ok(Self {
            setup,
            selection,
            steep: STEEP.max(half),
        })
    }

    /// So many in all, of each kind as many or one more.
    pub(super) fn of_kinds(
        &self,
        kinds: &Wishes,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let each = count.div_ceil(kinds.0.len().max(1));
        let mut all = Vec::with_capacity(count);
        for wish in &kinds.0 {
            all.extend(self.of(wish.kind, None, each, rng)?);
        }
        Ok(all)
    }

    pub(super) fn instruments_of(&self, kind: Kind) -> usize {
        if kind == Kind::Point {
            self.setup.points.len()
        } else {
            1
        }
    }

    /// So many of one kind, with one instrument or with any.
    pub(super) fn of(
        &self,
        kind: Kind,
        instrument: Option<usize>,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let mut found = Vec::with_capacity(count);
        let mut draws = 0;
        while found.len() < count {
            let instrument = instrument.unwrap_or_else(|| below(self.instruments_of(kind), rng));
            if let Some(pose) = self.selection.draw(rng) {
                let other = self.selection.draw(rng);
                let block = below(self.setup.blocks.len(), rng);
                found.extend(self.placed(kind, pose, other, block, instrument));
            }
            draws += 1;
            if draws >= HOPELESS + DRAWS * found.len() {
                // Where a region or the limits leave nothing at all, that is said first.
                self.selection.draw_many(1, rng)?;
                return Err(PlanError::NoMeasurement(kind.title()));
            }
        }
        Ok(found)
    }

    /// The measurement nearest to poses: on a gauge block, or as far from its point or its other pose as can be
    /// measured.
    pub(super) fn placed(
        &self,
        kind: Kind,
        pose: Sample<f64>,
        other: Option<Sample<f64>>,
        block: usize,
        point: usize,
    ) -> Option<Planned> {
        let planned = Planned {
            kind,
            pose,
            other: None,
            block: None,
            point: None,
        };
        let placed = match kind {
            Kind::Xy | Kind::Z | Kind::Xyz => planned,
            Kind::Plane => {
                let height = *self.setup.blocks.get(block)?;
                let (x, y) = (pose.position.x, pose.position.y);
                let above = Vector3::new(x, y, self.setup.plane + height);
                Planned {
                    pose: self.selection.at(&above)?,
                    block: Some(block),
                    ..planned
                }
            }
            Kind::Distance => Planned {
                other: Some(self.as_far(&pose.position, &other?)?),
                ..planned
            },
            Kind::Point => {
                let (_, place) = self.setup.points.get(point)?;
                let pose = self.as_far(place, &pose)?;
                if self.setup.on_table && pose.position.z < place.z {
                    return None;
                }
                Planned {
                    pose,
                    point: Some(point),
                    ..planned
                }
            }
        };
        let robot = &self.setup.robot.robot;
        let mut poses = std::iter::once(&placed.pose).chain(&placed.other);
        let gentle = poses.all(|pose| steepness(robot, pose) <= self.steep);
        gentle.then_some(placed)
    }

    /// The pose on the line from a place to another pose whose distance can be measured.
    fn as_far(&self, from: &Vector3<f64>, pose: &Sample<f64>) -> Option<Sample<f64>> {
        let (shortest, longest) = self.setup.lengths;
        let apart = pose.position - from;
        let distance = apart.norm();
        let wanted = distance.clamp(shortest, longest);
        if (wanted - distance).abs() < f64::EPSILON {
            return Some(*pose);
        }
        (distance > 0.0).then_some(())?;
        self.selection.at(&(from + apart * (wanted / distance)))
    }
}

/// By what factor an error along a forearm moves the platform at most.
fn steepness(robot: &Robot<f64>, pose: &Sample<f64>) -> f64 {
    let jacobian = robot.platform_jacobian(&pose.position, &pose.joints);
    jacobian.map_or(f64::INFINITY, |jacobian| {
        let columns = jacobian.by_parameters.iter();
        let lengths = columns.map(|arm| arm.column(Parameter::Lb.index()).norm());
        lengths.fold(0.0, f64::max)
    })
}

/// A number below another.
fn below(number: usize, rng: &mut Pcg32) -> usize {
    usize::try_from(rng.next_u64() % number.max(1) as u64).unwrap_or(0)
}
