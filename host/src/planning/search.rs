//! Searches for the best set of measurements: exchange among candidates from the whole workspace, then among candidates
//! ever closer to the chosen ones; from several random sets, of which the best result is kept.

use super::PlanError;
use super::candidates::Candidates;
use super::exchange::{Pool, Rows, Set};
use super::judge::Information;
use super::request::{Wishes, below};
use super::setup::{Planned, Setup};
use crate::fit::solution::RobotCovariance;
use delta_cal::observations::Observation;
use nalgebra::DMatrix;
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
    pub(super) setup: &'a Setup,
    pub(super) kinds: &'a Wishes,
    pub(super) candidates: &'a Candidates<'a>,
    /// Rows that locate the instruments.
    pub(super) anchors: &'a [Observation<f64>],
    /// The information so far, including what is already measured.
    pub(super) prior: DMatrix<f64>,
    /// W in the criterion tr W C for the robot's parameters, mm and radians.
    pub(super) weights: &'a RobotCovariance,
}

/// Candidates, their rows and the criterion's weights in the same units.
struct Members<const R: usize> {
    all: Vec<Planned>,
    rows: Vec<Rows<R>>,
    kinds: Vec<usize>,
    weights: DMatrix<f64>,
}

impl Search<'_> {
    /// The best set of `count` measurements found.
    pub(super) fn best(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        if self.readings() == 1 {
            self.all_over::<1>(count, rng)
        } else {
            self.all_over::<3>(count, rng)
        }
    }

    /// The measurements best added, one at a time.
    pub(super) fn added(&self, count: usize, rng: &mut Pcg32) -> Result<Vec<Planned>, PlanError> {
        if self.readings() == 1 {
            self.added_one_by_one::<1>(count, rng)
        } else {
            self.added_one_by_one::<3>(count, rng)
        }
    }

    fn readings(&self) -> usize {
        let each = self.kinds.0.iter().map(|wish| wish.kind.readings());
        each.max().unwrap_or(1)
    }

    fn most(&self) -> Vec<usize> {
        let each = self.kinds.0.iter();
        each.map(|wish| wish.most.unwrap_or(usize::MAX)).collect()
    }

    fn all_over<const R: usize>(
        &self,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let number = CANDIDATES.max(2 * count);
        let drawn = self.candidates.of_kinds(self.kinds, number, rng)?;
        let members = self.members::<R>(drawn)?;
        let most = self.most();
        let pool = members.pool(&self.prior, &most);
        // Larger sets differ less, and need fewer starts.
        let starts = (240 / count.max(1)).clamp(4, 12);
        let starts: Vec<_> = (0..starts)
            .map(|_| {
                let chosen = random_subset(&members.kinds, count, &most, rng);
                (chosen, Pcg32::seed_from_u64(rng.next_u64()))
            })
            .collect();
        let found: Vec<_> = starts
            .into_par_iter()
            .filter_map(|(chosen, mut rng)| {
                let set = pool.exchange(pool.set(chosen)?);
                self.nearer::<R>(members.chosen(&set), &mut rng)
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
        let most = self.most();
        let mut value = f64::INFINITY;
        for spread in SPREADS {
            let mut near = chosen.clone();
            for member in &chosen {
                let spread = spread.to_radians();
                near.extend((0..each).filter_map(|_| self.candidates.near(member, spread, rng)));
            }
            let members = self.members::<R>(near).ok()?;
            let pool = members.pool(&self.prior, &most);
            let set = pool.exchange(pool.set((0..count).collect())?);
            value = set.value;
            chosen = members.chosen(&set);
        }
        Some((chosen, value))
    }

    fn added_one_by_one<const R: usize>(
        &self,
        count: usize,
        rng: &mut Pcg32,
    ) -> Result<Vec<Planned>, PlanError> {
        let drawn = self.candidates.of_kinds(self.kinds, CANDIDATES, rng)?;
        let members = self.members::<R>(drawn)?;
        let most = self.most();
        let pool = members.pool(&self.prior, &most);
        let start = pool.set(Vec::new()).ok_or(PlanError::Singular)?;
        Ok(members.chosen(&pool.add(start, count)))
    }

    fn members<const R: usize>(&self, all: Vec<Planned>) -> Result<Members<R>, PlanError> {
        let setup = self.setup;
        let rows: Vec<_> = all.iter().map(|own| setup.row(own)).collect();
        let found = Information::of(&setup.robot, setup, &rows, self.anchors)?;
        let unknowns = found.units.len();
        let kind = |own: &Planned| {
            let mut wishes = self.kinds.0.iter();
            wishes.position(|wish| wish.kind == own.kind).unwrap_or(0)
        };
        let of_row = |(own, row): (&Observation<f64>, &DMatrix<f64>)| {
            let read = own.position.map(|own| own.is_some());
            let read = read
                .into_iter()
                .chain([own.height.is_some(), own.distance.is_some()]);
            let places = read
                .enumerate()
                .filter_map(|(place, read)| read.then_some(place));
            let mut columns = Rows::<R>::zeros(unknowns);
            for (column, place) in places.enumerate().take(R) {
                columns.set_column(column, &row.column(place));
            }
            columns
        };
        Ok(Members {
            rows: rows.iter().zip(&found.rows).map(of_row).collect(),
            kinds: all.iter().map(kind).collect(),
            weights: found.weights(self.weights),
            all,
        })
    }
}

impl<const R: usize> Members<R> {
    fn pool<'a>(&'a self, prior: &'a DMatrix<f64>, most: &'a [usize]) -> Pool<'a, R> {
        Pool::new(&self.rows, &self.kinds, most, (prior, &self.weights))
    }

    fn chosen(&self, set: &Set) -> Vec<Planned> {
        let members = set.chosen.iter().map(|index| self.all[*index].clone());
        members.collect()
    }
}

/// Different candidates drawn at random, no more of a kind than allowed.
fn random_subset(kinds: &[usize], count: usize, most: &[usize], rng: &mut Pcg32) -> Vec<usize> {
    let mut all: Vec<_> = (0..kinds.len()).collect();
    let mut left = most.to_vec();
    let mut chosen = Vec::with_capacity(count);
    while chosen.len() < count && !all.is_empty() {
        let candidate = all.swap_remove(below(all.len(), rng));
        let left = &mut left[kinds[candidate]];
        if *left > 0 {
            *left -= 1;
            chosen.push(candidate);
        }
    }
    chosen
}
