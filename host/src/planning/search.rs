//! Searches for the best set of measurements: exchange among candidates from the whole workspace, then among candidates
//! ever closer to the chosen ones; from several random sets, of which the best result is kept.

use super::PlanError;
use super::candidates::Candidates;
use super::exchange::{Pool, Set};
use super::judge::Information;
use super::request::{Wishes, below};
use super::selection::Selection;
use super::setup::{Planned, Setup};
use crate::files::samples_file::Reading;
use crate::fit::solution::RobotCovariance;
use nalgebra::{DMatrix, SVector};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Candidates from the whole workspace.
const CANDIDATES: usize = 1500;
/// Candidates near the chosen ones.
const NEAR: usize = 500;
/// The distance of these from the chosen ones, one σ in degrees, round by round.
const SPREADS: [f64; 4] = [8.0, 3.0, 1.0, 0.3];

/// Everything a search needs.
pub(super) struct Search<'a> {
    setup: &'a Setup,
    kinds: &'a Wishes,
    candidates: Candidates<'a>,
    /// Rows that locate the instruments.
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
        let candidates = Candidates::new(setup, selection, rng)?;
        let mut anchors = rows.to_vec();
        anchors.extend(candidates.anchors(kinds, rng)?);
        let prior = Information::of(&setup.robot, setup, rows, &anchors)?.matrix();
        Ok(Self {
            setup,
            kinds,
            candidates,
            anchors,
            prior,
            weights,
        })
    }

    /// The best set of `count` measurements found.
    pub(super) fn best(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        if self.readings() == 1 {
            self.best_of::<1>(count, rng)
        } else {
            self.best_of::<3>(count, rng)
        }
    }

    /// The measurements best added, one at a time.
    pub(super) fn added(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        if self.readings() == 1 {
            self.added_of::<1>(count, rng)
        } else {
            self.added_of::<3>(count, rng)
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
    ) -> Result<Vec<Planned>, PlanError> {
        let number = CANDIDATES.max(2 * count);
        let drawn = self.candidates.of_kinds(self.kinds, number, rng)?;
        let pool = self.pool::<R>(&drawn)?;
        // Larger sets differ less, and need fewer starts.
        let starts = (240 / count.max(1)).clamp(4, 12);
        let starts: Vec<_> = (0..starts)
            .map(|_| {
                let chosen = random_subset(&pool, count, rng);
                (chosen, Pcg32::seed_from_u64(rng.next_u64()))
            })
            .collect();
        let found: Vec<_> = starts
            .into_par_iter()
            .filter_map(|(chosen, mut rng)| {
                let set = pool.exchange(pool.set(chosen)?);
                self.nearer::<R>(members(&drawn, &set), &mut rng)
            })
            .collect();
        let best = found.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(chosen, _)| chosen).ok_or(PlanError::Singular)
    }

    /// Exchanges the members of a set for others nearby; returns the set and its criterion.
    fn nearer<const R: usize>(
        &self,
        mut chosen: Vec<Planned>,
        rng: &mut Pcg32,
    ) -> Option<(Vec<Planned>, f64)> {
        let count = chosen.len();
        let each = NEAR.div_ceil(count.max(1)).max(2);
        let mut value = f64::INFINITY;
        for spread in SPREADS {
            let mut near = chosen.clone();
            for member in &chosen {
                let spread = spread.to_radians();
                near.extend((0..each).filter_map(|_| self.candidates.near(member, spread, rng)));
            }
            let pool = self.pool::<R>(&near).ok()?;
            let set = pool.exchange(pool.set((0..count).collect())?);
            value = set.value;
            chosen = members(&near, &set);
        }
        Some((chosen, value))
    }

    fn added_of<const R: usize>(
        &self,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let drawn = self.candidates.of_kinds(self.kinds, CANDIDATES, rng)?;
        let pool = self.pool::<R>(&drawn)?;
        let start = pool.set(Vec::new()).ok_or(PlanError::Singular)?;
        Ok(members(&drawn, &pool.add(start, count)))
    }

    fn pool<const R: usize>(&self, all: &[Planned]) -> Result<Pool<R>, PlanError> {
        let setup = self.setup;
        let given: Vec<_> = all.iter().map(|own| setup.row(own)).collect();
        let found = Information::of(&setup.robot, setup, &given, &self.anchors)?;
        let rows = given.iter().zip(&found.rows).flat_map(|(own, row)| {
            let read = own.read().into_iter().enumerate();
            let mut places = read.filter_map(|(place, read)| read.is_some().then_some(place));
            let places = [(); R].map(|()| places.next());
            row.row_iter()
                .map(move |entries| places.map(|place| place.map_or(0.0, |place| entries[place])))
        });
        let rows = rows.map(SVector::from).collect();
        let kind = |own: &Planned| {
            let mut wishes = self.kinds.0.iter();
            wishes.position(|wish| wish.kind == own.kind).unwrap_or(0)
        };
        let most = self.kinds.0.iter();
        Ok(Pool {
            rows,
            kinds: all.iter().map(kind).collect(),
            most: most.map(|own| own.most.unwrap_or(usize::MAX)).collect(),
            prior: self.prior.clone(),
            weights: found.weights(self.weights),
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
