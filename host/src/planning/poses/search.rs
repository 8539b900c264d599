//! From candidates all over the workspace to a set, then the same among candidates ever nearer to it;
//! from several random sets, and the best of what they lead to.

use super::candidates::Selection;
use super::exchange::{Candidates, Set};
use super::rows::{Fkm, Ikm, Model, Rows};
use super::{Assumptions, PlanError, PlanRequest};
use crate::accuracy::information::tolerance_weights;
use crate::fit::options::CalibrationMethod;
use delta_cal::Sample;
use nalgebra::SVector;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Candidates from all over the workspace.
const CANDIDATES: usize = 1500;
/// Candidates near the chosen poses.
const NEAR: usize = 500;
/// Random sets that a search begins with: fewer of more poses, for they differ less.
fn starts(count: usize) -> usize {
    (480 / count.max(1)).clamp(2, 40)
}
/// How far candidates are from the chosen poses, one σ in degrees, one round after the other.
const SPREADS: [f64; 4] = [8.0, 3.0, 1.0, 0.3];

/// What is searched for.
pub(super) struct Search<'a> {
    pub(super) request: &'a PlanRequest<'a>,
    pub(super) assumptions: &'a Assumptions,
    pub(super) selection: &'a Selection<'a>,
}

impl Search<'_> {
    /// The poses, in the order in which they were found.
    ///
    /// The information of the FKM method is nearly that of three separate arms: its search begins
    /// with theirs, which is the faster.
    pub(super) fn run(&self, rng: &mut Pcg32) -> Result<Vec<Sample<f64>>, PlanError> {
        let found = self.all_over::<Ikm, 3, 8, 1>(rng)?;
        let better = match self.request.method {
            CalibrationMethod::Ikm => Some(found),
            CalibrationMethod::Fkm => self.nearer::<Fkm, 1, 24, 3>(found.poses, rng),
        };
        better.map(|found| found.poses).ok_or(PlanError::Singular)
    }

    /// The poses that are best added to those measured, one after the other.
    pub(super) fn added(
        &self,
        measured: &[Sample<f64>],
        rng: &mut Pcg32,
    ) -> Result<Vec<Sample<f64>>, PlanError> {
        match self.request.method {
            CalibrationMethod::Ikm => self.greedy::<Ikm, 3, 8, 1>(measured, rng),
            CalibrationMethod::Fkm => self.greedy::<Fkm, 1, 24, 3>(measured, rng),
        }
    }

    fn greedy<M: Model<B, D, R>, const B: usize, const D: usize, const R: usize>(
        &self,
        measured: &[Sample<f64>],
        rng: &mut Pcg32,
    ) -> Result<Vec<Sample<f64>>, PlanError> {
        let mut poses = measured.to_vec();
        poses.extend(self.selection.draw_many(CANDIDATES, rng)?);
        let pool = Pool::<B, D, R>::new::<M>(self, poses);
        let candidates = pool.candidates(self);
        let given = (0..measured.len()).collect();
        let start = candidates.set(given).ok_or(PlanError::Singular)?;
        let set = candidates.add(start, self.request.count);
        Ok(pool.poses_of(&set).split_off(measured.len()))
    }

    fn all_over<M: Model<B, D, R>, const B: usize, const D: usize, const R: usize>(
        &self,
        rng: &mut Pcg32,
    ) -> Result<Found, PlanError> {
        let count = self.request.count;
        let drawn = self.selection.draw_many(CANDIDATES.max(2 * count), rng)?;
        let pool = Pool::<B, D, R>::new::<M>(self, drawn);
        let candidates = pool.candidates(self);
        let starts: Vec<_> = (0..starts(count))
            .map(|_| {
                let chosen = random_subset(pool.poses.len(), count, rng);
                (chosen, Pcg32::seed_from_u64(rng.next_u64()))
            })
            .collect();
        let found: Vec<_> = starts
            .into_par_iter()
            .filter_map(|(chosen, mut rng)| {
                let set = candidates.exchange(candidates.set(chosen)?);
                self.nearer::<M, B, D, R>(pool.poses_of(&set), &mut rng)
            })
            .collect();
        found
            .into_iter()
            .min_by(|a, b| a.value.total_cmp(&b.value))
            .ok_or(PlanError::Singular)
    }

    /// Exchanges poses for others near them.
    fn nearer<M: Model<B, D, R>, const B: usize, const D: usize, const R: usize>(
        &self,
        mut poses: Vec<Sample<f64>>,
        rng: &mut Pcg32,
    ) -> Option<Found> {
        let count = poses.len();
        let each = NEAR.div_ceil(count.max(1)).max(2);
        let mut value = f64::INFINITY;
        for spread in SPREADS {
            let mut near = poses.clone();
            for pose in &poses {
                near.extend(
                    (0..each).filter_map(|_| self.selection.near(pose, spread.to_radians(), rng)),
                );
            }
            let pool = Pool::<B, D, R>::new::<M>(self, near);
            let candidates = pool.candidates(self);
            let set = candidates.exchange(candidates.set((0..count).collect())?);
            value = set.value;
            poses = pool.poses_of(&set);
        }
        Some(Found { poses, value })
    }
}

/// A set of poses, and the criterion: smaller is better.
struct Found {
    poses: Vec<Sample<f64>>,
    value: f64,
}

/// Candidates and their rows.
struct Pool<const B: usize, const D: usize, const R: usize> {
    poses: Vec<Sample<f64>>,
    rows: Vec<Rows<B, D, R>>,
    prior: [SVector<f64, D>; B],
}

impl<const B: usize, const D: usize, const R: usize> Pool<B, D, R> {
    fn new<M: Model<B, D, R>>(search: &Search<'_>, poses: Vec<Sample<f64>>) -> Self {
        let robot = &search.request.robot.robot;
        let (noise, tolerance) = (&search.assumptions.noise, &search.assumptions.tolerance);
        let (poses, rows) = poses
            .into_iter()
            .filter_map(|pose| Some((pose, M::rows(robot, &pose, noise)?)))
            .unzip();
        Self {
            poses,
            rows,
            prior: prior(robot, tolerance.as_ref()),
        }
    }

    fn candidates(&self, search: &Search<'_>) -> Candidates<'_, B, D, R> {
        Candidates {
            rows: &self.rows,
            prior: self.prior,
            criterion: search.request.criterion,
        }
    }

    fn poses_of(&self, set: &Set<B, D>) -> Vec<Sample<f64>> {
        set.chosen.iter().map(|index| self.poses[*index]).collect()
    }
}

/// Information before any measurement: the tolerance's, and that no parameter is off by more than a
/// forearm, so that there always is some.
pub(super) fn prior<const B: usize, const D: usize>(
    robot: &delta_cal::Robot<f64>,
    tolerance: Option<&delta_cal::Tolerance<f64>>,
) -> [SVector<f64, D>; B] {
    let [arm, ..] = robot.arms();
    let weights = tolerance_weights(robot, tolerance);
    std::array::from_fn(|block| {
        SVector::from_fn(|index, _| weights[D * block + index].powi(2) + arm.lb().powi(-2))
    })
}

/// Different numbers below `size`, any as likely as any other.
fn random_subset<R: Rng + ?Sized>(size: usize, count: usize, rng: &mut R) -> Vec<usize> {
    let mut all: Vec<_> = (0..size).collect();
    for place in 0..count.min(size) {
        let left = (size - place) as u64;
        let other = place + usize::try_from(rng.next_u64() % left).unwrap_or(0);
        all.swap(place, other);
    }
    all.truncate(count);
    all
}
