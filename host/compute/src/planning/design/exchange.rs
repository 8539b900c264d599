//! Fedorov's exchange: one candidate of the set after the other is replaced by that which betters the
//! set most, until none does.
//!
//! V. V. Fedorov, *Theory of Optimal Experiments*, 1972; one replacement at a time as R. D. Cook and
//! C. J. Nachtsheim, "A comparison of algorithms for constructing exact D-optimal designs",
//! Technometrics 22(3), 1980.

use delta_cal::Real;
use nalgebra::{Cholesky, Const, SMatrix};

/// Passes over the set at most; it settles after some ten.
const PASSES: usize = 40;
/// An exchange must better the criterion by this part of it.
const WORTHWHILE: f64 = 1e-9;

/// What a set is judged by; C is the covariance of the parameters, the prior included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// tr C, angles times the upper arm's length: the mean square of the parameter error.
    #[default]
    A,
    /// det C: the volume of the parameters' confidence region, whatever their units.
    D,
}

impl Criterion {
    /// As it is written: `a` or `d`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "a",
            Self::D => "d",
        }
    }
}

/// What each candidate adds to the information: `R` rows of each of `B` blocks of `D` parameters.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Rows<const B: usize, const D: usize, const R: usize> {
    /// Transposed: a row is a column here.
    pub(in crate::planning) blocks: [SMatrix<f64, D, R>; B],
    /// Of which kind the candidate is.
    pub(in crate::planning) kind: usize,
}

/// The candidates, what is known before any is measured, and what a set is judged by: with the criterion A
/// the variance of K combinations L of each block's parameters, tr Lᵀ C L.
pub(in crate::planning) struct Candidates<
    'a,
    const B: usize,
    const D: usize,
    const R: usize,
    const K: usize,
> {
    pub(in crate::planning) rows: &'a [Rows<B, D, R>],
    /// Information before.
    pub(in crate::planning) prior: Vec<SMatrix<f64, D, D>>,
    pub(in crate::planning) criterion: Criterion,
    /// L.
    pub(in crate::planning) combinations: [SMatrix<f64, D, K>; B],
    /// How many of each kind a set may hold.
    pub(in crate::planning) most: &'a [usize],
}

/// A set of candidates, by index, and the covariance it leaves.
#[derive(Debug, Clone)]
pub(in crate::planning) struct Set<const B: usize, const D: usize> {
    pub(in crate::planning) chosen: Vec<usize>,
    covariance: [SMatrix<f64, D, D>; B],
    /// The criterion: smaller is better. tr Lᵀ C L, or ln det C.
    pub(in crate::planning) value: f64,
}

/// What adding a candidate, rows V, to the set would do, block by block.
struct Addition<const R: usize, const K: usize> {
    /// Vᵀ C V.
    within: SMatrix<f64, R, R>,
    /// Lᵀ C V.
    combined: SMatrix<f64, K, R>,
    /// (I + Vᵀ C V)⁻¹.
    inverse: SMatrix<f64, R, R>,
    /// By which the criterion falls: tr Lᵀ C L, or ln det C.
    gain: f64,
}

/// A candidate of the set, rows U, that may be removed.
struct Removal<const D: usize, const R: usize, const K: usize> {
    /// C U.
    spread: SMatrix<f64, D, R>,
    /// Uᵀ C U.
    within: SMatrix<f64, R, R>,
    /// Lᵀ C U.
    combined: SMatrix<f64, K, R>,
}

impl<const B: usize, const D: usize, const R: usize, const K: usize> Candidates<'_, B, D, R, K> {
    /// The set of these candidates; `None` if its information is singular.
    pub(in crate::planning) fn set(&self, chosen: Vec<usize>) -> Option<Set<B, D>> {
        let mut covariance = [SMatrix::zeros(); B];
        let mut value = 0.0;
        for (block, covariance) in covariance.iter_mut().enumerate() {
            let mut information = self.prior[block];
            for candidate in &chosen {
                let rows = &self.rows[*candidate].blocks[block];
                information += product(rows, &rows.transpose());
            }
            let factor = Cholesky::new(information)?;
            *covariance = factor.inverse();
            let combinations = &self.combinations[block];
            value += match self.criterion {
                Criterion::A => (*covariance * combinations).dot(combinations),
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
                self.update(&mut additions, &set, candidate, removed);
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

    fn additions(&self, set: &Set<B, D>) -> Vec<[Addition<R, K>; B]> {
        let combined: [_; B] = std::array::from_fn(|block| {
            (set.covariance[block] * self.combinations[block]).transpose()
        });
        let of = |rows: &Rows<B, D, R>| {
            std::array::from_fn(|block| {
                let rows = &rows.blocks[block];
                let spread = product(&set.covariance[block], rows);
                Addition::new(
                    transposed_product(rows, &spread),
                    product(&combined[block], rows),
                    self.criterion,
                )
            })
        };
        self.rows.iter().map(of).collect()
    }

    /// What the additions are after a candidate was added to a set and another removed.
    ///
    /// C' = C − S (I + Vᵀ S)⁻¹ Sᵀ with S = C V, and C'' = C' + S' (I − Uᵀ S')⁻¹ S'ᵀ with S' = C' U.
    fn update(
        &self,
        additions: &mut [[Addition<R, K>; B]],
        set: &Set<B, D>,
        added: usize,
        removed: usize,
    ) {
        for block in 0..B {
            let covariance = &set.covariance[block];
            let (rows, gone) = (
                &self.rows[added].blocks[block],
                &self.rows[removed].blocks[block],
            );
            let spread = covariance * rows;
            let Some(grown) = Cholesky::new(identity::<R>() + rows.transpose() * spread) else {
                continue;
            };
            let coupling = spread.transpose() * gone;
            let spread_of_gone = covariance * gone - spread * grown.solve(&coupling);
            let left = identity::<R>() - gone.transpose() * spread_of_gone;
            let Some(shrunk) = Cholesky::new(left) else {
                continue;
            };
            let combinations = self.combinations[block].transpose();
            let (combined, combined_gone) = (combinations * spread, combinations * spread_of_gone);
            for (additions, rows) in additions.iter_mut().zip(self.rows) {
                let (rows, addition) = (&rows.blocks[block], &mut additions[block]);
                let one = transposed_product(&spread, rows);
                let other = transposed_product(&spread_of_gone, rows);
                let (solved, solved_gone) = (grown.solve(&one), shrunk.solve(&other));
                *addition = Addition::new(
                    addition.within - transposed_product(&one, &solved)
                        + transposed_product(&other, &solved_gone),
                    addition.combined - product(&combined, &solved)
                        + product(&combined_gone, &solved_gone),
                    self.criterion,
                );
            }
        }
    }

    /// The candidate that replaces the one at a place of the set best, and the criterion then.
    fn best(
        &self,
        set: &Set<B, D>,
        additions: &[[Addition<R, K>; B]],
        place: usize,
        taken: &[bool],
    ) -> Option<(usize, f64)> {
        let removed = &self.rows[set.chosen[place]];
        let removal: [_; B] = std::array::from_fn(|block| {
            let rows = &removed.blocks[block];
            let spread = product(&set.covariance[block], rows);
            Removal {
                within: transposed_product(rows, &spread),
                combined: transposed_product(&self.combinations[block], &spread),
                spread,
            }
        });
        let counts = self.counts(set);
        let mut best = None;
        for (candidate, additions) in additions.iter().enumerate() {
            let kind = self.rows[candidate].kind;
            if taken[candidate] || kind != removed.kind && counts[kind] >= self.most[kind] {
                continue;
            }
            let mut value = set.value;
            for block in 0..B {
                let rows = &self.rows[candidate].blocks[block];
                let change = additions[block].less(rows, &removal[block], self.criterion);
                value += change.unwrap_or(f64::INFINITY);
            }
            if best.is_none_or(|(_, least)| value < least) {
                best = Some((candidate, value));
            }
        }
        best
    }
}

impl<const R: usize, const K: usize> Addition<R, K> {
    fn new(within: SMatrix<f64, R, R>, combined: SMatrix<f64, K, R>, criterion: Criterion) -> Self {
        let factor = Cholesky::new(identity::<R>() + within);
        let inverse = factor.as_ref().map_or(SMatrix::zeros(), Cholesky::inverse);
        let gain = match criterion {
            Criterion::A => inverse.dot(&transposed_product(&combined, &combined)),
            Criterion::D => factor.as_ref().map_or(f64::NEG_INFINITY, logarithm),
        };
        Self {
            within,
            combined,
            inverse,
            gain,
        }
    }

    /// By how much the criterion changes if the candidate, rows V, is added and another then removed. Adding
    /// first leaves nothing singular in between. `None` if what is left is.
    fn less<const D: usize>(
        &self,
        rows: &SMatrix<f64, D, R>,
        removal: &Removal<D, R, K>,
        criterion: Criterion,
    ) -> Option<f64> {
        let coupling = transposed_product(rows, &removal.spread);
        let carried = product(&self.inverse, &coupling);
        let left = identity::<R>() - removal.within + transposed_product(&coupling, &carried);
        let factor = Cholesky::new(left)?;
        match criterion {
            Criterion::D => Some(-self.gain - logarithm(&factor)),
            Criterion::A => {
                let moved = removal.combined - product(&self.combined, &carried);
                let lost = factor.solve(&transposed_product(&moved, &moved)).trace();
                Some(lost - self.gain)
            }
        }
    }
}

/// As `left * right`, to the bit, without nalgebra's calls for every column: most matrices here have one.
fn product<const A: usize, const B: usize, const C: usize>(
    left: &SMatrix<f64, A, B>,
    right: &SMatrix<f64, B, C>,
) -> SMatrix<f64, A, C> {
    let mut product = SMatrix::zeros();
    for column in 0..C {
        for inner in 0..B {
            let factor = right[(inner, column)];
            for row in 0..A {
                product[(row, column)] += left[(row, inner)] * factor;
            }
        }
    }
    product
}

/// As `left.transpose() * right`, likewise.
fn transposed_product<const A: usize, const B: usize, const C: usize>(
    left: &SMatrix<f64, B, A>,
    right: &SMatrix<f64, B, C>,
) -> SMatrix<f64, A, C> {
    product(&left.transpose(), right)
}

fn identity<const R: usize>() -> SMatrix<f64, R, R> {
    SMatrix::identity()
}

/// ln det of the factored matrix, with the core's logarithm: the platform's has other bits on another
/// system, and the same seed gives the same set on all.
fn logarithm<const N: usize>(factor: &Cholesky<f64, Const<N>>) -> f64 {
    let triangle = factor.l_dirty();
    2.0 * (0..N)
        .map(|index| triangle[(index, index)].natural_logarithm())
        .sum::<f64>()
}
