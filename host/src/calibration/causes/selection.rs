//! Which hypotheses explain the residuals: forward, and then backward.

use super::cause::{Alternative, Cause, CauseKind};
use super::hypotheses::{self, Hypothesis};
use super::regression::{Regression, Solution};
use delta_cal::robot::Drive;
use nalgebra::DVector;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// The probability that some hypothesis of a file without any cause is taken for one.
const FALSE_ALARM: f64 = 0.003;
/// Fewer degrees of freedom than these do not tell the residuals' variance.
const LEAST_FREEDOM: f64 = 5.0;
/// What a hypothesis must gain for each of its columns to be ranked before another: near the limit as
/// many as change the probability by the same factor.
const PER_COLUMN: f64 = 3.0;
/// Twice the logarithm of 20: what explains less than that more is not clearly better.
const CLEARLY: f64 = 6.0;

/// What was selected.
pub(super) struct Selection {
    pub(super) found: Vec<Cause>,
    /// Of the columns that always take part, with the causes beside them.
    pub(super) coefficients: DVector<f64>,
    /// See [`Causes::explained`](super::Causes::explained).
    pub(super) explained: f64,
}

struct Search<'a> {
    regression: &'a Regression,
    hypotheses: Vec<Hypothesis>,
    drive: Drive,
    ranges: &'a [[f64; 2]; 3],
    stated: bool,
    level: f64,
}

/// The causes found in a robot with these drives, whose joints were measured over these ranges; an effect below
/// `negligible`, in σ of the positions, is none.
///
/// # Errors
/// Why the residuals cannot be tested.
pub(super) fn select(
    regression: &Regression,
    (drive, ranges): (Drive, &[[f64; 2]; 3]),
    stated: bool,
    negligible: f64,
) -> Result<Option<Selection>, &'static str> {
    let hypotheses = hypotheses::all(drive);
    let number = hypotheses.iter().fold(0.0, |count, _| count + 1.0);
    let search = Search {
        regression,
        hypotheses,
        drive,
        ranges,
        stated,
        level: FALSE_ALARM / number,
    };
    let without = regression
        .solve(&[])
        .ok_or("the poses do not determine the parameters well enough")?;
    if without.freedom < LEAST_FREEDOM {
        return Err("too few samples are left over to tell causes from noise");
    }
    let mut chosen = Vec::new();
    while let Some(next) = search.next(&chosen) {
        chosen.push(next);
    }
    search.drop_superfluous(&mut chosen);
    Ok(search
        .solve(&chosen)
        .filter(|_| !chosen.is_empty())
        .filter(|solution| search.effect(&chosen, solution) > negligible)
        .map(|solution| search.selection(&chosen, &solution, &without)))
}

impl Search<'_> {
    fn columns(&self, chosen: &[usize]) -> Vec<usize> {
        let chosen = chosen.iter().map(|index| &self.hypotheses[*index]);
        chosen
            .flat_map(|hypothesis| hypothesis.columns.clone())
            .collect()
    }

    /// `None` without enough degrees of freedom left.
    fn solve(&self, chosen: &[usize]) -> Option<Solution> {
        let solution = self.regression.solve(&self.columns(chosen))?;
        (solution.freedom >= LEAST_FREEDOM).then_some(solution)
    }

    fn gain(&self, chosen: &[usize], next: usize) -> f64 {
        let group = self.hypotheses[next].columns.clone();
        let gains = self.regression.gains(&self.columns(chosen), &[group]);
        gains.first().copied().flatten().unwrap_or(0.0)
    }

    /// What each hypothesis explains beside the chosen ones, for what it costs: its gain in units of
    /// the variance that `solution` leaves.
    fn ranks(&self, chosen: &[usize], solution: &Solution) -> Vec<Option<f64>> {
        let groups: Vec<_> = self.hypotheses.iter().map(|h| h.columns.clone()).collect();
        let gains = self.regression.gains(&self.columns(chosen), &groups);
        let unit = self.unit(solution.variance());
        let ranked = gains.into_iter().zip(&self.hypotheses).enumerate();
        ranked
            .map(|(index, (gain, hypothesis))| {
                let rank = gain? / unit - PER_COLUMN * number(hypothesis);
                (!chosen.contains(&index)).then_some(rank)
            })
            .collect()
    }

    /// Of the significant hypotheses the one that explains most beside the chosen ones. A rare one must
    /// explain clearly more than the others.
    fn next(&self, chosen: &[usize]) -> Option<usize> {
        let ranks = self.ranks(chosen, &self.solve(chosen)?);
        let ranked = ranks.iter().enumerate().filter_map(|(index, rank)| {
            let mut with = chosen.to_vec();
            with.push(index);
            let gain = self.gain(chosen, index);
            let probability = self.probability(gain, index, &self.solve(&with)?);
            let rare = self.hypotheses[index].kind == CauseKind::SecondHarmonic;
            let rank = (*rank)? - if rare { CLEARLY } else { 0.0 };
            (probability < self.level).then_some((index, rank))
        });
        ranked
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }

    /// What explains about as much in place of one of the chosen.
    fn alternatives(
        &self,
        chosen: &[usize],
        place: usize,
        solution: &Solution,
    ) -> Vec<Alternative> {
        let mut others = chosen.to_vec();
        let own = others.remove(place);
        let ranks = self.ranks(&others, solution);
        let least = ranks[own].map_or(f64::INFINITY, |rank| rank - CLEARLY);
        let as_good =
            ranks
                .iter()
                .zip(&self.hypotheses)
                .enumerate()
                .filter(|(index, (rank, _))| {
                    !chosen.contains(index) && rank.is_some_and(|rank| rank > least)
                });
        as_good
            .map(|(_, (_, hypothesis))| Alternative {
                kind: hypothesis.kind,
                arm: hypothesis.arm,
            })
            .collect()
    }

    /// The probability of such a gain by chance: against the stated noise (χ²) or, if the residuals
    /// exceed that even with the hypothesis, against what is left of them, because an understated
    /// noise is no cause. Without a stated noise F.
    fn probability(&self, gain: f64, index: usize, with: &Solution) -> f64 {
        let columns = number(&self.hypotheses[index]);
        if self.stated {
            let gain = gain / self.unit(with.variance());
            ChiSquared::new(columns).map_or(1.0, |chi_square| chi_square.sf(gain))
        } else {
            let ratio = gain / columns / with.variance();
            FisherSnedecor::new(columns, with.freedom).map_or(1.0, |f| f.sf(ratio))
        }
    }

    /// The variance that residuals are compared with, given what is left of them.
    fn unit(&self, variance: f64) -> f64 {
        if self.stated {
            variance.max(1.0)
        } else {
            variance
        }
    }

    /// Leaves out, the weakest first, what is not significant beside the others.
    fn drop_superfluous(&self, chosen: &mut Vec<usize>) {
        while let Some(solution) = self.solve(chosen) {
            let weakest = (0..chosen.len())
                .map(|place| (place, self.beside_others(chosen, place, &solution)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            match weakest {
                Some((place, probability)) if probability >= self.level => {
                    chosen.remove(place);
                }
                _ => return,
            }
        }
    }

    fn beside_others(&self, chosen: &[usize], place: usize, solution: &Solution) -> f64 {
        let mut others = chosen.to_vec();
        let own = others.remove(place);
        self.probability(self.gain(&others, own), own, solution)
    }

    /// √ of the mean square of what the chosen ones do, in σ.
    fn effect(&self, chosen: &[usize], solution: &Solution) -> f64 {
        let columns = self.columns(chosen);
        let first = solution.coefficients.len() - columns.len();
        let coefficients = &solution.coefficients.as_slice()[first..];
        let squares = self.regression.effect(&columns, coefficients);
        (squares / self.regression.worth()).sqrt()
    }

    fn selection(&self, chosen: &[usize], solution: &Solution, without: &Solution) -> Selection {
        let columns = self.columns(chosen);
        let mut next = solution.coefficients.len() - columns.len();
        let variance = self.unit(solution.variance());
        let found = chosen.iter().enumerate().map(|(place, index)| {
            let hypothesis = &self.hypotheses[*index];
            let count = hypothesis.columns.len();
            let coefficients = solution.coefficients.rows(next, count).into_owned();
            let covariance = solution.covariance.view((next, next), (count, count)) * variance;
            next += count;
            let length = coefficients.norm();
            let along = &coefficients / length;
            let sigma = (along.transpose() * covariance * &along)[(0, 0)].sqrt();
            let size = match coefficients.as_slice() {
                [only] => *only,
                _ => length,
            };
            let kind: CauseKind = hypothesis.kind;
            Cause {
                kind,
                arm: hypothesis.arm,
                drive: self.drive,
                range: hypothesis
                    .arm
                    .map_or([0.0; 2], |arm| self.ranges[arm.index()]),
                size: kind.in_unit(self.drive, size),
                sigma: kind.in_unit(self.drive, sigma),
                probability: self.beside_others(chosen, place, solution),
                coefficients: coefficients.as_slice().to_vec(),
                alternatives: self.alternatives(chosen, place, solution),
            }
        });
        Selection {
            found: found.collect(),
            explained: 1.0 - solution.squares / without.squares,
            coefficients: solution.coefficients.clone(),
        }
    }
}

fn number(hypothesis: &Hypothesis) -> f64 {
    hypothesis.columns.iter().fold(0.0, |count, _| count + 1.0)
}
