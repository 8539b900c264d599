//! What the residuals of a fit show that the model does not hold: directed tests.
//!
//! ```text
//! residuals of a row   Lₖ⁻¹ (mₖ − h(FK(P; qₖ), u)) = Lₖ⁻¹ (J δ(P, u) + C a) + noise
//! ```
//!
//! P are the parameters and u the instruments' unknowns, with the rows of what is known of them. Each hypothesis has its columns C. Its gain is by how much the sum of squares
//! falls with it, all parameters being fitted again; so the robot need not be the optimum of this sum.

mod cause;
mod regression;
mod subject;

pub use cause::{Alternative, Cause, CauseKind};
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Sample};
use nalgebra::{DVector, Vector3};
use regression::{Regression, Solution};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};
pub(crate) use subject::{At, Subject};

/// A cause that moves the positions by less, mm rms, is one of the arithmetic.
const NEGLIGIBLE: f64 = 1e-6;

/// A drift is hidden if the unknowns make its variance so many times larger.
const TAKEN_UP: f64 = 4.0;

/// What was looked for in the residuals, and what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Causes {
    /// The causes found, the one that explains most first.
    pub found: Vec<Cause>,
    /// Why nothing was looked for, if that is so.
    pub not_tested: Option<&'static str>,
    /// A drift of the positions from the first row to the last up to which the rows' order hides it, mm: three σ. `None`
    /// where the order tells drift from geometry.
    pub hidden_drift: Option<f64>,
    /// By how much the causes put the calibrated robot's positions off, rms over the workspace, mm: by
    /// themselves and by what the parameters have taken up of them. 0 if none was found.
    pub position_error: f64,
}

/// Tests every hypothesis; `poses` are all over the workspace.
pub(crate) fn causes(subject: &Subject<'_>, poses: &[Sample<f64>]) -> Causes {
    let counted = subject.counted();
    let mut causes = Causes {
        found: Vec::new(),
        not_tested: None,
        hidden_drift: None,
        position_error: 0.0,
    };
    let solution = subject.solution;
    let least = solution
        .noise
        .iter()
        .map(|own| own.sigma)
        .fold(f64::INFINITY, f64::min);
    let stated = solution.estimated_freedom().is_none();
    let ranges = subject.ranges();
    let joints = (solution.robot.drive(), &ranges);
    let regression = subject.regression(&counted);
    match select(&regression, joints, stated, NEGLIGIBLE / least) {
        Err(why) => causes.not_tested = Some(why),
        Ok(None) => {}
        Ok(Some(selection)) => {
            causes.position_error =
                subject.discrepancy(&selection.found, &selection.coefficients, poses);
            causes.found = selection.found;
        }
    }
    if causes.not_tested.is_none() && causes.found.iter().all(|own| own.kind != CauseKind::Drift) {
        causes.hidden_drift = hidden_drift(&regression, solution.robot.drive());
    }
    causes
}

/// Three σ of a drift, if the unknowns take up most of it.
fn hidden_drift(regression: &Regression, drive: Drive) -> Option<f64> {
    let hypotheses = all(drive);
    let drift = hypotheses.iter().find(|own| own.kind == CauseKind::Drift)?;
    let solution = regression.solve(&drift.columns)?;
    let first = solution.coefficients.len() - drift.columns.len();
    let (mut inflation, mut variance) = (0.0, 0.0);
    for (index, column) in drift.columns.iter().enumerate() {
        let own = solution.covariance[(first + index, first + index)];
        inflation += own * regression.length_squared(*column) / 3.0;
        variance += own;
    }
    let sigma = (variance * solution.variance().max(1.0)).sqrt();
    (inflation > TAKEN_UP).then_some(3.0 * sigma)
}

/// What residuals say of columns that no hypothesis has, each group by itself with all parameters fitted again: by how much
/// it lowers the sum of squares, and its coefficients; `None` of a group that the parameters take up. `moves`: by how much
/// a position of the row with this index moves for one unit of each column, mm.
pub(crate) fn explained_by(
    subject: &Subject<'_>,
    groups: &[Vec<usize>],
    moves: impl Fn(usize, &At) -> Vec<Vector3<f64>>,
) -> Vec<Option<(f64, Vec<f64>)>> {
    let counted = subject.counted();
    let columns = groups.iter().map(Vec::len).sum();
    let regression = subject.with_columns(&counted, columns, f64::INFINITY, |row, at| {
        moves(row.sensitivity.row, at)
    });
    let unknowns = subject.solution.covariance.nrows();
    let gains = regression.gains(&[], groups);
    let each = groups.iter().zip(gains).map(|(group, gain)| {
        let coefficients = regression.solve(group)?.coefficients;
        Some((gain?, coefficients.as_slice()[unknowns..].to_vec()))
    });
    each.collect()
}

/// Columns of all hypotheses together.
pub(super) fn columns(drive: Drive) -> usize {
    all(drive).iter().map(|own| own.columns.len()).sum()
}

/// One hypothesis: a cause, and its columns among all.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    pub(super) kind: CauseKind,
    /// `None` of a cause that is not one arm's.
    pub(super) arm: Option<ArmIndex>,
    pub(super) columns: Vec<usize>,
}

/// All of them, in the order of their columns.
pub(super) fn all(drive: Drive) -> Vec<Hypothesis> {
    let of_arms = CauseKind::of_joints(drive)
        .iter()
        .flat_map(|kind| ArmIndex::ALL.map(|arm| (*kind, Some(arm))));
    let of_platform = CauseKind::OF_PLATFORM.map(|kind| (kind, None));
    let mut next = 0;
    of_arms
        .chain(of_platform)
        .map(|(kind, arm)| {
            let first = next;
            next += kind.columns();
            Hypothesis {
                kind,
                arm,
                columns: (first..next).collect(),
            }
        })
        .collect()
}

/// What a sample's row says of the file as a whole.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// −1 or 1 for each joint: the direction of its last move; 0 before its first.
    pub(super) directions: [f64; 3],
    /// From −½ in the first row to ½ in the last.
    pub(super) part: f64,
    /// The square of the distance from the robot's axis, 1 at the largest of the file.
    pub(super) radius_squared: f64,
    /// 1 of a row whose readings are in the scale of the instrument, 0 of a touch of a plane.
    pub(super) scaled: f64,
}

/// By how much a position moves for one unit of each column: mm per radian, 1, or mm.
pub(super) fn movements(
    drive: Drive,
    at: &At,
    ranges: &[[f64; 2]; 3],
    place: &Place,
) -> Vec<Vector3<f64>> {
    let mut movements = Vec::new();
    for kind in CauseKind::of_joints(drive) {
        for (arm, q) in at.joints.iter().enumerate() {
            let (shapes, count) = kind.shapes(*q, place.directions[arm], ranges[arm]);
            for shape in &shapes[..count] {
                movements.push(at.by_joints.column(arm) * *shape);
            }
        }
    }
    movements.push(Vector3::new(0.0, 0.0, -place.radius_squared));
    movements.extend([0, 1, 2].map(|axis| Vector3::ith(axis, place.part)));
    movements.push(at.position * place.scaled);
    movements
}

/// The probability that some hypothesis of a file without any cause is taken for one.
const FALSE_ALARM: f64 = 0.003;
/// Fewer degrees of freedom than these do not tell the residuals' variance.
const LEAST_FREEDOM: f64 = 5.0;
/// What a hypothesis must gain for each of its columns to be ranked before another: near the limit as
/// many as change the probability by the same factor.
const PER_COLUMN: f64 = 3.0;
/// The part of a gain that must be one of the residuals. What brings the parameters nearer to nominal alone is no cause: a
/// wrong length of the robot file is explained by a wrong scale as well.
const IN_RESIDUALS: f64 = 0.5;
/// Twice the logarithm of 20: what explains less than that more is not clearly better.
const CLEARLY: f64 = 6.0;

/// What was selected.
struct Selection {
    pub(super) found: Vec<Cause>,
    /// Of the columns that always take part, with the causes beside them.
    pub(super) coefficients: DVector<f64>,
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
fn select(
    regression: &Regression,
    (drive, ranges): (Drive, &[[f64; 2]; 3]),
    stated: bool,
    negligible: f64,
) -> Result<Option<Selection>, &'static str> {
    let hypotheses = all(drive);
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
        .map(|solution| search.selection(&chosen, &solution)))
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
        let without = self.solve(chosen)?;
        let ranks = self.ranks(chosen, &without);
        let ranked = ranks.iter().enumerate().filter_map(|(index, rank)| {
            let mut with = chosen.to_vec();
            with.push(index);
            let gain = self.gain(chosen, index);
            let with = self.solve(&with)?;
            let probability = self.probability(gain, index, &with);
            if without.squares - with.squares < IN_RESIDUALS * gain {
                return None;
            }
            let rare = self.hypotheses[index].kind.is_rare();
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
        let best = ranks[own].unwrap_or(f64::INFINITY);
        let least = |kind| match kind {
            // A scale that shows is large, and its gain here is that of the first step towards it.
            CauseKind::Scale => (best - 2.0 * CLEARLY).max(0.5 * best),
            _ => best - CLEARLY,
        };
        let as_good =
            ranks
                .iter()
                .zip(&self.hypotheses)
                .enumerate()
                .filter(|(index, (rank, hypothesis))| {
                    !chosen.contains(index)
                        && rank.is_some_and(|rank| rank > least(hypothesis.kind))
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

    fn selection(&self, chosen: &[usize], solution: &Solution) -> Selection {
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
            coefficients: solution.coefficients.clone(),
        }
    }
}

fn number(hypothesis: &Hypothesis) -> f64 {
    hypothesis.columns.iter().fold(0.0, |count, _| count + 1.0)
}
