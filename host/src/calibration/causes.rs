//! Directed tests of the residuals for errors that the model cannot represent.
//!
//! ```text
//! residuals of a row   Lₖ⁻¹ (mₖ − h(FK(P; qₖ), u)) = Lₖ⁻¹ (J δ(P, u) + C a) + noise
//! ```
//!
//! P are the parameters and u the instruments' unknowns, with their prior. Each hypothesis has columns C. Its gain is
//! the decrease of the sum of squares with all parameters refitted, so the robot need not be the optimum of this sum.

mod regression;
mod subject;

use crate::effects::{At, Effect, EffectKind};
use crate::files::convention::Convention;
use crate::files::samples_file::Readings;
use crate::fit::Solution;
use delta_cal::Sample;
use delta_cal::robot::Drive;
use nalgebra::Vector3;
use regression::{Fit, Regression};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};
pub(super) use subject::Subject;

/// A cause that moves the positions by less than this, mm rms, is rounding.
const NEGLIGIBLE: f64 = 1e-6;

/// A drift is hidden if the unknowns increase its variance by more than this factor.
const TAKEN_UP: f64 = 4.0;

/// Results of the tests of the residuals.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Causes {
    /// The causes found, the one that explains most first.
    #[serde(rename = "causes")]
    pub found: Vec<Cause>,
    /// The reason why the residuals were not tested, if they were not.
    #[serde(rename = "causes_not_tested")]
    pub not_tested: Option<&'static str>,
    /// The largest drift of the positions, from the first row to the last, that the order of the rows hides, mm: three
    /// σ. `None` if the order separates drift from geometry.
    #[serde(skip)]
    pub hidden_drift: Option<f64>,
    /// Error of the calibrated robot's positions due to the causes, rms over the workspace, mm: their own effect and
    /// what the parameters have absorbed of them. 0 if none was found.
    #[serde(rename = "causes_position_error_mm")]
    pub position_error: f64,
    /// The same of relative positions.
    #[serde(skip)]
    pub relative_error: f64,
}

/// Tests every hypothesis; `poses` cover the workspace, and a drift is reported along the axes of `convention`.
pub(super) fn causes(
    solution: &Solution,
    readings: &Readings,
    convention: &Convention,
    poses: &[Sample<f64>],
) -> Causes {
    let subject = Subject::new(solution, readings);
    let noise = solution.noise.iter();
    let least = noise.map(|own| own.sigma).fold(f64::INFINITY, f64::min);
    let hypotheses = Effect::all(solution.robot.drive());
    let search = Search {
        drive: solution.robot.drive(),
        convention,
        regression: subject.regression(&hypotheses),
        stated: solution.estimated_freedom().is_none(),
        level: FALSE_ALARM / hypotheses.len() as f64,
        hypotheses,
    };
    let not_tested = match search.regression.solve(&[]) {
        None => Some("the poses do not determine the parameters well enough"),
        Some(without) if without.freedom < LEAST_FREEDOM => {
            Some("too few samples are left over to tell causes from noise")
        }
        Some(_) => None,
    };
    if not_tested.is_some() {
        return Causes {
            not_tested,
            ..Causes::default()
        };
    }
    let chosen = search.chosen();
    let fit = search.solve(&chosen).filter(|_| !chosen.is_empty());
    let fit = fit.filter(|fit| search.effect(&chosen, fit) > NEGLIGIBLE / least);
    let Some(fit) = fit else {
        return Causes {
            hidden_drift: search.hidden_drift(),
            ..Causes::default()
        };
    };
    let found = search.found(&chosen, &fit);
    let drifts = found.iter().any(|own| own.kind == EffectKind::Drift);
    let [position_error, relative_error] = subject.discrepancy(&found, &fit.coefficients, poses);
    Causes {
        not_tested,
        hidden_drift: search.hidden_drift().filter(|_| !drifts),
        position_error,
        relative_error,
        found,
    }
}

/// Tests columns beside those of the hypotheses, each group by itself with all parameters refitted: returns the
/// decrease of the sum of squares and the coefficients; `None` for a group that the parameters absorb. `moves`:
/// displacement of a position of the row with this index per unit of each column, mm.
pub(super) fn explained_by(
    solution: &Solution,
    readings: &Readings,
    groups: &[Vec<usize>],
    moves: impl Fn(usize, &At) -> Vec<Vector3<f64>>,
) -> Vec<Option<(f64, Vec<f64>)>> {
    let columns = groups.iter().map(Vec::len).sum();
    let regression = Subject::new(solution, readings).with_columns(columns, moves);
    let without = regression.solve(&[]);
    let each = groups.iter().map(|group| {
        let with = regression.solve(group)?;
        let gain = with.gain(without.as_ref()?);
        Some((gain, with.of_candidates(group.len()).to_vec()))
    });
    each.collect()
}

/// The probability that some hypothesis is accepted for a file without any cause.
const FALSE_ALARM: f64 = 0.003;
/// Least degrees of freedom for an estimate of the residuals' variance.
const LEAST_FREEDOM: f64 = 5.0;
/// Penalty per column when hypotheses are ranked: near the limit, this much per column changes the probability by the
/// same factor.
const PER_COLUMN: f64 = 3.0;
/// Fraction of a gain that must come from the residuals. A gain that only brings the parameters nearer to nominal is no
/// cause: a wrong scale, too, explains a wrong length in the robot file.
const IN_RESIDUALS: f64 = 0.5;
/// Twice the logarithm of 20: a smaller difference between explanations is not clear.
const CLEARLY: f64 = 6.0;

struct Search<'a> {
    drive: Drive,
    convention: &'a Convention,
    regression: Regression,
    hypotheses: Vec<Effect>,
    stated: bool,
    level: f64,
}

impl Search<'_> {
    /// The significant hypotheses: added one by one, then, weakest first, removed if not significant beside the others.
    fn chosen(&self) -> Vec<usize> {
        let mut chosen = Vec::new();
        while let Some(next) = self.next(&chosen) {
            chosen.push(next);
        }
        while let Some(fit) = self.solve(&chosen) {
            let weakest = (0..chosen.len())
                .map(|place| (place, self.beside_others(&chosen, place, &fit)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            match weakest {
                Some((place, probability)) if probability >= self.level => {
                    chosen.remove(place);
                }
                _ => break,
            }
        }
        chosen
    }

    /// Three σ of a drift if the unknowns absorb most of it.
    fn hidden_drift(&self) -> Option<f64> {
        let mut hypotheses = self.hypotheses.iter();
        let drift = hypotheses.position(|own| own.kind == EffectKind::Drift)?;
        let drift = self.columns(&[drift]);
        let fit = self.regression.solve(&drift)?;
        let first = fit.coefficients.len() - drift.len();
        let (mut inflation, mut variance) = (0.0, 0.0);
        for (index, column) in drift.iter().enumerate() {
            let own = fit.covariance[(first + index, first + index)];
            inflation += own * self.regression.effect(&[*column], &[1.0]) / 3.0;
            variance += own;
        }
        let sigma = (variance * fit.variance().max(1.0)).sqrt();
        (inflation > TAKEN_UP).then_some(3.0 * sigma)
    }

    fn columns(&self, chosen: &[usize]) -> Vec<usize> {
        let chosen = chosen.iter();
        chosen
            .flat_map(|index| {
                let before = self.hypotheses[..*index].iter().map(Effect::unknowns);
                let first: usize = before.sum();
                first..first + self.hypotheses[*index].unknowns()
            })
            .collect()
    }

    /// `None` if too few degrees of freedom remain.
    fn solve(&self, chosen: &[usize]) -> Option<Fit> {
        let fit = self.regression.solve(&self.columns(chosen))?;
        (fit.freedom >= LEAST_FREEDOM).then_some(fit)
    }

    /// The fit with one more hypothesis, and its gain.
    fn beside(&self, chosen: &[usize], without: &Fit, next: usize) -> Option<(Fit, f64)> {
        let all: Vec<_> = chosen.iter().copied().chain([next]).collect();
        let with = self.regression.solve(&self.columns(&all))?;
        let gain = with.gain(without);
        Some((with, gain))
    }

    /// A gain in units of this variance, less the penalty for the hypothesis's columns.
    fn rank(&self, hypothesis: usize, gain: f64, variance: f64) -> f64 {
        gain / self.unit(variance) - PER_COLUMN * self.hypotheses[hypothesis].unknowns() as f64
    }

    /// The significant hypothesis that explains most beside the chosen ones. A rare one must explain clearly more than
    /// the others.
    fn next(&self, chosen: &[usize]) -> Option<usize> {
        let without = self.solve(chosen)?;
        let others = (0..self.hypotheses.len()).filter(|index| !chosen.contains(index));
        let ranked = others.filter_map(|index| {
            let (with, gain) = self.beside(chosen, &without, index)?;
            let is_cause = with.freedom >= LEAST_FREEDOM
                && without.squares - with.squares >= IN_RESIDUALS * gain
                && self.probability(gain, index, &with) < self.level;
            let rare = self.hypotheses[index].kind.is_rare();
            let rank = self.rank(index, gain, without.variance());
            is_cause.then_some((index, if rare { rank - CLEARLY } else { rank }))
        });
        ranked
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }

    /// Hypotheses that explain about as much in place of one of the chosen.
    fn alternatives(&self, chosen: &[usize], place: usize, fit: &Fit) -> Vec<&Effect> {
        let mut others = chosen.to_vec();
        let own = others.remove(place);
        let Some(without) = self.regression.solve(&self.columns(&others)) else {
            return Vec::new();
        };
        let rank = |index| {
            let (_, gain) = self.beside(&others, &without, index)?;
            Some(self.rank(index, gain, fit.variance()))
        };
        let best = rank(own).unwrap_or(f64::INFINITY);
        let least = |kind| match kind {
            // A detectable scale is large, and its gain here is that of the first step only.
            EffectKind::Scale => (best - 2.0 * CLEARLY).max(0.5 * best),
            _ => best - CLEARLY,
        };
        let all = self.hypotheses.iter().enumerate();
        all.filter(|(index, own)| {
            !chosen.contains(index) && rank(*index).is_some_and(|rank| rank > least(own.kind))
        })
        .map(|(_, own)| own)
        .collect()
    }

    /// The probability of such a gain by chance: against the stated noise (χ²), or against the residuals left by the
    /// hypothesis if they are larger, because an understated noise is no cause. Without a stated noise: F test.
    fn probability(&self, gain: f64, index: usize, with: &Fit) -> f64 {
        let columns = self.hypotheses[index].unknowns() as f64;
        if self.stated {
            let gain = gain / self.unit(with.variance());
            ChiSquared::new(columns).map_or(1.0, |chi_square| chi_square.sf(gain))
        } else {
            let ratio = gain / columns / with.variance();
            // Not a number where no degree of freedom remains.
            if !(ratio >= 0.0) {
                return 1.0;
            }
            FisherSnedecor::new(columns, with.freedom).map_or(1.0, |f| f.sf(ratio))
        }
    }

    /// The unit for gains, given the variance of the remaining residuals.
    fn unit(&self, variance: f64) -> f64 {
        if self.stated {
            variance.max(1.0)
        } else {
            variance
        }
    }

    /// The probability that one of the chosen gains as much beside the others by chance.
    fn beside_others(&self, chosen: &[usize], place: usize, fit: &Fit) -> f64 {
        let mut others = chosen.to_vec();
        let own = others.remove(place);
        let without = self.regression.solve(&self.columns(&others));
        let gain = without.map_or(0.0, |without| fit.gain(&without));
        self.probability(gain, own, fit)
    }

    /// Root mean square of the chosen hypotheses' effect, in σ.
    fn effect(&self, chosen: &[usize], fit: &Fit) -> f64 {
        let columns = self.columns(chosen);
        let coefficients = fit.of_candidates(columns.len());
        let squares = self.regression.effect(&columns, coefficients);
        (squares / self.regression.worth).sqrt()
    }

    fn found(&self, chosen: &[usize], fit: &Fit) -> Vec<Cause> {
        let drive = self.drive;
        let mut next = fit.coefficients.len() - self.columns(chosen).len();
        let variance = self.unit(fit.variance());
        let found = chosen.iter().enumerate().map(|(place, index)| {
            let hypothesis = &self.hypotheses[*index];
            let kind = hypothesis.kind;
            let count = hypothesis.unknowns();
            let coefficients = fit.coefficients.rows(next, count).into_owned();
            let covariance = fit.covariance.view((next, next), (count, count)) * variance;
            next += count;
            let length = coefficients.norm();
            let along = &coefficients / length;
            let sigma = (along.transpose() * covariance * &along)[(0, 0)].sqrt();
            let by = coefficients.as_slice();
            let (size, sigma, mut text) = hypothesis.described(by, sigma, drive, self.convention);
            let others = self.alternatives(chosen, place, fit);
            let alternatives: Vec<_> = others.iter().map(|own| own.named()).collect();
            if !alternatives.is_empty() {
                text.push_str("; about as likely: ");
                text.push_str(&alternatives.join(" or "));
            }
            let others: Vec<_> = others.iter().map(|own| own.kind).collect();
            Cause {
                kind,
                arm: hypothesis.arm.map(|arm| arm.index() + 1),
                size,
                unit: kind.unit(drive),
                sigma,
                p: self.beside_others(chosen, place, fit),
                alternatives,
                text,
                remedy: kind.remedy(&others),
                effect: *hypothesis,
                coefficients: coefficients.as_slice().to_vec(),
            }
        });
        found.collect()
    }
}

/// An error outside the model that the residuals reveal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cause {
    /// Its kind.
    pub kind: EffectKind,
    /// 1, 2 or 3; `null` for a cause that does not belong to an arm.
    pub arm: Option<usize>,
    /// Its size: the amplitude of a periodic error, half of a backlash, the sag at the largest distance from the
    /// robot's axis, the drift from the first row to the last. Signed if there is only one coefficient.
    pub size: f64,
    /// `ratio`, `deg` or `mm`.
    pub unit: &'static str,
    /// One σ of the size.
    pub sigma: f64,
    /// The probability that chance shows as much in this test alone, given the other causes found.
    pub p: f64,
    /// Alternatives that explain the residuals about as well: with at least a twentieth of the likelihood.
    pub alternatives: Vec<String>,
    /// The cause in one sentence.
    pub text: String,
    /// The remedy.
    pub remedy: &'static str,
    #[serde(skip)]
    pub(super) effect: Effect,
    /// Coefficients of its columns: per radian, 1 or mm.
    #[serde(skip)]
    pub(super) coefficients: Vec<f64>,
}
