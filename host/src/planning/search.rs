//! Searches for the best set of measurements: exchange among candidates from the whole workspace, then among candidates
//! ever closer to the chosen ones; from several random sets, of which the best result is kept.
//!
//! Candidates are allowed poses, read by the instruments where they stand.

use super::PlanError;
use super::exchange::{Pool, Rows, Set};
use super::judge::Information;
use super::request::{Kind, Wishes};
use super::selection::{Selection, drawn};
use super::setup::{Planned, Setup};
use crate::cores;
use crate::files::{Reading, ReadingFrom};
use crate::fit::solution::RobotCovariance;
use crate::geometry::below;
use crate::halt::Steps;
use crate::order;
use delta_cal::{Parameter, Sample};
use nalgebra::{DMatrix, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Candidates from the whole workspace.
const CANDIDATES: usize = 1500;
/// Candidates near the chosen ones.
const NEAR: usize = 500;
/// The distance of these from the chosen ones, one σ in degrees, round by round.
const SPREADS: [f64; 4] = [8.0, 3.0, 1.0, 0.3];
/// Draws allowed per candidate, on average.
const DRAWS: usize = 400;
/// Poses sampled to find out how steep the workspace is.
const DRAWN: usize = 200;
/// Where an error along a forearm moves the platform by more than this factor, the robot is far from linear. A
/// calibration from such poses alone may not converge.
const STEEP: f64 = 3.0;
/// Measurements per kind and instrument that locate the instruments, whatever else is measured.
const ANCHORS: usize = 40;

/// Everything a search needs.
pub(super) struct Search<'a> {
    setup: &'a Setup,
    kinds: &'a Wishes,
    selection: &'a Selection<'a>,
    /// [`STEEP`], or the median over the workspace if that is larger.
    steep: f64,
    /// Rows that locate the instruments: those given, and some of each kind with each instrument.
    pub(super) anchors: Vec<Reading>,
    /// The information of the rows that are given.
    prior: DMatrix<f64>,
    /// W in the criterion tr W C for the robot's parameters, mm and radians.
    weights: &'a RobotCovariance,
}

impl<'a> Search<'a> {
    /// For measurements beside these rows.
    pub(super) fn new(
        setup: &'a Setup,
        kinds: &'a Wishes,
        selection: &'a Selection<'_>,
        rows: &[Reading],
        weights: &'a RobotCovariance,
        rng: &mut Pcg32,
    ) -> Result<Self, PlanError> {
        let mut search = Self {
            setup,
            kinds,
            selection,
            steep: STEEP,
            anchors: rows.to_vec(),
            prior: DMatrix::zeros(0, 0),
            weights,
        };
        let drawn = selection.draw_many(DRAWN, rng)?;
        let mut steepness: Vec<_> = drawn.iter().map(|pose| search.steepness(pose)).collect();
        order::sort(&mut steepness);
        search.steep = STEEP.max(steepness[DRAWN / 2]);
        for wish in &kinds.0 {
            for instrument in 0..search.instruments_of(wish.kind) {
                let own = search.of(wish.kind, Some(instrument), ANCHORS, rng)?;
                search.anchors.extend(own.iter().map(|own| own.reading));
            }
        }
        search.prior = search.information(rows)?.matrix();
        Ok(search)
    }

    /// The information of rows about the nominal robot.
    pub(super) fn information(&self, rows: &[Reading]) -> Result<Information, PlanError> {
        Information::of(&self.setup.robot.robot, self.setup, rows, &self.anchors)
    }

    /// The best set of `count` measurements found.
    pub(super) fn best(
        &self,
        count: usize,
        rng: &mut Pcg32,
        steps: &Steps,
    ) -> Result<Vec<Planned>, PlanError> {
        match self.readings() {
            1 => self.best_of::<1>(count, rng, steps),
            _ => self.best_of::<3>(count, rng, steps),
        }
    }

    /// The measurements best added, one at a time.
    pub(super) fn added(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        match self.readings() {
            1 => self.added_of::<1>(count, rng),
            _ => self.added_of::<3>(count, rng),
        }
    }

    fn readings(&self) -> usize {
        let each = self.kinds.0.iter().map(|wish| wish.kind.readings());
        each.max().unwrap_or(1)
    }

    fn best_of<const R: usize>(
        &self,
        count: usize,
        rng: &mut Pcg32,
        steps: &Steps,
    ) -> Result<Vec<Planned>, PlanError> {
        let drawn = self.of_all(CANDIDATES.max(2 * count), rng)?;
        let pool = self.pool::<R>(&drawn)?;
        // Larger sets differ less, and need fewer starts.
        let starts = (240 / count.max(1)).clamp(4, 12);
        let starts: Vec<_> = (0..starts)
            .map(|_| {
                let chosen = random_subset(&pool, count, rng);
                (chosen, Pcg32::seed_from_u64(rng.next_u64()))
            })
            .collect();
        steps.expect(starts.len() * (1 + SPREADS.len()));
        let found = cores::map(starts, |(chosen, mut rng)| {
            let set = pool.exchange(pool.set(chosen)?);
            steps.step();
            self.nearer::<R>(members(&drawn, &set), &mut rng, steps)
        });
        let best = found
            .into_iter()
            .flatten()
            .min_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(chosen, _)| chosen).ok_or(PlanError::Singular)
    }

    /// Exchanges the members of a set for others nearby; returns the set and its criterion.
    fn nearer<const R: usize>(
        &self,
        mut chosen: Vec<Planned>,
        rng: &mut Pcg32,
        steps: &Steps,
    ) -> Option<(Vec<Planned>, f64)> {
        let count = chosen.len();
        let each = NEAR.div_ceil(count.max(1)).max(2);
        let mut value = f64::INFINITY;
        for spread in SPREADS {
            let mut near = chosen.clone();
            for member in &chosen {
                let spread = spread.to_radians();
                near.extend((0..each).filter_map(|_| self.near(member, spread, rng)));
            }
            let pool = self.pool::<R>(&near).ok()?;
            let set = pool.exchange(pool.set((0..count).collect())?);
            value = set.value;
            chosen = members(&near, &set);
            steps.step();
        }
        Some((chosen, value))
    }

    fn added_of<const R: usize>(
        &self,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let drawn = self.of_all(CANDIDATES, rng)?;
        let pool = self.pool::<R>(&drawn)?;
        let added = pool.set(Vec::new()).and_then(|own| pool.add(own, count));
        Ok(members(&drawn, &added.ok_or(PlanError::Singular)?))
    }

    fn pool<const R: usize>(&self, all: &[Planned]) -> Result<Pool<R>, PlanError> {
        let given: Vec<_> = all.iter().map(|own| own.reading).collect();
        let found = self.information(&given)?;
        let rows = given.iter().zip(&found.rows).map(|(own, sensitivity)| {
            let mut rows = Rows::zeros(sensitivity.nrows());
            let read = own.read().into_iter().zip(sensitivity.column_iter());
            let read = read.filter(|(reading, _)| reading.is_some());
            for (mut row, (_, sensitivity)) in rows.row_iter_mut().zip(read) {
                row.tr_copy_from(&sensitivity);
            }
            rows
        });
        let wishes = &self.kinds.0;
        let kind = |own: &Planned| wishes.iter().position(|wish| wish.kind == own.kind);
        let most = wishes.iter().map(|own| own.most.unwrap_or(usize::MAX));
        Ok(Pool {
            rows: rows.collect(),
            kinds: all.iter().map(|own| kind(own).unwrap_or(0)).collect(),
            most: most.collect(),
            prior: self.prior.clone(),
            weights: found.weights(self.weights),
        })
    }

    /// `count` candidates in all, divided evenly among the kinds.
    fn of_all(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        let each = count.div_ceil(self.kinds.0.len().max(1));
        let mut all = Vec::with_capacity(count);
        for wish in &self.kinds.0 {
            all.extend(self.of(wish.kind, None, each, rng)?);
        }
        Ok(all)
    }

    fn instruments_of(&self, kind: Kind) -> usize {
        match kind {
            Kind::Plane => self.setup.planes.len(),
            Kind::Point => self.setup.points.len(),
            Kind::Distance => 1,
            Kind::Position(_) => self.setup.targets.len().max(1),
        }
    }

    /// `count` of one kind, with one instrument or with any.
    fn of(
        &self,
        kind: Kind,
        instrument: Option<usize>,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let found = drawn(count, DRAWS, || {
            let instrument = instrument.unwrap_or_else(|| below(self.instruments_of(kind), rng));
            let pose = self.selection.draw(rng)?;
            let other = self.selection.draw(rng);
            let plane = self.setup.planes.get(instrument);
            let blocks = plane.map_or(&[][..], |plane| &plane.blocks);
            let block = blocks.get(below(blocks.len(), rng)).copied();
            self.placed(kind, pose, other, instrument, block)
        });
        if found.is_none() {
            // If the region or the limits leave no pose at all, report that instead.
            self.selection.draw_many(1, rng)?;
        }
        found.ok_or(PlanError::NoMeasurement(kind))
    }

    /// A measurement near another; `spread` is one σ of the joint angles, radians. `None` if it is not allowed.
    fn near(&self, own: &Planned, spread: f64, rng: &mut Pcg32) -> Option<Planned> {
        let pose = self.selection.near(&own.reading.joints, spread, rng)?;
        let (other, instrument) = match (own.reading.distance, own.reading.height) {
            (Some((ReadingFrom::Pose(other), _)), _) => {
                (Some(self.selection.near(&other, spread, rng)?), 0)
            }
            (Some((ReadingFrom::Point(point), _)), _) => (None, point),
            (None, plane) => (None, plane.map_or(own.reading.target, |(plane, _)| plane)),
        };
        self.placed(own.kind, pose, other, instrument, own.block_mm)
    }

    /// Moves poses to where they can be measured: onto a gauge block, or to a measurable distance from a point or from
    /// the other pose.
    fn placed(
        &self,
        kind: Kind,
        mut pose: Sample<f64>,
        mut other: Option<Sample<f64>>,
        instrument: usize,
        block: Option<f64>,
    ) -> Option<Planned> {
        let setup = self.setup;
        let (mut plane, mut point) = (None, None);
        match kind {
            Kind::Position(_) => other = None,
            Kind::Plane => {
                let at = setup.places.planes.get(instrument)?;
                let mut above = pose.position;
                above.z += (at.offset + block? - at.normal.dot(&above)) / at.normal.z;
                pose = self.selection.at(&above)?;
                other = None;
                plane = setup.planes.get(instrument);
            }
            Kind::Distance => {
                other = Some(self.as_far(&pose.position, &other?, setup.lengths)?);
            }
            Kind::Point => {
                let place = setup.places.points.get(instrument)?.place;
                point = setup.points.get(instrument);
                pose = self.as_far(&place, &pose, point?.lengths)?;
                other = None;
                // Points of unknown place stand on a table, below the platform.
                let on_table = setup.points.iter().all(|own| own.known.known.is_none());
                if on_table && pose.position.z < place.z {
                    return None;
                }
            }
        }
        let clear = |pose: &Sample<f64>| setup.is_above_planes(&pose.position);
        if kind != Kind::Plane && !std::iter::once(&pose).chain(&other).all(clear) {
            return None;
        }
        // From complete positions a calibration converges anywhere.
        let mut poses = std::iter::once(&pose).chain(&other);
        if kind != Kind::XYZ && !poses.all(|pose| self.steepness(pose) <= self.steep) {
            return None;
        }
        let from = other.map(|other| ReadingFrom::Pose(other.joints));
        let from = from.or(point.map(|_| ReadingFrom::Point(instrument)));
        let planned = setup.planned(kind, instrument, &pose);
        let asked = Reading {
            height: plane.map(|_| (instrument, 0.0)),
            distance: from.map(|from| (from, 1.0)),
            ..planned.reading
        };
        let convention = &setup.robot.convention;
        Some(Planned {
            to_joints: other.map(|other| convention.joints(&other.joints)),
            plane: plane.map(|plane| plane.name.clone()),
            block_mm: block.filter(|_| plane.is_some()),
            point: point.map(|point| point.name.clone()),
            reading: setup.read(&setup.robot.robot, &asked),
            ..planned
        })
    }

    /// The pose on the line through a place and another pose whose distance from the place can be measured.
    fn as_far(
        &self,
        from: &Vector3<f64>,
        pose: &Sample<f64>,
        (shortest, longest): (f64, f64),
    ) -> Option<Sample<f64>> {
        let apart = pose.position - from;
        let distance = apart.norm();
        let wanted = distance.clamp(shortest, longest);
        if (wanted - distance).abs() < f64::EPSILON {
            return Some(*pose);
        }
        (distance > 0.0).then_some(())?;
        self.selection.at(&(from + apart * (wanted / distance)))
    }

    /// The largest factor by which an error along a forearm moves the platform.
    fn steepness(&self, pose: &Sample<f64>) -> f64 {
        let robot = &self.setup.robot.robot;
        let jacobian = robot.platform_jacobian(&pose.position, &pose.joints);
        jacobian.map_or(f64::INFINITY, |jacobian| {
            let columns = jacobian.by_parameters.iter();
            let lengths = columns.map(|arm| arm.column(Parameter::Lb.index()).norm());
            lengths.fold(0.0, f64::max)
        })
    }
}

fn members(all: &[Planned], set: &Set) -> Vec<Planned> {
    set.chosen.iter().map(|index| all[*index].clone()).collect()
}

/// Different candidates drawn at random, no more of a kind than allowed.
fn random_subset<const R: usize>(pool: &Pool<R>, count: usize, rng: &mut Pcg32) -> Vec<usize> {
    let mut all: Vec<_> = (0..pool.kinds.len()).collect();
    let mut left = pool.most.clone();
    let mut chosen = Vec::with_capacity(count);
    while chosen.len() < count && !all.is_empty() {
        let candidate = all.swap_remove(below(all.len(), rng));
        let left = &mut left[pool.kinds[candidate]];
        if *left > 0 {
            *left -= 1;
            chosen.push(candidate);
        }
    }
    chosen
}
