//! From candidates all over the workspace to the chosen set, then the same among candidates ever
//! nearer to it.

use super::candidates::Selection;
use super::exchange::{Candidates, Set};
use super::rows::{Fkm, Ikm, Model, Rows};
use super::{Assumptions, PlanError, PlanRequest};
use crate::CalibrationMethod;
use crate::information::tolerance_weights;
use delta_cal::Sample;
use nalgebra::SVector;
use rand_core::Rng;
use rand_pcg::Pcg32;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// Candidates from all over the workspace.
const CANDIDATES: usize = 1500;
/// Candidates near the chosen poses.
const NEAR: usize = 500;
/// Random sets that the exchange begins with.
const STARTS: usize = 8;
/// How far candidates are from the chosen poses, one σ in degrees, one round after the other.
const SPREADS: [f64; 3] = [8.0, 3.0, 1.0];

/// What is searched for.
pub(super) struct Search<'a> {
    pub(super) request: &'a PlanRequest<'a>,
    pub(super) assumptions: &'a Assumptions,
    pub(super) selection: &'a Selection<'a>,
}

impl Search<'_> {
    /// The poses, in the order in which they were found.
    pub(super) fn run(&self, rng: &mut Pcg32) -> Result<Vec<Sample<f64>>, PlanError> {
        match self.request.method {
            CalibrationMethod::Ikm => self.chosen::<Ikm, 3, 8, 1>(rng),
            CalibrationMethod::Fkm => self.chosen::<Fkm, 1, 24, 3>(rng),
        }
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

    fn chosen<M: Model<B, D, R>, const B: usize, const D: usize, const R: usize>(
        &self,
        rng: &mut Pcg32,
    ) -> Result<Vec<Sample<f64>>, PlanError> {
        let count = self.request.count;
        let drawn = self.selection.draw_many(CANDIDATES.max(4 * count), rng)?;
        let mut pool = Pool::<B, D, R>::new::<M>(self, drawn);
        let starts: Vec<_> = (0..STARTS)
            .map(|_| random_subset(pool.poses.len(), count, rng))
            .collect();
        let candidates = pool.candidates(self);
        let sets: Vec<_> = starts
            .into_par_iter()
            .filter_map(|start| Some(candidates.exchange(candidates.set(start)?)))
            .collect();
        let best = sets
            .into_iter()
            .min_by(|a, b| a.value.total_cmp(&b.value))
            .ok_or(PlanError::Singular)?;
        let mut chosen = pool.poses_of(&best);
        for spread in SPREADS {
            let each = NEAR.div_ceil(count).max(2);
            let mut near = chosen.clone();
            for pose in &chosen {
                near.extend(
                    (0..each).filter_map(|_| self.selection.near(pose, spread.to_radians(), rng)),
                );
            }
            pool = Pool::new::<M>(self, near);
            let candidates = pool.candidates(self);
            let start = candidates.set((0..count).collect());
            chosen = pool.poses_of(&candidates.exchange(start.ok_or(PlanError::Singular)?));
        }
        Ok(chosen)
    }
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
