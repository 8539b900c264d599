//! Fedorov's exchange: each candidate in the set is replaced in turn by the one that improves the set most, until
//! no replacement improves it.
//!
//! V. V. Fedorov, *Theory of Optimal Experiments*, 1972; one replacement at a time as R. D. Cook and
//! C. J. Nachtsheim, "A comparison of algorithms for constructing exact D-optimal designs",
//! Technometrics 22(3), 1980. The criterion is tr W C, with the covariance C of all unknowns.

use crate::halt;
use nalgebra::{Const, DMatrix, Dyn, OMatrix, SMatrix};

/// Most passes over the set; about ten are enough.
const PASSES: usize = 40;
/// An exchange must improve the criterion by at least this fraction.
const WORTHWHILE: f64 = 1e-9;

/// Updates of the additions keep the rounding errors of the larger numbers from which they started: after a pass that has
/// brought the criterion below this part of its value then, they are computed anew.
const FRESH: f64 = 0.5;

/// A row for each of a candidate's readings, with an entry for each unknown.
pub(super) type Rows<const R: usize> = OMatrix<f64, Const<R>, Dyn>;

/// The candidates, the information before any measurement, and the criterion's weights.
pub(super) struct Pool<const R: usize> {
    /// The sensitivity of each candidate's readings, Vᵀ: its information is V Vᵀ.
    pub(super) rows: Vec<Rows<R>>,
    pub(super) kinds: Vec<usize>,
    /// How many of each kind a set may hold.
    pub(super) most: Vec<usize>,
    /// Information before any measurement.
    pub(super) prior: DMatrix<f64>,
    pub(super) weights: DMatrix<f64>,
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

/// The effect of adding a candidate, rows Vᵀ, to the set.
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

impl<const R: usize> Pool<R> {
    /// The set of these candidates; `None` if its information is singular.
    pub(super) fn set(&self, chosen: Vec<usize>) -> Option<Set> {
        let mut information = self.prior.clone();
        for candidate in &chosen {
            let rows = &self.rows[*candidate];
            information.gemm(1.0, &rows.transpose(), rows, 1.0);
        }
        let covariance = information.cholesky()?.inverse();
        let value = covariance.dot(&self.weights);
        value.is_finite().then(|| Set {
            weighted: &covariance * &self.weights * &covariance,
            chosen,
            covariance,
            value,
        })
    }

    /// Exchanges until nothing improves.
    pub(super) fn exchange(&self, mut set: Set) -> Set {
        let count = set.chosen.len();
        let (mut additions, mut computed, mut settled) = (Vec::new(), f64::INFINITY, 0);
        for place in (0..count).cycle().take(PASSES * count) {
            if settled == count {
                break;
            }
            if place == 0 && !(set.value > FRESH * computed) {
                (additions, computed) = (self.additions(&set), set.value);
            }
            halt::check();
            settled += 1;
            let threshold = set.value * (1.0 - WORTHWHILE);
            let best = self.best(&set, &additions, place);
            let Some((candidate, _)) = best.filter(|(_, value)| *value < threshold) else {
                continue;
            };
            let mut chosen = set.chosen.clone();
            let removed = std::mem::replace(&mut chosen[place], candidate);
            let exchanged = self.set(chosen);
            let Some(exchanged) = exchanged.filter(|own| own.value < threshold) else {
                continue;
            };
            let updated = self.update(&mut additions, &set, candidate, removed);
            set = exchanged;
            if updated.is_none() {
                (additions, computed) = (self.additions(&set), set.value);
            }
            // Beside the others, nothing is better in this place.
            settled = 1;
        }
        set
    }

    /// Adds the candidates that improve a set most, one at a time, as long as there are any. `None` if its information is
    /// singular.
    pub(super) fn add(&self, mut set: Set, count: usize) -> Option<Set> {
        for _ in 0..count {
            halt::check();
            let additions = self.additions(&set);
            let free = self.free(&set, None);
            let best = free.max_by(|a, b| additions[*a].gain.total_cmp(&additions[*b].gain));
            let Some(best) = best else {
                break;
            };
            let mut chosen = set.chosen;
            chosen.push(best);
            set = self.set(chosen)?;
        }
        Some(set)
    }

    /// The candidates that may join a set, after one leaves it.
    fn free(&self, set: &Set, leaving: Option<usize>) -> impl Iterator<Item = usize> {
        let mut taken = vec![false; self.kinds.len()];
        let mut left = self.most.clone();
        for candidate in &set.chosen {
            taken[*candidate] = true;
            left[self.kinds[*candidate]] -= 1;
        }
        if let Some(leaving) = leaving {
            left[self.kinds[leaving]] += 1;
        }
        let free = move |candidate: &usize| !taken[*candidate] && left[self.kinds[*candidate]] > 0;
        (0..self.kinds.len()).filter(free)
    }

    fn additions(&self, set: &Set) -> Vec<Addition<R>> {
        let of = |rows: &Rows<R>| {
            let [within, weighted] =
                [&set.covariance, &set.weighted].map(|own| times(rows, &(rows * own)));
            Addition::new(within, weighted)
        };
        self.rows.iter().map(of).collect()
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
            let own = rows * &covariance;
            let z = inverse(SMatrix::identity() + times(rows, &own) * sign)? * sign;
            let weights = &own * &self.weights;
            let inner = z * times(&own, &weights) * z;
            let weighted_own = weights * &covariance;
            for (addition, rows) in additions.iter_mut().zip(&self.rows) {
                let (one, other) = (times(rows, &own), times(rows, &weighted_own));
                let crossed = other * z * one.transpose();
                addition.within -= one * z * one.transpose();
                addition.weighted += one * inner * one.transpose() - crossed - crossed.transpose();
            }
            covariance.gemm(-1.0, &own.transpose(), &(z * &own), 1.0);
        }
        for addition in additions {
            *addition = Addition::new(addition.within, addition.weighted);
        }
        Some(())
    }

    /// The best replacement for the candidate at a place in the set, and the criterion after it.
    ///
    /// The replacement, rows V, is added before the leaving candidate, rows U, is removed: that keeps the information
    /// regular in between.
    fn best(&self, set: &Set, additions: &[Addition<R>], place: usize) -> Option<(usize, f64)> {
        let leaving = set.chosen[place];
        let rows = &self.rows[leaving];
        let [own, weighted_own] = [&set.covariance, &set.weighted].map(|own| rows * own);
        let (within, weighted) = (times(rows, &own), times(rows, &weighted_own));
        let replaced = self.free(set, Some(leaving)).map(|candidate| {
            let (rows, addition) = (&self.rows[candidate], &additions[candidate]);
            let (coupling, crossing) = (times(rows, &own), times(rows, &weighted_own));
            let carried = addition.inverse * coupling;
            let left = SMatrix::identity() - within + coupling.transpose() * carried;
            let crossed = carried.transpose() * crossing;
            let moved = weighted - crossed - crossed.transpose()
                + carried.transpose() * addition.weighted * carried;
            let change = inverse(left).map(|left| left.dot(&moved) - addition.gain);
            (
                candidate,
                change.map_or(f64::INFINITY, |change| set.value + change),
            )
        });
        replaced.min_by(|a, b| a.1.total_cmp(&b.1))
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
}

/// Vᵀ S of rows Vᵀ and Sᵀ.
fn times<const R: usize>(rows: &Rows<R>, spread: &Rows<R>) -> SMatrix<f64, R, R> {
    // Written out, because this takes most of the time of a plan.
    let [rows, spread] = [rows, spread].map(|own| own.as_slice().as_chunks::<R>().0);
    let mut product = [[0.0; R]; R];
    for (row, spread) in rows.iter().zip(spread) {
        for (column, spread) in product.iter_mut().zip(spread) {
            for (sum, row) in column.iter_mut().zip(row) {
                *sum += row * spread;
            }
        }
    }
    SMatrix::from(product)
}

/// The inverse, in closed form, of a small matrix that is positive definite up to rounding.
fn inverse<const R: usize>(matrix: SMatrix<f64, R, R>) -> Option<SMatrix<f64, R, R>> {
    let inverse = matrix.try_inverse()?;
    let positive = (0..R).all(|index| inverse[(index, index)] > 0.0);
    positive.then_some(inverse)
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
        let pool = Pool::<1> {
            rows: (0..40).map(|_| Rows::from_fn(5, |_, _| number())).collect(),
            kinds: (0..40).map(|own| own % 2).collect(),
            most: vec![usize::MAX, 3],
            prior: DMatrix::identity(5, 5) * 0.01,
            weights: DMatrix::from_diagonal_element(5, 5, 2.0),
        };
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
