//! Fedorov's exchange: one candidate of the set after the other is replaced by that which betters the
//! set most, until none does.
//!
//! V. V. Fedorov, *Theory of Optimal Experiments*, 1972; one replacement at a time as R. D. Cook and
//! C. J. Nachtsheim, "A comparison of algorithms for constructing exact D-optimal designs",
//! Technometrics 22(3), 1980.

use super::lanes::{LANES, Lanes};
use super::source::{Criterion, Rows, Source};
use delta_cal::Real;
use nalgebra::{Cholesky, Const, SMatrix};

/// Passes over the set at most; it settles after some ten.
const PASSES: usize = 40;
/// An exchange must better the criterion by this part of it.
const WORTHWHILE: f64 = 1e-9;

/// The candidates, what is known before any is measured, and what a set is judged by.
pub(in crate::planning) struct Candidates<'a, const B: usize, const D: usize, const R: usize> {
    rows: &'a [Rows<B, D, R>],
    /// The same rows side by side.
    lanes: Vec<Lanes<B, D, R>>,
    /// Information before.
    prior: Vec<SMatrix<f64, D, D>>,
    criterion: Criterion,
    /// W of tr W C, by which the criterion A judges a set.
    weights: Vec<SMatrix<f64, D, D>>,
    /// How many of each kind a set may hold.
    most: &'a [usize],
}

/// A set of candidates, by index, and the covariance it leaves.
#[derive(Debug, Clone)]
pub(in crate::planning) struct Set<const B: usize, const D: usize> {
    pub(in crate::planning) chosen: Vec<usize>,
    covariance: [SMatrix<f64, D, D>; B],
    /// C W C.
    weighted: [SMatrix<f64, D, D>; B],
    /// The criterion: smaller is better. tr W C, or ln det C.
    pub(in crate::planning) value: f64,
}

/// What adding a candidate, rows V, to the set would do to a block.
#[derive(Debug, Clone, Copy)]
struct Addition<const R: usize> {
    /// Vᵀ C V.
    within: SMatrix<f64, R, R>,
    /// Vᵀ C W C V.
    weighted: SMatrix<f64, R, R>,
    /// (I + Vᵀ C V)⁻¹.
    inverse: SMatrix<f64, R, R>,
    /// By which the criterion falls: tr W C, or ln det C.
    gain: f64,
}

/// A candidate of the set, rows U, that may be removed.
struct Removal<const D: usize, const R: usize> {
    /// C U.
    spread: SMatrix<f64, D, R>,
    /// C W C U.
    weighted_spread: SMatrix<f64, D, R>,
    /// Uᵀ C U.
    within: SMatrix<f64, R, R>,
    /// Uᵀ C W C U.
    weighted: SMatrix<f64, R, R>,
}

impl<'a, const B: usize, const D: usize, const R: usize> Candidates<'a, B, D, R> {
    pub(in crate::planning) fn new<S: Source<B, D, R>>(
        rows: &'a [Rows<B, D, R>],
        source: &'a S,
    ) -> Self {
        Self {
            rows,
            lanes: Lanes::of(rows),
            prior: source.prior(),
            criterion: source.criterion(),
            weights: source.weights(),
            most: source.most(),
        }
    }

    /// The set of these candidates; `None` if its information is singular.
    pub(in crate::planning) fn set(&self, chosen: Vec<usize>) -> Option<Set<B, D>> {
        let mut covariance = [SMatrix::zeros(); B];
        let mut weighted = covariance;
        let mut value = 0.0;
        for block in 0..B {
            let mut information = self.prior[block];
            for candidate in &chosen {
                let rows = &self.rows[*candidate].blocks[block];
                information += rows * rows.transpose();
            }
            let factor = Cholesky::new(information)?;
            let inverse = factor.inverse();
            let weights = &self.weights[block];
            value += match self.criterion {
                Criterion::A => inverse.dot(weights),
                Criterion::D => -logarithm(&factor),
            };
            weighted[block] = inverse * weights * inverse;
            covariance[block] = inverse;
        }
        value.is_finite().then_some(Set {
            chosen,
            covariance,
            weighted,
            value,
        })
    }

    /// Exchanges until nothing is gained.
    pub(in crate::planning) fn exchange(&self, mut set: Set<B, D>) -> Set<B, D> {
        let mut taken = self.taken(&set);
        for _ in 0..PASSES {
            // Anew in every pass: updates gather rounding.
            let mut additions = self.additions(&set);
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
                // From the rows, for the same reason.
                let Some(exchanged) = self.set(chosen) else {
                    continue;
                };
                if !(exchanged.value < threshold) {
                    continue;
                }
                let removed = set.chosen[place];
                taken[removed] = false;
                taken[candidate] = true;
                if self
                    .update(&mut additions, &set, candidate, removed)
                    .is_none()
                {
                    additions = self.additions(&exchanged);
                }
                set = exchanged;
                bettered = true;
            }
            if !bettered {
                break;
            }
        }
        set
    }

    /// The candidates that better a set most if they are added to it one after the other.
    pub(in crate::planning) fn add(&self, mut set: Set<B, D>, count: usize) -> Set<B, D> {
        let mut taken = self.taken(&set);
        for _ in 0..count {
            let additions = self.additions(&set);
            let gain = |candidate: usize| -> f64 {
                additions[candidate]
                    .iter()
                    .map(|addition| addition.gain)
                    .sum()
            };
            let counts = self.counts(&set);
            let allowed = |candidate: &usize| {
                let kind = self.rows[*candidate].kind;
                !taken[*candidate] && counts[kind] < self.most[kind]
            };
            let free = (0..self.rows.len()).filter(allowed);
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

    fn taken(&self, set: &Set<B, D>) -> Vec<bool> {
        let mut taken = vec![false; self.rows.len()];
        for candidate in &set.chosen {
            taken[*candidate] = true;
        }
        taken
    }

    /// How many of each kind a set holds.
    fn counts(&self, set: &Set<B, D>) -> Vec<usize> {
        let mut counts = vec![0; self.most.len()];
        for candidate in &set.chosen {
            counts[self.rows[*candidate].kind] += 1;
        }
        counts
    }

    fn additions(&self, set: &Set<B, D>) -> Vec<[Addition<R>; B]> {
        let mut additions = Vec::with_capacity(LANES * self.lanes.len());
        for lanes in &self.lanes {
            let blocks: [_; B] = std::array::from_fn(|block| {
                let within = lanes.between(block, &set.covariance[block]);
                let weighted = lanes.between(block, &set.weighted[block]);
                [within, weighted]
            });
            additions.extend((0..LANES).map(|lane| {
                std::array::from_fn(|block| {
                    let [within, weighted] = blocks[block].map(|of| of[lane]);
                    Addition::new(within, weighted, self.criterion)
                })
            }));
        }
        additions.truncate(self.rows.len());
        additions
    }

    /// What the additions are after a candidate was added to a set and another removed. `None` if rounding leaves
    /// nothing of that.
    fn update(
        &self,
        additions: &mut [[Addition<R>; B]],
        set: &Set<B, D>,
        added: usize,
        removed: usize,
    ) -> Option<()> {
        for block in 0..B {
            let mut covariance = set.covariance[block];
            for (candidate, sign) in [(added, 1.0), (removed, -1.0)] {
                let rows = &self.rows[candidate].blocks[block];
                self.change(additions, block, &mut covariance, rows, sign)?;
            }
            for addition in &mut *additions {
                let Addition {
                    within, weighted, ..
                } = addition[block];
                addition[block] = Addition::new(within, weighted, self.criterion);
            }
        }
        Some(())
    }

    /// Adds the information of some rows U to a set (`sign` 1) or takes it away (−1), with
    /// S = C U and Z = (I ± Uᵀ S)⁻¹:
    ///
    /// ```text
    /// C' = C ∓ S Z Sᵀ
    /// C' W C' = C W C ∓ C W S Z Sᵀ ∓ S Z Sᵀ W C + S Z Sᵀ W S Z Sᵀ
    /// ```
    fn change(
        &self,
        additions: &mut [[Addition<R>; B]],
        block: usize,
        covariance: &mut SMatrix<f64, D, D>,
        rows: &SMatrix<f64, D, R>,
        sign: f64,
    ) -> Option<()> {
        let spread = *covariance * rows;
        let changed = SMatrix::identity() + rows.transpose() * spread * sign;
        let z = inverse(changed)? * sign;
        let weights_spread = self.weights[block] * spread;
        let weighted_spread = *covariance * weights_spread;
        let inner = z * spread.transpose() * weights_spread * z;
        for (lanes, additions) in self.lanes.iter().zip(additions.chunks_mut(LANES)) {
            let one = lanes.times(block, &spread);
            let other = lanes.times(block, &weighted_spread);
            for ((one, other), addition) in one.iter().zip(&other).zip(additions) {
                let crossed = other * z * one.transpose();
                let addition = &mut addition[block];
                addition.within -= one * z * one.transpose();
                addition.weighted += one * inner * one.transpose() - crossed - crossed.transpose();
            }
        }
        *covariance -= spread * z * spread.transpose();
        Some(())
    }

    /// The candidate that replaces the one at a place of the set best, and the criterion then.
    fn best(
        &self,
        set: &Set<B, D>,
        additions: &[[Addition<R>; B]],
        place: usize,
        taken: &[bool],
    ) -> Option<(usize, f64)> {
        let removed = &self.rows[set.chosen[place]];
        let removal: [_; B] = std::array::from_fn(|block| {
            let rows = &removed.blocks[block];
            let spread = set.covariance[block] * rows;
            let weighted_spread = set.weighted[block] * rows;
            Removal {
                within: rows.transpose() * spread,
                weighted: rows.transpose() * weighted_spread,
                spread,
                weighted_spread,
            }
        });
        let counts = self.counts(set);
        let mut best = None;
        for (group, (lanes, additions)) in
            self.lanes.iter().zip(additions.chunks(LANES)).enumerate()
        {
            let mut values = [set.value; LANES];
            for (block, removal) in removal.iter().enumerate() {
                let couplings = lanes.times(block, &removal.spread);
                let crossings = lanes.times(block, &removal.weighted_spread);
                for (lane, addition) in additions.iter().enumerate() {
                    let between = [&couplings[lane], &crossings[lane]];
                    let change = addition[block].less(between, removal, self.criterion);
                    values[lane] += change.unwrap_or(f64::INFINITY);
                }
            }
            for (lane, value) in values.into_iter().enumerate().take(additions.len()) {
                let candidate = LANES * group + lane;
                let kind = self.rows[candidate].kind;
                let full = kind != removed.kind && counts[kind] >= self.most[kind];
                if !taken[candidate] && !full && best.is_none_or(|(_, least)| value < least) {
                    best = Some((candidate, value));
                }
            }
        }
        best
    }
}

impl<const R: usize> Addition<R> {
    fn new(within: SMatrix<f64, R, R>, weighted: SMatrix<f64, R, R>, criterion: Criterion) -> Self {
        let grown = SMatrix::identity() + within;
        let inverse = inverse(grown).unwrap_or_else(SMatrix::zeros);
        let gain = match criterion {
            Criterion::A => inverse.dot(&weighted),
            Criterion::D => Cholesky::new(grown)
                .as_ref()
                .map_or(f64::NEG_INFINITY, logarithm),
        };
        Self {
            within,
            weighted,
            inverse,
            gain,
        }
    }

    /// By how much the criterion changes if the candidate, rows V, is added and another, rows U, then removed.
    /// Adding first leaves nothing singular in between. `between`: Vᵀ C U and Vᵀ C W C U. `None` if what is left
    /// is singular.
    fn less<const D: usize>(
        &self,
        [coupling, crossing]: [&SMatrix<f64, R, R>; 2],
        removal: &Removal<D, R>,
        criterion: Criterion,
    ) -> Option<f64> {
        let carried = self.inverse * coupling;
        let left = SMatrix::identity() - removal.within + coupling.transpose() * carried;
        match criterion {
            Criterion::D => Some(-self.gain - logarithm(&Cholesky::new(left)?)),
            Criterion::A => {
                let crossed = carried.transpose() * crossing;
                let moved = removal.weighted - crossed - crossed.transpose()
                    + carried.transpose() * self.weighted * carried;
                Some(inverse(left)?.dot(&moved) - self.gain)
            }
        }
    }
}

/// Of a small matrix that is positive definite but for rounding; in closed form, unlike a Cholesky factor's.
fn inverse<const R: usize>(matrix: SMatrix<f64, R, R>) -> Option<SMatrix<f64, R, R>> {
    let inverse = matrix.try_inverse()?;
    let positive = (0..R).all(|index| inverse[(index, index)] > 0.0);
    positive.then_some(inverse)
}

/// ln det of the factored matrix, with the core's logarithm: the platform's has other bits on another
/// system, and the same seed gives the same set on all.
fn logarithm<const N: usize>(factor: &Cholesky<f64, Const<N>>) -> f64 {
    let triangle = factor.l_dirty();
    2.0 * (0..N)
        .map(|index| triangle[(index, index)].natural_logarithm())
        .sum::<f64>()
}
