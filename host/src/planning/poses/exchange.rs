//! Fedorov's exchange: one pose of the set after the other is replaced by the candidate that betters
//! the set most, until none does.
//!
//! V. V. Fedorov, *Theory of Optimal Experiments*, 1972; one replacement at a time as R. D. Cook and
//! C. J. Nachtsheim, "A comparison of algorithms for constructing exact D-optimal designs",
//! Technometrics 22(3), 1980.

use super::Criterion;
use super::rows::Rows;
use delta_cal::Real;
use nalgebra::{Cholesky, Const, SMatrix, SVector};

/// Passes over the set at most; it settles after some ten.
const PASSES: usize = 40;
/// An exchange must better the criterion by this part of it.
const WORTHWHILE: f64 = 1e-9;

/// The candidates and what is known before any is measured.
pub(super) struct Candidates<'a, const B: usize, const D: usize, const R: usize> {
    pub(super) rows: &'a [Rows<B, D, R>],
    /// Information before, on the diagonal.
    pub(super) prior: [SVector<f64, D>; B],
    pub(super) criterion: Criterion,
}

/// What adding a candidate to the set would do, block by block.
struct Addition<const D: usize, const R: usize> {
    /// C V.
    spread: SMatrix<f64, D, R>,
    /// (I + Vᵀ C V)⁻¹.
    inverse: SMatrix<f64, R, R>,
    /// ln det (I + Vᵀ C V).
    determinant: f64,
    /// By which tr C falls.
    trace: f64,
}

/// A set of candidates, by index, and the covariance it leaves.
#[derive(Debug, Clone)]
pub(super) struct Set<const B: usize, const D: usize> {
    pub(super) chosen: Vec<usize>,
    covariance: [SMatrix<f64, D, D>; B],
    /// The criterion: smaller is better. tr C in mm², or ln det C.
    pub(super) value: f64,
}

impl<const B: usize, const D: usize, const R: usize> Candidates<'_, B, D, R> {
    /// The set of these candidates; `None` if its information is singular.
    pub(super) fn set(&self, chosen: Vec<usize>) -> Option<Set<B, D>> {
        let mut covariance = [SMatrix::zeros(); B];
        let mut value = 0.0;
        for (block, covariance) in covariance.iter_mut().enumerate() {
            let mut information = SMatrix::<f64, D, D>::from_diagonal(&self.prior[block]);
            for candidate in &chosen {
                let rows = &self.rows[*candidate].blocks[block];
                information += rows * rows.transpose();
            }
            let factor = Cholesky::new(information)?;
            *covariance = factor.inverse();
            value += match self.criterion {
                Criterion::A => covariance.trace(),
                Criterion::D => -logarithm(&factor),
            };
        }
        value.is_finite().then_some(Set {
            chosen,
            covariance,
            value,
        })
    }

    /// Exchanges until nothing is gained.
    pub(super) fn exchange(&self, mut set: Set<B, D>) -> Set<B, D> {
        let mut taken = vec![false; self.rows.len()];
        for candidate in &set.chosen {
            taken[*candidate] = true;
        }
        let mut additions = self.additions(&set);
        for _ in 0..PASSES {
            let mut bettered = false;
            for place in 0..set.chosen.len() {
                let Some((candidate, value)) = self.best(&set, &additions, place, &taken) else {
                    continue;
                };
                let threshold = match self.criterion {
                    Criterion::A => set.value * (1.0 - WORTHWHILE),
                    Criterion::D => set.value - WORTHWHILE,
                };
                if !(value < threshold) {
                    continue;
                }
                let mut chosen = set.chosen.clone();
                chosen[place] = candidate;
                // Anew from the rows: updates would gather rounding.
                let Some(exchanged) = self.set(chosen) else {
                    continue;
                };
                if !(exchanged.value < threshold) {
                    continue;
                }
                taken[set.chosen[place]] = false;
                taken[candidate] = true;
                set = exchanged;
                additions = self.additions(&set);
                bettered = true;
            }
            if !bettered {
                break;
            }
        }
        set
    }

    /// The candidates that better a set most if they are added to it one after the other.
    pub(super) fn add(&self, mut set: Set<B, D>, count: usize) -> Set<B, D> {
        let mut taken = vec![false; self.rows.len()];
        for candidate in &set.chosen {
            taken[*candidate] = true;
        }
        for _ in 0..count {
            let additions = self.additions(&set);
            let gain = |candidate: usize| -> f64 {
                additions[candidate]
                    .iter()
                    .map(|addition| match self.criterion {
                        Criterion::A => addition.trace,
                        Criterion::D => addition.determinant,
                    })
                    .sum()
            };
            let free = (0..self.rows.len()).filter(|candidate| !taken[*candidate]);
            let Some(best) = free.max_by(|a, b| gain(*a).total_cmp(&gain(*b))) else {
                break;
            };
            let mut chosen = set.chosen.clone();
            chosen.push(best);
            let Some(larger) = self.set(chosen) else {
                break;
            };
            taken[best] = true;
            set = larger;
        }
        set
    }

    fn additions(&self, set: &Set<B, D>) -> Vec<[Addition<D, R>; B]> {
        self.rows
            .iter()
            .map(|rows| {
                std::array::from_fn(|block| {
                    Addition::new(&set.covariance[block], &rows.blocks[block])
                })
            })
            .collect()
    }

    /// The candidate that replaces the one at a place of the set best, and the criterion then.
    fn best(
        &self,
        set: &Set<B, D>,
        additions: &[[Addition<D, R>; B]],
        place: usize,
        taken: &[bool],
    ) -> Option<(usize, f64)> {
        let removed = &self.rows[set.chosen[place]].blocks;
        let own: [_; B] = std::array::from_fn(|block| set.covariance[block] * removed[block]);
        let within: [_; B] = std::array::from_fn(|block| removed[block].transpose() * own[block]);
        let mut best = None;
        for (candidate, additions) in additions.iter().enumerate() {
            if taken[candidate] {
                continue;
            }
            let mut value = set.value;
            for block in 0..B {
                let change = additions[block].less(
                    &self.rows[candidate].blocks[block],
                    &own[block],
                    &within[block],
                    self.criterion,
                );
                value += change.unwrap_or(f64::INFINITY);
            }
            if best.is_none_or(|(_, least)| value < least) {
                best = Some((candidate, value));
            }
        }
        best
    }
}

impl<const D: usize, const R: usize> Addition<D, R> {
    fn new(covariance: &SMatrix<f64, D, D>, rows: &SMatrix<f64, D, R>) -> Self {
        let spread = covariance * rows;
        let grown = SMatrix::<f64, R, R>::identity() + rows.transpose() * spread;
        let (inverse, determinant) = Cholesky::new(grown).map_or_else(
            || (SMatrix::zeros(), f64::NEG_INFINITY),
            |factor| (factor.inverse(), logarithm(&factor)),
        );
        Self {
            spread,
            inverse,
            determinant,
            trace: (inverse * (spread.transpose() * spread)).trace(),
        }
    }

    /// By how much the criterion changes if the candidate (`rows`) is added and rows `U` are then
    /// removed, of which `own` is C U and `within` Uᵀ C U. Adding first leaves nothing singular in
    /// between. `None` if what is left is.
    fn less(
        &self,
        rows: &SMatrix<f64, D, R>,
        own: &SMatrix<f64, D, R>,
        within: &SMatrix<f64, R, R>,
        criterion: Criterion,
    ) -> Option<f64> {
        let coupling = rows.transpose() * own;
        let carried = self.inverse * coupling;
        let left = SMatrix::<f64, R, R>::identity() - within + coupling.transpose() * carried;
        let factor = Cholesky::new(left)?;
        match criterion {
            Criterion::D => Some(-self.determinant - logarithm(&factor)),
            Criterion::A => {
                let moved = own - self.spread * carried;
                let lost = factor.solve(&(moved.transpose() * moved)).trace();
                Some(lost - self.trace)
            }
        }
    }
}

/// ln det of the factored matrix, with the core's logarithm: the platform's has other bits on another
/// system, and the same seed gives the same poses on all.
fn logarithm<const N: usize>(factor: &Cholesky<f64, Const<N>>) -> f64 {
    let triangle = factor.l_dirty();
    2.0 * (0..N)
        .map(|index| triangle[(index, index)].natural_logarithm())
        .sum::<f64>()
}
