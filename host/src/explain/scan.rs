//! The gain of every hypothesis to first order, all unknowns refitted.
//!
//! ```text
//! residuals r, derivatives A by unknowns with prior U, E by the hypothesis:   M = AᵀA + UᵀU
//! a = S⁻¹ Eᵀ(r − A δ),   S = EᵀE − EᵀA M⁻¹ AᵀE,   gain = aᵀ S a
//! ```

use crate::effects::{At, Course, Effect, EffectKind, Platform};
use crate::files::samples_file::READINGS;
use crate::fit::Solution;
use crate::halt;
use crate::order;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

/// Below this part of a column, nothing of it is left beside the unknowns.
const INDISTINCT: f64 = 1e-8;

/// What may be wrong: effects, and rows to leave out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hypothesis {
    pub(crate) effects: Vec<Effect>,
    pub(crate) rows: Vec<usize>,
    /// Where a fit of the effects starts: all their unknowns.
    pub(super) from: Vec<f64>,
}

impl PartialEq for Hypothesis {
    fn eq(&self, other: &Self) -> bool {
        (&self.effects, &self.rows) == (&other.effects, &other.rows)
    }
}

impl Hypothesis {
    pub(super) fn of(effects: &[Effect], from: Vec<f64>) -> Self {
        Self {
            effects: effects.to_vec(),
            from,
            ..Self::default()
        }
    }

    pub(super) fn without(rows: &[usize]) -> Self {
        Self {
            rows: rows.to_vec(),
            ..Self::default()
        }
    }

    pub(super) fn and(&self, other: &Self) -> Option<Self> {
        let mut both = self.clone();
        for own in &other.effects {
            if both.effects.contains(own) {
                return None;
            }
            both.effects.push(*own);
        }
        both.from.extend(&other.from);
        both.rows.extend(&other.rows);
        both.rows.sort_unstable();
        both.rows.dedup();
        (both != *self).then_some(both)
    }

    pub(super) fn unknowns(&self) -> usize {
        self.effects.iter().map(Effect::unknowns).sum()
    }
}

/// σ of a reading over the median of the rows' rms residuals, of which the unknowns take up a third.
const OF_MEDIAN: f64 = 1.4;
/// Factor by which the scale of a robust fit shrinks, and how often.
const SHRUNK: f64 = 0.6;
const SHRINKAGES: u32 = 24;
/// Residuals of a suspected row, in σ.
const SUSPECTED: f64 = 4.0;

/// A row that takes part.
struct Counted {
    row: usize,
    at: At,
    start: Option<At>,
    /// Aᵀ, and derivatives by positions, weighted.
    by_unknowns: DMatrix<f64>,
    by_positions: [[Vector3<f64>; READINGS]; 2],
    weight: f64,
    /// With all unknowns refitted.
    residuals: DVector<f64>,
}

/// The residuals of a solution.
pub(super) struct Scan {
    course: Course,
    rows: Vec<Counted>,
    normal: Cholesky<f64, Dyn>,
    /// Of that, what is known without the readings.
    prior: DMatrix<f64>,
    unknowns: usize,
}

/// Sums over rows: EᵀE, AᵀE, Eᵀr.
#[derive(Clone)]
struct Sums {
    own: DMatrix<f64>,
    shared: DMatrix<f64>,
    right: DVector<f64>,
}

/// A gain in the sum of squares, in σ² of the solution's noise.
pub(super) type Gain = (f64, Hypothesis);

impl Scan {
    /// `None` if the rows do not determine the unknowns.
    pub(super) fn of(solution: &Solution) -> Option<Self> {
        let readings = &solution.readings;
        let (robot, unknowns) = (&solution.robot, solution.covariance.nrows());
        let course = Course::of(robot, Platform::default(), &solution.places, readings);
        let mut prior = solution.prior.tr_mul(&solution.prior);
        let mut normal = prior.clone();
        let mut right = -(solution.prior.tr_mul(&(&solution.prior * &solution.moved)));
        let every = solution.rows.len() as f64 / (solution.sensitivities.len() as f64).max(1.0);
        let mut rows = Vec::new();
        for own in &solution.sensitivities {
            let reading = &readings.rows.get(own.row)?.value;
            let Some(at) = At::new(robot, &reading.joints) else {
                continue;
            };
            let weight = (every * solution.rows[own.row].weight).sqrt();
            let by_unknowns = own.by_unknowns.transpose() * weight;
            let residuals = DVector::from_row_slice(&solution.rows[own.row].whitened) * weight;
            add_squares(&mut normal, 1.0, &by_unknowns);
            right += &by_unknowns * &residuals;
            rows.push(Counted {
                row: own.row,
                at,
                start: reading.poses()[1].and_then(|joints| At::new(robot, &joints)),
                by_unknowns,
                by_positions: own.by_positions,
                weight,
                residuals,
            });
        }
        for place in 0..unknowns {
            if !(normal[(place, place)] > 0.0) {
                normal[(place, place)] = 1.0;
                prior[(place, place)] = 1.0;
            }
        }
        let normal = normal.cholesky()?;
        let step = normal.solve(&right);
        for row in &mut rows {
            row.residuals -= row.by_unknowns.tr_mul(&step);
        }
        Some(Self {
            course,
            rows,
            normal,
            prior,
            unknowns,
        })
    }

    fn sums(&self, columns: usize) -> Sums {
        Sums {
            own: DMatrix::zeros(columns, columns),
            shared: DMatrix::zeros(self.unknowns, columns),
            right: DVector::zeros(columns),
        }
    }

    /// E of a row for these effects.
    fn columns(&self, counted: &Counted, effects: &[Effect]) -> DMatrix<f64> {
        let number = effects.iter().map(Effect::unknowns).sum();
        let mut columns = DMatrix::zeros(READINGS, number);
        let poses = [Some(&counted.at), counted.start.as_ref()];
        for (at, by_position) in poses.into_iter().zip(&counted.by_positions) {
            let Some(at) = at else { continue };
            let moves = effects.iter();
            let moves = moves.flat_map(|own| own.columns(at, &self.course, counted.row));
            for (place, moved) in moves.enumerate() {
                for (reading, by_position) in by_position.iter().enumerate() {
                    columns[(reading, place)] += counted.weight * by_position.dot(&moved);
                }
            }
        }
        columns
    }

    fn add(sums: &mut Sums, counted: &Counted, columns: &DMatrix<f64>) {
        sums.own += columns.tr_mul(columns);
        sums.shared += &counted.by_unknowns * columns;
        sums.right += columns.tr_mul(&counted.residuals);
    }

    fn of_all_rows(&self, effects: &[Effect]) -> Sums {
        let mut sums = self.sums(effects.iter().map(Effect::unknowns).sum());
        for counted in &self.rows {
            halt::check();
            Self::add(&mut sums, counted, &self.columns(counted, effects));
        }
        sums
    }

    /// The gain of these effects, which starts a fit at a = S⁻¹ Eᵀ(r − A δ).
    fn gain(&self, sums: &Sums, effects: &[Effect]) -> Option<Gain> {
        let mut left = &sums.own - sums.shared.tr_mul(&self.normal.solve(&sums.shared));
        // What no reading shows, or others show as well, gains nothing.
        for place in 0..left.nrows() {
            left[(place, place)] += INDISTINCT * sums.own[(place, place)] + f64::MIN_POSITIVE;
        }
        let by = left.cholesky()?.solve(&sums.right);
        let gain = by.dot(&sums.right);
        let hypothesis = Hypothesis::of(effects, by.as_slice().to_vec());
        gain.is_finite().then_some((gain, hypothesis))
    }

    /// The gain of effects that concern all rows.
    pub(super) fn throughout(&self, effects: &[Effect]) -> Option<Gain> {
        self.gain(&self.of_all_rows(effects), effects)
    }

    /// The gains of an effect that happened at each of these rows.
    pub(super) fn steps(&self, effect: Effect, rows: std::ops::Range<usize>) -> Vec<Gain> {
        // From the last row backwards, each row adds its own sums.
        let everywhere = effect.at(0);
        let mut sums = self.sums(effect.unknowns());
        let mut found = Vec::new();
        for counted in self.rows.iter().rev() {
            let columns = self.columns(counted, &[everywhere]);
            Self::add(&mut sums, counted, &columns);
            if rows.contains(&counted.row) {
                found.extend(self.gain(&sums, &[effect.at(counted.row)]));
            }
        }
        found
    }

    /// The gains of leaving out each row.
    pub(super) fn rows(&self) -> Vec<Gain> {
        let gain = |counted: &Counted| {
            let shared = &counted.by_unknowns;
            let held = shared.tr_mul(&self.normal.solve(shared));
            let read = |reading: &usize| counted.by_positions[0][*reading] != Vector3::zeros();
            let read: Vec<_> = (0..READINGS).filter(read).collect();
            let left = DMatrix::identity(READINGS, READINGS) - held;
            let left = left.select_rows(&read).select_columns(&read);
            let residuals = counted.residuals.select_rows(&read);
            let gain = left.cholesky()?.solve(&residuals).dot(&residuals);
            Some((gain, Hypothesis::without(&[counted.row])))
        };
        self.rows.iter().filter_map(gain).collect()
    }

    /// The rows that disagree with most others, by a robust fit about the solution: weights of Geman and McClure (1987),
    /// whose scale shrinks to the noise of half of the rows. With this noise, in σ.
    pub(super) fn suspected(&self) -> Option<(f64, Vec<usize>)> {
        let held = self
            .rows
            .iter()
            .fold(DVector::zeros(self.unknowns), |sum: DVector<f64>, own| {
                sum + &own.by_unknowns * &own.residuals
            });
        let off = |step: &DVector<f64>| -> Vec<f64> {
            let rows = self.rows.iter();
            rows.map(|own| {
                let left = &own.residuals - own.by_unknowns.tr_mul(step);
                let read = own.residuals.iter().filter(|own| **own != 0.0).count();
                (left.norm_squared() / read.max(1) as f64).sqrt()
            })
            .collect()
        };
        let noise = |off: &[f64]| {
            let mut sorted = off.to_vec();
            order::sort(&mut sorted);
            OF_MEDIAN * sorted.get(sorted.len() / 2).copied().unwrap_or_default()
        };
        let mut left = off(&DVector::zeros(self.unknowns));
        let mut scale = left.iter().copied().fold(0.0, f64::max);
        for _ in 0..SHRINKAGES {
            scale = f64::max(scale * SHRUNK, noise(&left));
            // The prior weighs as it does against readings of this noise.
            let square = scale * scale;
            let (mut normal, mut right) = (&self.prior * square, -square * &held);
            for (own, left) in self.rows.iter().zip(&left) {
                let weight = (1.0 + (left / scale).powi(2)).powi(-2);
                add_squares(&mut normal, weight, &own.by_unknowns);
                right += weight * (&own.by_unknowns * &own.residuals);
            }
            left = off(&normal.cholesky()?.solve(&right));
        }
        let noise = noise(&left);
        let rows = self.rows.iter().zip(&left);
        let rows = rows.filter(|(_, left)| **left > SUSPECTED * noise);
        Some((noise, rows.map(|(own, _)| own.row).collect()))
    }

    /// Three σ of a drift if the unknowns absorb most of it.
    pub(super) fn hidden_drift(&self, taken_up: f64) -> Option<f64> {
        let sums = self.of_all_rows(&[Effect::of(EffectKind::Drift)]);
        let left = &sums.own - sums.shared.tr_mul(&self.normal.solve(&sums.shared));
        let covariance = left.cholesky()?.inverse();
        let inflation = (0..3).map(|axis| covariance[(axis, axis)] * sums.own[(axis, axis)] / 3.0);
        let sigma = covariance.trace().sqrt();
        (inflation.sum::<f64>() > taken_up).then_some(3.0 * sigma)
    }
}

/// AᵀA of a row, this many times, in the lower half: all that is decomposed.
fn add_squares(sum: &mut DMatrix<f64>, weight: f64, by_unknowns: &DMatrix<f64>) {
    for reading in by_unknowns.column_iter().filter(|own| own.amax() > 0.0) {
        sum.syger(weight, &reading, &reading, 1.0);
    }
}
