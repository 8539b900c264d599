//! The robust fit: an M-estimate for rows of which some may be wrong, by iteratively reweighted least squares.
//!
//! ```text
//! minimise  Σ ρ(dₖ/s),   dₖ = |residuals of the row, in σ|,   s = median (d/m) · √(n/(n − 1.5 p))
//! ```
//!
//! Each row has one weight: it is right or wrong as a whole. m is the median length of as many normal residuals as the
//! row has readings. s is never below 1: with few rows the median may be far too small by chance, and would shrink
//! further with every good row rejected. Each round weights every row with ψ(d/s)/(d/s), fits, and recomputes the
//! residuals (Holland and Welsch 1977). The first residuals come from a least-trimmed-squares fit: Tukey's loss has
//! many minima, and the wrong rows must not choose among them (Yohai's MM-estimate, 1987).

use super::solution::{PARAMETERS, Unsolved};
use crate::order;
use delta_cal::Settings;
use delta_cal::calibration::limits::SUSPECTED;
use delta_cal::calibration::{TolerancePrior, Unknowns};
use delta_cal::observations::{ObservationOutcome, ObservationProblem, ObservationRow};
use statrs::statistics::{Data, OrderStatistics};

/// Least number of rows; half of the rows must determine the robot.
const LEAST_ROWS: usize = 16;
/// With a larger fraction of suspected rows, it is unknown which rows are wrong.
const LARGEST_SUSPECTED: f64 = 0.4;
/// Most rounds of reweighting; after half of them the scale and the rejected rows stay. Most fits take 25 to 30.
const ROUNDS: u16 = 80;
/// The first round's scale is widened by `WIDENED`, and the factor shrinks by `NARROWED` per round down to 1, because
/// the least-trimmed-squares fit follows its own rows too closely (graduated non-convexity, Blake and Zisserman 1987).
/// Wider scales readmit wrong rows, which the parameters then follow, as there are hardly more rows than parameters.
/// With 45 rows, eight of them wrong, 20 had 46 % of the robots refused, 2.5 had 8 %.
const WIDENED: f64 = 2.5;
const NARROWED: f64 = 0.7;
/// With a known tolerance, this many rows plus the instruments' unknowns lead to a fit near the robot.
const SUBSET_WITH_TOLERANCE: usize = 8;
/// With a known tolerance, the number of parameters that measurements decide: about twelve with heights of a plate,
/// sixteen with distances.
const DECIDED_WITH_TOLERANCE: usize = 14;

/// ψ(r)/r of Tukey's biweight (Beaton and Tukey 1974), r in units of the residuals' scale: the weight of a residual, 1
/// if small; 0 from c on, and for NaN. c = 4.685 gives 95 % of the squared loss's efficiency for normal residuals
/// (Holland and Welsch 1977).
fn weight_of(r: f64) -> f64 {
    if r.abs() < SUSPECTED {
        (1.0 - (r / SUSPECTED).powi(2)).powi(2)
    } else {
        0.0
    }
}

/// ψ′(r): the derivative of the residual's influence.
fn slope_of(r: f64) -> f64 {
    if r.abs() < SUSPECTED {
        let part = (r / SUSPECTED).powi(2);
        (1.0 - part) * (1.0 - 5.0 * part)
    } else {
        0.0
    }
}

/// Of rows with this many readings, and by how much the loss is widened for the length of a vector of residuals, so that
/// it keeps 95 % of the squared loss's efficiency.
const STRETCH: [f64; 6] = [1.0, 1.0, 1.093_487, 1.171_878, 1.240_195, 1.301_231];
/// Median length of a vector of normal residuals with σ = 1: √ of the median of χ².
const MEDIAN_LENGTH: [f64; 6] = [
    0.674_490, 0.674_490, 1.177_410, 1.538_172, 1.832_128, 2.086_015,
];

/// κ, by which the weights in a sum of squares are divided, and n mean ψ′/κ, the effective number of rows; from lengths of
/// residuals in scales, with the number of readings and the loss's widening of each.
///
/// ```text
/// κ = mean ψ² · mean w / (mean ψ r · mean ψ′)
/// ```
///
/// The covariance of an M-estimate is mean ψ² / (mean ψ′)² · (JᵀJ)⁻¹ (Huber 1981, section 7.6). For normal residuals
/// mean ψ r = σ² mean ψ′ (Stein 1981), so with the weights w/κ the inverse of the weighted JᵀJ, times σ², is that
/// covariance. κ itself does not depend on σ: it is 1 if all rows have the same weight, and 0.96 for normal residuals.
fn normalization(residuals: impl Iterator<Item = (f64, f64, f64)>) -> (f64, f64) {
    let (mut count, mut weights, mut slopes) = (0.0, 0.0, 0.0);
    let (mut influences, mut moments) = (0.0, 0.0);
    for (size, readings, stretch) in residuals {
        let weight = weight_of(size / stretch);
        if weight > 0.0 {
            count += 1.0;
            weights += weight;
            influences += (weight * size).powi(2) / readings;
            moments += weight * size.powi(2) / readings;
            slopes += ((readings - 1.0) * weight + slope_of(size / stretch)) / readings;
        }
    }
    let divisor = influences * weights / (moments * slopes);
    // Rows that fit exactly give no information about κ.
    let usable = divisor > 0.5 && divisor.is_finite();
    let divisor = if usable { divisor } else { 1.0 };
    let effective = slopes / divisor;
    (divisor, if effective > 1.0 { effective } else { count })
}

/// A robust fit and its treatment of every row.
pub(super) struct RobustFit<const N: usize> {
    pub(super) outcome: ObservationOutcome<f64, N>,
    pub(super) weights: Vec<f64>,
    pub(super) suspected: Vec<bool>,
    /// What the rows are worth, in parts of the sum of their weights.
    pub(super) worth: f64,
}

/// Calibrates a robot from rows, of which some may be wrong if it is to be `robust`.
pub(super) fn fit<const N: usize>(
    problem: &ObservationProblem<'_, f64, N>,
    settings: &Settings<f64>,
    robust: bool,
) -> Result<RobustFit<N>, Unsolved>
where
    f64: Unknowns<N>,
{
    if !robust {
        return Ok(RobustFit {
            outcome: problem.solve_watched(settings, crate::halt::check)?,
            weights: Vec::new(),
            suspected: Vec::new(),
            worth: 1.0,
        });
    }
    let states: Vec<_> = problem.rows().iter().map(State::of).collect();
    let counted = states.iter().filter(|own| own.readings > 0).count();
    if counted < LEAST_ROWS {
        return Err(Unsolved::TooFewForRobust(counted, LEAST_ROWS));
    }
    let all: usize = states.iter().map(|own| own.readings).sum();
    // The tolerance of the transmissions is information enough about them.
    let places = problem.instruments().of_places();
    let rows_for = |unknowns: usize| (unknowns * counted).div_ceil(all.max(1));
    let (subset, parameters) = if settings.tolerance.is_some() {
        (
            SUBSET_WITH_TOLERANCE + rows_for(places),
            rows_for(DECIDED_WITH_TOLERANCE + places),
        )
    } else {
        let all = rows_for(PARAMETERS + places);
        (all + 1, all)
    };
    // The noise of observations is always stated.
    let settings = settings.with_noise(*problem.instruments().noise.position());
    let mut search = Search::<N> {
        problem,
        rows: problem.rows().to_vec(),
        settings,
        prior: problem.prior(&settings),
        states,
        parameters,
        best: None,
    };
    let effective = search.reweighted(subset);
    let suspected: Vec<_> = search.states.iter().map(|own| own.suspected).collect();
    let number = suspected.iter().filter(|own| **own).count();
    if number as f64 > LARGEST_SUSPECTED * counted as f64 {
        return Err(Unsolved::TooManySuspected(number, counted));
    }
    let weighed = problem.weighed(&search.rows, effective);
    let weights: Vec<_> = search.rows.iter().map(ObservationRow::weight).collect();
    let counted = search.states.iter().zip(&weights);
    let counted = counted.filter(|(own, _)| own.readings > 0);
    Ok(RobustFit {
        outcome: weighed.solve_watched(&settings, crate::halt::check)?,
        worth: effective / counted.map(|(_, weight)| weight).sum::<f64>(),
        weights,
        suspected,
    })
}

#[derive(Debug, Clone, Copy)]
struct State {
    /// ψ(d)/d.
    weight: f64,
    /// d, in σ.
    distance: f64,
    /// Number of readings; rows without any are skipped.
    readings: usize,
    suspected: bool,
}

impl State {
    fn of(row: &ObservationRow<f64>) -> Self {
        Self {
            weight: 1.0,
            distance: 0.0,
            readings: if row.is_left_out() {
                0
            } else {
                row.observation().readings()
            },
            suspected: false,
        }
    }
}

/// A search for the right rows and the unknowns that fit them.
struct Search<'a, const N: usize> {
    /// The problem with all rows weighted alike.
    problem: &'a ObservationProblem<'a, f64, N>,
    /// The rows with their present weights.
    rows: Vec<ObservationRow<f64>>,
    settings: Settings<f64>,
    prior: TolerancePrior<f64, N>,
    states: Vec<State>,
    /// Number of rows that the parameters use up.
    parameters: usize,
    /// The least sum of a start so far, and its correction of all parameters, in internal units.
    best: Option<(f64, [f64; N])>,
}

/// The rows that take part in the start, by index, and how many of them it keeps.
struct Starting {
    rows: Vec<usize>,
    kept: usize,
}

/// Number of random subsets. With 30 % wrong rows, 4 % of subsets of nine contain none; with 40 %, 1 %.
const SUBSETS: usize = 150;
/// Number of rows at which a change is assumed to begin.
const PLACES: usize = 24;
/// Concentration ends when a step leaves more than this fraction of the sum.
const PROGRESS: f64 = 0.999;
/// A fit with more than this many times the least sum so far is dropped: concentration gains less for good rows.
const HOPELESS: f64 = 100.0;
/// Concentration steps for each fit, and for the best.
const FIRST_STEPS: usize = 1;
const LAST_STEPS: usize = 10;
/// With more rows than this, the start uses an even selection of them.
const MOST: usize = 150;
/// Most linearisations per fit at the start.
const ITERATIONS: u16 = 15;
/// The search ends when the sum over the kept rows is below this fraction of its expectation for as many rows. The
/// smallest half of good rows has a third of it.
const GOOD: f64 = 0.75;

impl<const N: usize> Search<'_, N>
where
    f64: Unknowns<N>,
{
    /// Fits the rows with their present weights; `None` if it does not converge. Only the last fit is judged.
    fn fit(&self, most: u16, effective: f64) -> Option<[f64; N]> {
        let settings = self.settings.with_iteration_limit(most);
        let problem = self.problem.weighed(&self.rows, effective);
        problem.end(&settings)
    }

    /// Computes every row's distance at a correction; infinite where the robot does not reach it.
    fn measure(&mut self, correction: &[f64; N]) {
        let sums = self.problem.sums_of_squares_at(correction);
        for (own, sum) in self.states.iter_mut().zip(sums) {
            let distance = sum.sqrt();
            own.distance = if distance.is_nan() {
                f64::INFINITY
            } else {
                distance
            };
        }
    }

    fn counted(&self) -> impl Iterator<Item = &State> {
        self.states.iter().filter(|own| own.readings > 0)
    }

    /// The scale of the distances: their median over that of normal residuals. The fit to the parameters makes distances
    /// too small, and so does the start's choice of the smallest half: uncorrected, one good row in two hundred would be
    /// suspected when rows are few. The correction for both is 1.5 times the parameters.
    fn scale(&self) -> f64 {
        let typical = self.counted();
        let typical: Vec<_> = typical
            .map(|own| own.distance / MEDIAN_LENGTH[own.readings])
            .collect();
        let count = typical.len() as f64;
        let fitted = (count / (count - 1.5 * self.parameters as f64)).sqrt();
        f64::max(1.0, Data::new(typical).median() * fitted)
    }

    /// Weights every row by its distance; returns the largest change of a weight, and the effective number of rows. In
    /// late rounds suspected rows stay suspected, so that the iteration ends.
    fn weigh(&mut self, scale: f64, late: bool) -> (f64, f64) {
        let mut largest = 0.0_f64;
        for own in &mut self.states {
            let unit = scale * STRETCH[own.readings];
            own.suspected = (late && own.suspected) || !(own.distance < SUSPECTED * unit);
            let weight = if own.suspected {
                0.0
            } else {
                weight_of(own.distance / unit)
            };
            largest = largest.max((weight - own.weight).abs());
            own.weight = weight;
        }
        let weighed = self.counted().filter(|own| own.weight > 0.0);
        let (divisor, effective) = normalization(weighed.map(|own| {
            let stretch = STRETCH[own.readings];
            (own.distance / scale, own.readings as f64, stretch)
        }));
        for (row, own) in self.rows.iter_mut().zip(&self.states) {
            row.set_weight(own.weight / divisor);
        }
        (largest, effective)
    }

    /// Reweights the rows until their weights converge; returns the effective number of rows. `subset` rows determine the
    /// robot, starting from nominal parameters if the settings do.
    fn reweighted(&mut self, subset: usize) -> f64 {
        let mut effective = self.counted().count() as f64;
        let Some(correction) = self.least_trimmed(subset) else {
            return effective;
        };
        self.measure(&correction);
        let (mut scale, mut width) = (0.0, WIDENED);
        for round in 0..ROUNDS {
            let late = round >= ROUNDS / 2;
            if !late {
                scale = self.scale() * width;
            }
            let change;
            (change, effective) = self.weigh(scale, late);
            let settled = width <= 1.0 && change <= f64::EPSILON.sqrt();
            width = f64::max(1.0, width * NARROWED);
            let Some(correction) = self.fit(self.settings.iteration_limit, effective) else {
                break;
            };
            self.measure(&correction);
            if settled {
                break;
            }
        }
        effective
    }

    /// The start of the fit: the rows that agree best. `None` if no subset gives a fit.
    ///
    /// ```text
    /// minimise  Σ over the h smallest of  dₖ²
    /// ```
    ///
    /// Least trimmed squares (Rousseeuw 1984) by concentration steps (Rousseeuw and Van Driessen 2006): fit some rows,
    /// keep the h rows closest to that fit, fit those. No step raises the sum.
    ///
    /// Wrong rows may agree with each other, for example all rows after somebody moved the tracker. Then no step leads
    /// from a subset with some of them to the right fit. The random subsets are therefore as small as the problem
    /// allows, and numerous; and because such a change begins at some row, all rows before and after each of many rows
    /// are tried as well.
    fn least_trimmed(&mut self, subset: usize) -> Option<[f64; N]> {
        let stride = self.states.len() / MOST + 1;
        let starting = (0..self.states.len()).step_by(stride);
        let rows: Vec<_> = starting
            .filter(|row| self.states[*row].readings > 0)
            .collect();
        let count = rows.len();
        // The h with the highest breakdown point: (n + p + 1)/2.
        let kept = usize::midpoint(count, self.parameters + 1).min(count);
        let starting = Starting { rows, kept };
        self.concentrate(&starting, starting.rows.clone(), FIRST_STEPS);
        // The rows closest to the robot before calibration.
        self.measure(&[0.0; N]);
        self.concentrate(&starting, self.nearest(&starting).0, FIRST_STEPS);

        let places = PLACES.min(count);
        let boundaries = (1..places).map(|place| self.states.len() * place / places);
        let sides = boundaries.flat_map(|boundary| [(boundary, true), (boundary, false)]);
        let changes = sides.map(|(boundary, before)| {
            let rows = starting.rows.iter().copied();
            rows.filter(|row| (*row < boundary) == before).collect()
        });
        let changes: Vec<Vec<_>> = changes
            .filter(|rows: &Vec<_>| rows.len() >= subset)
            .collect();
        let mut random = Random(0x9e37_79b9);
        let subsets = (0..SUBSETS).map(|_| {
            let (mut wanted, mut left) = (subset.min(kept), count);
            let mut rows = starting.rows.clone();
            // Knuth's algorithm S: selects the wanted number, every choice equally likely.
            rows.retain(|_| {
                let chosen = random.below(left) < wanted;
                left -= 1;
                wanted -= usize::from(chosen);
                chosen
            });
            rows
        });
        for rows in changes.into_iter().chain(subsets) {
            if self.is_good(&starting) {
                break;
            }
            self.concentrate(&starting, rows, FIRST_STEPS);
        }
        let (_, correction) = self.best?;
        self.measure(&correction);
        self.concentrate(&starting, self.nearest(&starting).0, LAST_STEPS);
        self.best.map(|(_, correction)| correction)
    }

    /// Whether noise alone explains the kept rows.
    fn is_good(&self, starting: &Starting) -> bool {
        let rows = starting.rows.iter();
        let readings: f64 = rows.map(|row| self.states[*row].readings as f64).sum();
        let expected = GOOD * (readings / starting.rows.len() as f64) * starting.kept as f64;
        self.best.is_some_and(|(sum, _)| sum < expected)
    }

    /// Fits these rows, then those closest to that fit, and so on. The sum includes the prior: with hardly more rows than
    /// parameters, a robot far from its tolerance explains many wrong rows.
    fn concentrate(&mut self, starting: &Starting, mut chosen: Vec<usize>, steps: usize) {
        let mut last = f64::INFINITY;
        for _ in 0..=steps {
            for row in &mut self.rows {
                row.set_weight(0.0);
            }
            for row in &chosen {
                self.rows[*row].set_weight(1.0);
            }
            let most = self.settings.iteration_limit.min(ITERATIONS);
            let Some(correction) = self.fit(most, chosen.len() as f64) else {
                return;
            };
            self.measure(&correction);
            let sum;
            (chosen, sum) = self.nearest(starting);
            if !sum.is_finite() {
                return;
            }
            let sum = sum + self.prior.cost(&correction);
            let least = self.best.map_or(f64::INFINITY, |(least, _)| least);
            if sum < least {
                self.best = Some((sum, correction));
            }
            if sum > HOPELESS * least || !(sum < last * PROGRESS) {
                return;
            }
            last = sum;
        }
    }

    /// The closest rows, as many as are kept, and the sum of their squared distances.
    fn nearest(&self, starting: &Starting) -> (Vec<usize>, f64) {
        let distance = |row: &usize| self.states[*row].distance;
        let mut distances: Vec<_> = starting.rows.iter().map(distance).collect();
        order::sort(&mut distances);
        let farthest = distances.get(starting.kept.saturating_sub(1));
        let near = |row: &usize| farthest.is_some_and(|farthest| distance(row) <= *farthest);
        let rows: Vec<_> = starting.rows.iter().copied().filter(near).collect();
        let sum = rows.iter().map(|row| distance(row).powi(2)).sum();
        (rows, sum)
    }
}

/// Marsaglia's xorshift (2003): gives the same subsets on every platform.
struct Random(u32);

impl Random {
    /// A uniform number below `bound`; 0 for a bound of 0.
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        let scaled = (u64::from(self.0) * bound as u64) >> 32;
        usize::try_from(scaled).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::{MEDIAN_LENGTH, SUSPECTED, normalization, slope_of, weight_of};
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    /// ρ, implemented independently from the literature: Beaton and Tukey (1974).
    fn rho(r: f64) -> f64 {
        let c = 4.685;
        c * c / 6.0 * (1.0 - (1.0 - (r.abs() / c).min(1.0).powi(2)).powi(3))
    }

    #[test]
    fn weight_and_slope_are_those_of_rho() {
        for r in (-930..=930).map(|k| f64::from(k) / 100.0 + 0.0017) {
            let psi = (rho(r + 1e-5) - rho(r - 1e-5)) / 2e-5;
            assert!((weight_of(r) * r - psi).abs() < 1e-8, "{r}");
            let psi = |r: f64| weight_of(r) * r;
            let slope = (psi(r + 1e-6) - psi(r - 1e-6)) / 2e-6;
            assert!((slope_of(r) - slope).abs() < 1e-7, "{r}");
        }
        for r in [SUSPECTED, -SUSPECTED, f64::INFINITY, f64::NAN] {
            assert!(weight_of(r).abs() + slope_of(r).abs() < 1e-30);
        }
    }

    /// By hand, for two residual lengths that count, 0 and c/√2, and one that does not: w = 1, ¼, ψ′ = 1, −¾, κ = Σψ²
    /// Σw / (Σψr Σψ′). Vectors of three are twice as long for the same weight: for each size r the mean of ψ′ over the
    /// directions is (2 w + ψ′)/3, and that of ψ² and ψ r a third of the whole.
    #[test]
    fn the_normalization_is_that_by_hand() {
        let half = SUSPECTED / f64::sqrt(2.0);
        let of = |sizes: &[f64], readings, stretch| {
            normalization(sizes.iter().map(|size| (*size, readings, stretch)))
        };
        let (found, effective) = of(&[0.0, 0.0, 0.0, half, 7.0], 1.0, 1.0);
        let divisor = (half / 4.0).powi(2) * 3.25 / (half * half / 4.0 * 2.25);
        // A divisor below a half is not used.
        assert!(divisor < 0.5 && (found - 1.0).abs() < 1e-14);
        assert!((effective - 2.25).abs() < 1e-14);
        let (found, effective) = of(&[2.0, 2.0, 2.0, 2.0 * half], 3.0, 2.0);
        let (weight, slope) = (weight_of(1.0), slope_of(1.0));
        let influences = (12.0 * weight * weight + half * half / 4.0) / 3.0;
        let moments = (12.0 * weight + half * half) / 3.0;
        let slopes = 2.0 * weight + slope + (0.5 - 0.75) / 3.0;
        let divisor = influences * (3.0 * weight + 0.25) / (moments * slopes);
        assert!(divisor > 0.5 && (found - divisor).abs() < 1e-14);
        assert!((effective - slopes / divisor).abs() < 1e-14);
        // Worth less than one row, fitted exactly, none left: the number of rows is returned instead.
        for (sizes, expected) in [
            (&[2.0, 1.9, 7.0][..], 2.0),
            (&[0.0; 20], 20.0),
            (&[9.0, 10.0], 0.0),
        ] {
            assert!((of(sizes, 1.0, 1.0).1 - expected).abs() < 1e-14);
        }
    }

    /// The length has six decimals.
    #[test]
    fn half_of_the_residuals_are_shorter_than_the_median_length() {
        for (readings, length) in (1..).map(f64::from).zip(&MEDIAN_LENGTH[1..]) {
            let shorter = ChiSquared::new(readings).unwrap().cdf(length * length);
            assert!((shorter - 0.5).abs() < 1e-6, "{readings}: {shorter}");
        }
    }
}
