//! Fedorov's exchange: each candidate in the set is replaced in turn by the one that improves the set most, until
//! no replacement improves it.
//!
//! V. V. Fedorov, *Theory of Optimal Experiments*, 1972; one replacement at a time as R. D. Cook and
//! C. J. Nachtsheim, "A comparison of algorithms for constructing exact D-optimal designs",
//! Technometrics 22(3), 1980. The criterion is tr W C, with the covariance C of all unknowns.

use nalgebra::{Const, DMatrix, Dyn, OMatrix, SMatrix};

/// Most passes over the set; about ten are enough.
const PASSES: usize = 40;
/// An exchange must improve the criterion by at least this fraction.
const WORTHWHILE: f64 = 1e-9;
/// Candidates processed side by side, so that the compiler can vectorise.
const LANES: usize = 8;

/// A candidate's contribution to the information: `R` rows, transposed.
pub(super) type Rows<const R: usize> = OMatrix<f64, Dyn, Const<R>>;
/// A small matrix for each candidate of a group.
type Each<const R: usize> = [SMatrix<f64, R, R>; LANES];

/// The candidates, the information before any measurement, and the criterion's weights.
pub(super) struct Pool<'a, const R: usize> {
    rows: &'a [Rows<R>],
    /// The same rows entry by entry for a group of candidates: `R` times the unknowns.
    lanes: Vec<Vec<[f64; LANES]>>,
    /// The kind of each candidate.
    kinds: &'a [usize],
    /// Information before any measurement.
    prior: &'a DMatrix<f64>,
    weights: &'a DMatrix<f64>,
    /// How many of each kind a set may hold.
    most: &'a [usize],
}

/// A set of candidates, by index, and the covariance after measuring them.
#[derive(Debug, Clone)]
pub(super) struct Set {
    pub(super) chosen: Vec<usize>,
    covariance: DMatrix<f64>,
    /// C W C.
    weighted: DMatrix<f64>,
    /// tr W C: smaller is better.
    pub(super) value: f64,
}

/// The effect of adding a candidate, rows V, to the set.
#[derive(Debug, Clone, Copy)]
struct Addition<const R: usize> {
    /// Vᵀ C V.
    within: SMatrix<f64, R, R>,
    /// Vᵀ C W C V.
    weighted: SMatrix<f64, R, R>,
    /// (I + Vᵀ C V)⁻¹.
    inverse: SMatrix<f64, R, R>,
    /// The decrease of tr W C.
    gain: f64,
}

/// A candidate of the set, rows U, that may be removed.
struct Removal<const R: usize> {
    /// C U.
    spread: Rows<R>,
    /// C W C U.
    weighted_spread: Rows<R>,
    /// Uᵀ C U.
    within: SMatrix<f64, R, R>,
    /// Uᵀ C W C U.
    weighted: SMatrix<f64, R, R>,
}

impl<'a, const R: usize> Pool<'a, R> {
    pub(super) fn new(
        rows: &'a [Rows<R>],
        kinds: &'a [usize],
        most: &'a [usize],
        (prior, weights): (&'a DMatrix<f64>, &'a DMatrix<f64>),
    ) -> Self {
        let unknowns = prior.nrows();
        let lanes = rows.chunks(LANES).map(|group| {
            let mut entries = vec![[0.0; LANES]; R * unknowns];
            for (lane, rows) in group.iter().enumerate() {
                for (entry, own) in entries.iter_mut().zip(rows.iter()) {
                    entry[lane] = *own;
                }
            }
            entries
        });
        Self {
            lanes: lanes.collect(),
            rows,
            kinds,
            prior,
            weights,
            most,
        }
    }

    /// The set of these candidates; `None` if its information is singular.
    pub(super) fn set(&self, chosen: Vec<usize>) -> Option<Set> {
        let mut information = self.prior.clone();
        for candidate in &chosen {
            let rows = &self.rows[*candidate];
            information += rows * rows.transpose();
        }
        let covariance = information.cholesky()?.inverse();
        let value = covariance.dot(self.weights);
        value.is_finite().then(|| Set {
            weighted: &covariance * self.weights * &covariance,
            chosen,
            covariance,
            value,
        })
    }

    /// Exchanges until nothing improves.
    pub(super) fn exchange(&self, mut set: Set) -> Set {
        let mut taken = self.taken(&set);
        for _ in 0..PASSES {
            // Recomputed in every pass: updates accumulate rounding errors.
            let mut additions = self.additions(&set);
            let mut bettered = false;
            for place in 0..set.chosen.len() {
                let threshold = set.value * (1.0 - WORTHWHILE);
                let best = self.best(&set, &additions, place, &taken);
                let Some((candidate, _)) = best.filter(|(_, value)| *value < threshold) else {
                    continue;
                };
                let mut chosen = set.chosen.clone();
                let removed = std::mem::replace(&mut chosen[place], candidate);
                // Recomputed from the rows, for the same reason.
                let exchanged = self.set(chosen);
                let Some(exchanged) = exchanged.filter(|own| own.value < threshold) else {
                    continue;
                };
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

    /// Adds the candidates that improve a set most, one at a time.
    pub(super) fn add(&self, mut set: Set, count: usize) -> Set {
        let mut taken = self.taken(&set);
        for _ in 0..count {
            let additions = self.additions(&set);
            let counts = self.counts(&set);
            let free = (0..self.rows.len()).filter(|candidate| {
                let kind = self.kinds[*candidate];
                !taken[*candidate] && counts[kind] < self.most[kind]
            });
            let best = free.max_by(|a, b| additions[*a].gain.total_cmp(&additions[*b].gain));
            let larger = best.and_then(|best| {
                taken[best] = true;
                self.set(set.chosen.iter().copied().chain([best]).collect())
            });
            match larger {
                Some(larger) => set = larger,
                None => break,
            }
        }
        set
    }

    fn taken(&self, set: &Set) -> Vec<bool> {
        let mut taken = vec![false; self.rows.len()];
        for candidate in &set.chosen {
            taken[*candidate] = true;
        }
        taken
    }

    /// How many of each kind a set holds.
    fn counts(&self, set: &Set) -> Vec<usize> {
        let mut counts = vec![0; self.most.len()];
        for candidate in &set.chosen {
            counts[self.kinds[*candidate]] += 1;
        }
        counts
    }

    fn additions(&self, set: &Set) -> Vec<Addition<R>> {
        let mut additions = Vec::with_capacity(LANES * self.lanes.len());
        for lanes in &self.lanes {
            let within = between::<R>(lanes, &set.covariance);
            let weighted = between::<R>(lanes, &set.weighted);
            let both = within.into_iter().zip(weighted);
            additions.extend(both.map(|(within, weighted)| Addition::new(within, weighted)));
        }
        additions.truncate(self.rows.len());
        additions
    }

    /// Updates the additions after one candidate was added to the set and another removed. `None` if rounding makes
    /// that impossible. When the information of rows U is added or removed (±), with S = C U and Z = ±(I ± Uᵀ S)⁻¹:
    ///
    /// ```text
    /// C' = C − S Z Sᵀ
    /// C' W C' = C W C − C W S Z Sᵀ − S Z Sᵀ W C + S Z Sᵀ W S Z Sᵀ
    /// ```
    fn update(
        &self,
        additions: &mut [Addition<R>],
        set: &Set,
        added: usize,
        removed: usize,
    ) -> Option<()> {
        let mut covariance = set.covariance.clone();
        for (candidate, sign) in [(added, 1.0), (removed, -1.0)] {
            let rows = &self.rows[candidate];
            let spread = &covariance * rows;
            let changed = SMatrix::identity() + rows.transpose() * &spread * sign;
            let z = inverse(changed)? * sign;
            let weights_spread = self.weights * &spread;
            let weighted_spread = &covariance * &weights_spread;
            let inner = z * (spread.transpose() * weights_spread) * z;
            for (lanes, additions) in self.lanes.iter().zip(additions.chunks_mut(LANES)) {
                let one = times(lanes, &spread);
                let other = times(lanes, &weighted_spread);
                for ((one, other), addition) in one.iter().zip(&other).zip(additions) {
                    let crossed = other * z * one.transpose();
                    addition.within -= one * z * one.transpose();
                    addition.weighted +=
                        one * inner * one.transpose() - crossed - crossed.transpose();
                }
            }
            covariance -= &spread * z * spread.transpose();
        }
        for addition in additions {
            *addition = Addition::new(addition.within, addition.weighted);
        }
        Some(())
    }

    /// The best replacement for the candidate at a place in the set, and the criterion after it.
    fn best(
        &self,
        set: &Set,
        additions: &[Addition<R>],
        place: usize,
        taken: &[bool],
    ) -> Option<(usize, f64)> {
        let leaving = set.chosen[place];
        let rows = &self.rows[leaving];
        let spread = &set.covariance * rows;
        let weighted_spread = &set.weighted * rows;
        let removal = Removal {
            within: rows.transpose() * &spread,
            weighted: rows.transpose() * &weighted_spread,
            spread,
            weighted_spread,
        };
        let counts = self.counts(set);
        let mut best = None;
        for (group, (lanes, additions)) in
            self.lanes.iter().zip(additions.chunks(LANES)).enumerate()
        {
            let couplings = times(lanes, &removal.spread);
            let crossings = times(lanes, &removal.weighted_spread);
            for (lane, addition) in additions.iter().enumerate() {
                let candidate = LANES * group + lane;
                let kind = self.kinds[candidate];
                let full = kind != self.kinds[leaving] && counts[kind] >= self.most[kind];
                if taken[candidate] || full {
                    continue;
                }
                let change = addition.less(&couplings[lane], &crossings[lane], &removal);
                let value = change.map_or(f64::INFINITY, |change| set.value + change);
                if best.is_none_or(|(_, least)| value < least) {
                    best = Some((candidate, value));
                }
            }
        }
        best
    }
}

impl<const R: usize> Addition<R> {
    fn new(within: SMatrix<f64, R, R>, weighted: SMatrix<f64, R, R>) -> Self {
        let inverse = inverse(SMatrix::identity() + within).unwrap_or_else(SMatrix::zeros);
        Self {
            gain: inverse.dot(&weighted),
            within,
            weighted,
            inverse,
        }
    }

    /// The change of the criterion if the candidate, rows V, is added and then another, rows U, removed, given Vᵀ C U
    /// and Vᵀ C W C U. Adding first keeps the information regular in between. `None` if it is singular afterwards.
    fn less(
        &self,
        coupling: &SMatrix<f64, R, R>,
        crossing: &SMatrix<f64, R, R>,
        removal: &Removal<R>,
    ) -> Option<f64> {
        let carried = self.inverse * coupling;
        let left = SMatrix::identity() - removal.within + coupling.transpose() * carried;
        let crossed = carried.transpose() * crossing;
        let moved = removal.weighted - crossed - crossed.transpose()
            + carried.transpose() * self.weighted * carried;
        Some(inverse(left)?.dot(&moved) - self.gain)
    }
}

/// The inverse, in closed form, of a small matrix that is positive definite up to rounding.
fn inverse<const R: usize>(matrix: SMatrix<f64, R, R>) -> Option<SMatrix<f64, R, R>> {
    let inverse = matrix.try_inverse()?;
    let positive = (0..R).all(|index| inverse[(index, index)] > 0.0);
    positive.then_some(inverse)
}

/// Vᵀ S of each candidate of a group.
fn times<const R: usize>(lanes: &[[f64; LANES]], matrix: &Rows<R>) -> Each<R> {
    let mut products = [SMatrix::zeros(); LANES];
    for (index, row) in lanes.chunks_exact(matrix.nrows()).enumerate() {
        for (column, factors) in matrix.column_iter().enumerate() {
            let sums = sum(row, factors.iter());
            for (product, sum) in products.iter_mut().zip(sums) {
                product[(index, column)] = sum;
            }
        }
    }
    products
}

/// Vᵀ C V of each candidate of a group, C symmetric.
fn between<const R: usize>(lanes: &[[f64; LANES]], matrix: &DMatrix<f64>) -> Each<R> {
    let unknowns = matrix.nrows();
    let mut products = [SMatrix::<f64, R, R>::zeros(); LANES];
    for (column, right) in lanes.chunks_exact(unknowns).enumerate() {
        for (own, of_column) in matrix.column_iter().enumerate() {
            // The entry of C V that belongs to this row of C.
            let sums = sum(right, of_column.iter());
            for (index, left) in lanes.chunks_exact(unknowns).enumerate() {
                for lane in 0..LANES {
                    products[lane][(index, column)] += left[own][lane] * sums[lane];
                }
            }
        }
    }
    products
}

fn sum<'a>(row: &[[f64; LANES]], factors: impl Iterator<Item = &'a f64>) -> [f64; LANES] {
    let mut sums = [0.0; LANES];
    for (entries, factor) in row.iter().zip(factors) {
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum += entry * factor;
        }
    }
    sums
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// The result is a local optimum: no single exchange, evaluated by direct inversion, improves the set.
    #[test]
    fn an_exchange_ends_where_no_other_candidate_is_better() {
        let mut state = 1_u32;
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX) - 0.5
        };
        let rows: Vec<Rows<1>> = (0..40)
            .map(|_| Rows::<1>::from_fn(5, |_, _| number()))
            .collect();
        let kinds: Vec<usize> = (0..40).map(|own| own % 2).collect();
        let prior = DMatrix::identity(5, 5) * 0.01;
        let weights = DMatrix::from_diagonal_element(5, 5, 2.0);
        let pool = Pool::new(&rows, &kinds, &[usize::MAX, 3], (&prior, &weights));
        let found = pool.exchange(pool.set((0..6).collect()).unwrap());
        let of_one_kind = |chosen: &[usize]| chosen.iter().filter(|own| *own % 2 == 1).count();
        assert!(of_one_kind(&found.chosen) <= 3);
        for place in 0..6 {
            for candidate in (0..40).filter(|own| !found.chosen.contains(own)) {
                let mut chosen = found.chosen.clone();
                chosen[place] = candidate;
                if of_one_kind(&chosen) <= 3 {
                    let other = pool.set(chosen).unwrap().value;
                    assert!(other >= found.value * (1.0 - 1e-8), "{place} {candidate}");
                }
            }
        }
    }
}
