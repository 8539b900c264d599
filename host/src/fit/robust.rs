//! The robust fit: an M-estimate of rows of which some may be wrong, by iteratively reweighted least squares.
//!
//! ```text
//! minimise  Σ ρ(dₖ/s),   dₖ = |residuals of the row, in σ|,   s = median (d/m) · √(n/(n − 1.5 p))
//! ```
//!
//! One weight a row: it is right or wrong as a whole. m is the median length of as many normal residuals as the row has
//! readings, and s is never below 1: with few rows the median may be far too small by chance, and would then shrink with
//! every good row that it makes the fit leave out. A round weighs every row with ψ(d/s)/(d/s), fits, and takes the new
//! residuals (Holland and Welsch 1977). The first residuals are those of the least trimmed squares' fit: Tukey's loss has
//! many minima, and the wrong rows must not choose among them (Yohai's MM-estimate, 1987).

// Rows are counted: some thousands.
#![allow(clippy::cast_precision_loss)]

use super::observations::Unsolved;
use super::solution::PARAMETERS;
use delta_cal::Settings;
use delta_cal::calibration::limits::SUSPECTED;
use delta_cal::calibration::{Prior, Problem, Progress, TolerancePrior};
use delta_cal::observations::{ObservationOutcome, ObservationProblem, ObservationRow};

/// Half of the rows must determine the robot.
const LEAST_ROWS: usize = 16;
/// Beyond this part of suspected rows it is not known which are the wrong ones.
const LARGEST_SUSPECTED: f64 = 0.4;
/// Rounds of reweighting at most; after half of them the scale stays, and what is rejected. Most fits take 25 to 30.
const ROUNDS: u16 = 80;
/// The first round's scale is so many times as wide, and each round's so much smaller than the one before, down to what it
/// is: the least trimmed squares' fit knows its own rows too well (graduated non-convexity, Blake and Zisserman 1987).
/// Wider scales let wrong rows back in, which the robot's parameters then follow, for there are hardly more rows than
/// parameters. Of 45 rows, eight of them wrong, 20 had 46 % of the robots refused, 2.5 had 8 %.
const WIDENED: f64 = 2.5;
const NARROWED: f64 = 0.7;
/// Rows beside the unknowns of the instruments that lead near the robot, if its tolerance is known.
const SUBSET_WITH_TOLERANCE: usize = 8;
/// Parameters of the robot that measurements decide where the tolerance is known: heights of a plate some twelve, distances
/// some sixteen.
const DECIDED_WITH_TOLERANCE: usize = 14;

/// k of Huber's loss and c of Tukey's: of normal residuals either has 95 % of the efficiency of the squared loss (Holland
/// and Welsch 1977).
const HUBER: f64 = 1.345;
const TUKEY: f64 = SUSPECTED;

/// How a robust fit counts a residual, r in units of the residuals' scale. The squared loss, which counts all alike, is the
/// plain fit's. With either of these a row that is [`SUSPECTED`] scales off has no influence at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// Huber's (1964): squared up to k = 1.345, linear beyond, and nothing from [`SUSPECTED`] on (a "Huber-type skipped"
    /// estimate, Hampel 1985). Huber's loss alone would leave every wrong row the pull of one that is k off, all of them
    /// on the same side if the cause is the same.
    Huber,
    /// Tukey's biweight (Beaton and Tukey 1974): the influence falls off smoothly, to nothing at c = 4.685.
    Tukey,
}

/// How a robust fit's weights are to enter a sum of squares.
///
/// ```text
/// κ = mean ψ² · mean w / (mean ψ r · mean ψ′),   n mean ψ′ / κ
/// ```
///
/// The covariance of an M-estimate is mean ψ² / (mean ψ′)² · (JᵀJ)⁻¹ (Huber 1981, section 7.6). Of normal residuals
/// mean ψ r = σ² mean ψ′ (Stein 1981), so that with the weights w/κ the inverse of the weighted JᵀJ, times σ², is that
/// covariance. κ itself does not depend on σ: it is 1 if all rows count alike, and of normal residuals 0.96 for Tukey's
/// loss and 1.01 for Huber's.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Normalization {
    /// κ.
    divisor: f64,
    /// n mean ψ′/κ: the effective number of rows.
    effective: f64,
}

impl Loss {
    /// ψ(r)/r: what a residual counts, 1 for a small one; 0 from c on, and for NaN.
    fn weight(self, r: f64) -> f64 {
        let size = r.abs();
        match self {
            Self::Huber if size <= HUBER => 1.0,
            Self::Huber if size < SUSPECTED => HUBER / size,
            Self::Tukey if size < TUKEY => square(1.0 - square(size / TUKEY)),
            Self::Huber | Self::Tukey => 0.0,
        }
    }

    /// ψ′(r): how much the residual's influence grows with it.
    fn slope(self, r: f64) -> f64 {
        let size = r.abs();
        match self {
            Self::Huber if size <= HUBER => 1.0,
            Self::Tukey if size < TUKEY => {
                let part = square(size / TUKEY);
                (1.0 - part) * (1.0 - 5.0 * part)
            }
            Self::Huber | Self::Tukey => 0.0,
        }
    }

    /// By how much the loss is wider for the length of a vector of so many residuals than for one, so that it has 95 % of
    /// the squared loss's efficiency there as well.
    fn stretch(self, readings: u8) -> f64 {
        let wider = match self {
            Self::Huber => [1.0, 1.116_090, 1.210_396, 1.287_043, 1.347_226],
            Self::Tukey => [1.0, 1.093_487, 1.171_878, 1.240_195, 1.301_231],
        };
        wider[usize::from(readings).clamp(1, wider.len()) - 1]
    }

    /// Of lengths of residuals in scales, with the number of readings of each and by how much the loss is wider for them.
    fn normalization(self, residuals: impl Iterator<Item = (f64, f64, f64)>) -> Normalization {
        let (mut count, mut weights, mut slopes) = (0.0, 0.0, 0.0);
        let (mut influences, mut moments) = (0.0, 0.0);
        for (size, readings, stretch) in residuals {
            let weight = self.weight(size / stretch);
            if weight > 0.0 {
                count += 1.0;
                weights += weight;
                influences += square(weight * size) / readings;
                moments += weight * square(size) / readings;
                slopes += ((readings - 1.0) * weight + self.slope(size / stretch)) / readings;
            }
        }
        let divisor = influences * weights / (moments * slopes);
        // Rows that fit exactly say nothing of it.
        let divisor = if divisor > 0.5 && divisor.is_finite() {
            divisor
        } else {
            1.0
        };
        let effective = slopes / divisor;
        Normalization {
            divisor,
            effective: if effective > 1.0 { effective } else { count },
        }
    }
}

/// Why there is no robust fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobustRefusal {
    /// Half of the rows must determine the robot.
    TooFewSamples {
        /// How many there are.
        samples: usize,
        /// How many are needed.
        needed: usize,
    },
    /// So many rows disagree with the others that it is not known which are right.
    TooManySuspected {
        /// How many disagree.
        suspected: usize,
        /// How many there are.
        samples: usize,
    },
}

/// A robust fit, and what became of every row in it.
pub(super) struct RobustFit<const N: usize> {
    pub(super) outcome: ObservationOutcome<f64, N>,
    pub(super) weights: Vec<f64>,
    pub(super) suspected: Vec<bool>,
}

/// Calibrates a robot from the rows of a problem, of which some may be wrong. M = N + 1, E = M (M + 1)/2.
pub(super) fn fit<const N: usize, const M: usize, const E: usize>(
    problem: &ObservationProblem<'_, f64, N>,
    settings: &Settings<f64>,
    loss: Loss,
) -> Result<RobustFit<N>, Unsolved> {
    let readings = |row: &ObservationRow<f64>| {
        if row.is_left_out() {
            0
        } else {
            u8::try_from(row.observation().readings()).unwrap_or(0)
        }
    };
    let mut weighed: Vec<_> = problem
        .rows()
        .iter()
        .map(readings)
        .map(Weighed::new)
        .collect();
    let counted = weighed.iter().filter(|own| own.readings > 0).count();
    if counted < LEAST_ROWS {
        return Err(Unsolved::Robust(RobustRefusal::TooFewSamples {
            samples: counted,
            needed: LEAST_ROWS,
        }));
    }
    let all: usize = weighed.iter().map(|own| usize::from(own.readings)).sum();
    // The noise of observations is always stated.
    let settings = settings.with_noise(*problem.instruments().noise.position());
    let mut fits = Observed::<N, M, E> {
        problem,
        rows: problem.rows().to_vec(),
        settings,
        prior: problem.prior(&settings),
    };
    let used_up = UsedUp::of(problem, settings.tolerance.is_some(), (counted, all));
    let effective = reweighted(&mut fits, used_up, loss, &mut weighed);
    let suspected: Vec<_> = weighed.iter().map(|own| own.suspected).collect();
    let number = suspected.iter().filter(|own| **own).count();
    if number as f64 > LARGEST_SUSPECTED * counted as f64 {
        return Err(Unsolved::Robust(RobustRefusal::TooManySuspected {
            suspected: number,
            samples: counted,
        }));
    }
    let outcome = fits.weighed(&weighed, effective).solve::<M, E>(&settings)?;
    Ok(RobustFit {
        outcome,
        weights: fits.rows.iter().map(ObservationRow::weight).collect(),
        suspected,
    })
}

/// What a robust fit makes of a row.
#[derive(Debug, Clone, Copy)]
struct Weighed {
    /// ψ(d)/d.
    weight: f64,
    /// By what the row's squared residuals are multiplied.
    factor: f64,
    /// d, in σ.
    distance: f64,
    /// How many readings it has; one without any is passed over.
    readings: u8,
    suspected: bool,
    /// Whether the start looks at it.
    starting: bool,
}

impl Weighed {
    const fn new(readings: u8) -> Self {
        Self {
            weight: 1.0,
            factor: 1.0,
            distance: 0.0,
            readings,
            suspected: false,
            starting: true,
        }
    }
}

/// Rows with the readings that it takes to find the unknowns.
#[derive(Debug, Clone, Copy)]
struct UsedUp {
    /// That determine the robot, from its nominal parameters if the settings begin there.
    subset: usize,
    /// That the parameters use up.
    parameters: usize,
}

impl UsedUp {
    /// Of so many rows that count, and their readings.
    fn of<const N: usize>(
        problem: &ObservationProblem<'_, f64, N>,
        tolerance: bool,
        (rows, readings): (usize, usize),
    ) -> Self {
        // Of the transmissions the tolerance tells enough.
        let places = problem.instruments().of_places();
        let rows_for = |unknowns: usize| (unknowns * rows).div_ceil(readings.max(1));
        if tolerance {
            Self {
                subset: SUBSET_WITH_TOLERANCE + rows_for(places),
                parameters: rows_for(DECIDED_WITH_TOLERANCE + places),
            }
        } else {
            Self {
                subset: rows_for(PARAMETERS + places) + 1,
                parameters: rows_for(PARAMETERS + places),
            }
        }
    }
}

/// Fits of rows as they are weighed.
trait Fits {
    /// A correction of all parameters, in internal units.
    type Correction: Copy;

    /// The correction of the robot before calibration.
    const NOMINAL: Self::Correction;

    /// The fit; `None` if it does not settle. What is judged is the last fit alone.
    fn fit(&mut self, most: u16, weighed: &[Weighed], effective: f64) -> Option<Self::Correction>;

    /// Every row's distance at a correction; infinite where the robot does not reach it.
    fn measure(&self, correction: &Self::Correction, weighed: &mut [Weighed]);

    /// What a correction costs beside the rows: Σ ((p − p nominal)/σ)² of what is known beforehand. A robot far from its
    /// tolerance explains many wrong rows, where hardly more rows than parameters count.
    fn prior_cost(&self, correction: &Self::Correction) -> f64;

    /// Linearisations of a fit at most.
    fn iterations(&self) -> u16;
}

struct Observed<'a, const N: usize, const M: usize, const E: usize> {
    /// All rows of which count alike.
    problem: &'a ObservationProblem<'a, f64, N>,
    rows: Vec<ObservationRow<f64>>,
    settings: Settings<f64>,
    prior: TolerancePrior<f64, N>,
}

impl<const N: usize, const M: usize, const E: usize> Observed<'_, N, M, E> {
    fn weighed(&mut self, weighed: &[Weighed], effective: f64) -> ObservationProblem<'_, f64, N> {
        for (row, own) in self.rows.iter_mut().zip(weighed) {
            row.set_weight(own.factor);
        }
        self.problem.weighed(&self.rows, effective)
    }
}

impl<const N: usize, const M: usize, const E: usize> Fits for Observed<'_, N, M, E> {
    type Correction = [f64; N];

    const NOMINAL: [f64; N] = [0.0; N];

    fn fit(&mut self, most: u16, weighed: &[Weighed], effective: f64) -> Option<[f64; N]> {
        let settings = self.settings.with_iteration_limit(most);
        let problem = self.weighed(weighed, effective);
        let minimizer = problem.minimizer::<M, E>(&settings);
        let mut minimizer = minimizer.ok()?.for_its_end();
        while minimizer.step(&problem) == Progress::Working {}
        minimizer.end()
    }

    fn measure(&self, correction: &[f64; N], weighed: &mut [Weighed]) {
        let at = Problem::<f64, N, M, E>::displaced(self.problem, correction);
        for (index, own) in weighed.iter_mut().enumerate() {
            let row = Problem::<f64, N, M, E>::sum_of_squares(self.problem, &at, index);
            own.distance = row.sum_of_squares.sqrt();
        }
    }

    fn prior_cost(&self, correction: &[f64; N]) -> f64 {
        Prior::<f64, N, M, E>::cost(&self.prior, correction)
    }

    fn iterations(&self) -> u16 {
        self.settings.iteration_limit
    }
}

/// Weighs the rows until their weights settle; what they are then worth.
fn reweighted<F: Fits>(fits: &mut F, used_up: UsedUp, loss: Loss, weighed: &mut [Weighed]) -> f64 {
    let mut effective = weighed.iter().filter(|own| own.readings > 0).count() as f64;
    let Some(correction) = least_trimmed(fits, used_up, weighed) else {
        return effective;
    };
    fits.measure(&correction, weighed);
    let (mut scale_of_all, mut width) = (0.0, WIDENED);
    for round in 0..ROUNDS {
        let late = round >= ROUNDS / 2;
        if !late {
            scale_of_all = scale(used_up.parameters, weighed) * width;
        }
        let change = weigh(loss, scale_of_all, late, weighed);
        let settled = width <= 1.0 && change <= f64::EPSILON.sqrt();
        width = f64::max(1.0, width * NARROWED);
        effective = normalise(loss, scale_of_all, weighed).effective;
        let Some(correction) = fits.fit(fits.iterations(), weighed, effective) else {
            break;
        };
        fits.measure(&correction, weighed);
        if settled {
            break;
        }
    }
    effective
}

/// The scale of the distances: their median over that of normal residuals. The parameters make them smaller than they are
/// for others, and the start chooses the smallest half besides, which of few good rows names one in two hundred if it is
/// not made up for: together half as much again as the parameters.
fn scale(parameters: usize, weighed: &[Weighed]) -> f64 {
    let counted = weighed.iter().filter(|own| own.readings > 0);
    let typical: Vec<_> = counted
        .map(|own| own.distance / median_length(own.readings))
        .collect();
    let count = typical.len() as f64;
    let fitted = (count / (count - 1.5 * parameters as f64)).sqrt();
    f64::max(1.0, median(typical) * fitted)
}

/// The median length of so many normal residuals with σ = 1: √ of the median of χ².
fn median_length(readings: u8) -> f64 {
    match readings {
        0 | 1 => 0.674_490,
        2 => 1.177_410,
        3 => 1.538_172,
        4 => 1.832_128,
        _ => 2.086_015,
    }
}

/// The middle value, or the mean of the two; infinity of none. NaN counts as infinite.
fn median(values: Vec<f64>) -> f64 {
    let sorted = sorted(values);
    let count = sorted.len();
    let of_rank = |rank: usize| sorted.get(rank).copied().unwrap_or(f64::INFINITY);
    if count % 2 == 1 {
        of_rank(count / 2)
    } else {
        (of_rank((count / 2).saturating_sub(1)) + of_rank(count / 2)) * 0.5
    }
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    for value in &mut values {
        if value.is_nan() {
            *value = f64::INFINITY;
        }
    }
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// Weighs every row by its distance; returns the largest change of a weight. Late in the rounds what was suspected stays
/// so, for the rounds to come to an end.
fn weigh(loss: Loss, scale: f64, late: bool, weighed: &mut [Weighed]) -> f64 {
    let mut largest = 0.0_f64;
    for own in weighed {
        let unit = scale * loss.stretch(own.readings);
        own.suspected = (late && own.suspected) || !(own.distance < SUSPECTED * unit);
        let weight = if own.suspected {
            0.0
        } else {
            loss.weight(own.distance / unit)
        };
        largest = largest.max((weight - own.weight).abs());
        own.weight = weight;
    }
    largest
}

/// Divides the weights by κ.
fn normalise(loss: Loss, scale: f64, weighed: &mut [Weighed]) -> Normalization {
    let counted = weighed
        .iter()
        .filter(|own| own.weight > 0.0 && own.readings > 0);
    let normalization = loss.normalization(counted.map(|own| {
        let stretch = loss.stretch(own.readings);
        (own.distance / scale, f64::from(own.readings), stretch)
    }));
    for own in weighed.iter_mut() {
        own.factor = own.weight / normalization.divisor;
    }
    normalization
}

/// Random subsets. Of 30 % wrong rows four subsets of nine in a hundred hold none, of 40 % one.
const SUBSETS: usize = 150;
/// Places at which a change is supposed to begin.
const PLACES: usize = 24;
/// Concentration ends when a step leaves more than this part of the sum.
const PROGRESS: f64 = 0.999;
/// A fit that leaves so many times the least sum so far is not followed: the steps improve a fit of good rows by less.
const HOPELESS: f64 = 100.0;
/// Concentration steps of each, and of the best.
const FIRST_STEPS: usize = 1;
const LAST_STEPS: usize = 10;
/// With more rows than this the start looks at an even selection of them.
const MOST: usize = 150;
/// Linearisations of a fit at the start.
const ITERATIONS: u16 = 15;
/// The search ends when the sum over what is kept is below this part of what the noise makes of as many rows. The smallest
/// half of good rows have a third of it.
const GOOD: f64 = 0.75;

/// Where a robust fit starts: at the rows that agree best. `None` if no subset gives a fit.
///
/// ```text
/// minimise  Σ over the h smallest of  dₖ²
/// ```
///
/// Least trimmed squares (Rousseeuw 1984) by concentration steps (Rousseeuw and Van Driessen, 2006): fit some rows, keep
/// the h that lie nearest to that fit, fit those. No step raises the sum.
///
/// Wrong rows may agree with each other, as those after somebody moved the tracker do. Then no step leads from a subset
/// that holds some of them to the right fit. Random subsets are therefore as small as the problem allows, and there are
/// enough of them; and since such a change begins at some row, all rows before and after each of many places are subsets as
/// well.
fn least_trimmed<F: Fits>(
    fits: &mut F,
    used_up: UsedUp,
    weighed: &mut [Weighed],
) -> Option<F::Correction> {
    let stride = weighed.len() / MOST + 1;
    let mut starting = 0;
    for (index, own) in weighed.iter_mut().enumerate() {
        own.starting = index % stride == 0 && own.readings > 0;
        starting += usize::from(own.starting);
    }
    let mut search = Search {
        iterations: fits.iterations().min(ITERATIONS),
        fits,
        subset: used_up.subset,
        // The h of the highest breakdown point: (n + p + 1)/2.
        kept: usize::midpoint(starting, used_up.parameters + 1).min(starting),
        best: None,
    };
    choose(weighed, |_, own| own.starting);
    search.try_chosen(weighed, FIRST_STEPS);
    // The rows that lie nearest to the robot before calibration.
    search.fits.measure(&F::NOMINAL, weighed);
    choose_nearest(weighed, search.kept);
    search.try_chosen(weighed, FIRST_STEPS);
    search.try_changes(weighed, starting);
    search.try_subsets(weighed, starting);
    let (_, correction) = search.best?;
    search.fits.measure(&correction, weighed);
    choose_nearest(weighed, search.kept);
    search.try_chosen(weighed, LAST_STEPS);
    search.best.map(|(_, correction)| correction)
}

struct Search<'a, F: Fits> {
    fits: &'a mut F,
    iterations: u16,
    /// How many rows are in a random subset, and how many are kept.
    subset: usize,
    kept: usize,
    /// The least sum so far, and its fit.
    best: Option<(f64, F::Correction)>,
}

impl<F: Fits> Search<'_, F> {
    /// Whether the noise alone explains the rows that are kept.
    fn is_good(&self, weighed: &[Weighed]) -> bool {
        let starting = || weighed.iter().filter(|own| own.starting);
        let readings: f64 = starting().map(|own| f64::from(own.readings)).sum();
        let expected = GOOD * (readings / starting().count() as f64) * self.kept as f64;
        self.best.is_some_and(|(sum, _)| sum < expected)
    }

    /// Supposes that a change begins at each of many rows.
    fn try_changes(&mut self, weighed: &mut [Weighed], starting: usize) {
        let places = PLACES.min(starting);
        for place in 1..places {
            let boundary = weighed.len() * place / places;
            for before in [true, false] {
                if self.is_good(weighed) {
                    return;
                }
                let chosen = choose(weighed, |index, own| {
                    own.starting && (index < boundary) == before
                });
                if chosen >= self.subset {
                    self.try_chosen(weighed, FIRST_STEPS);
                }
            }
        }
    }

    fn try_subsets(&mut self, weighed: &mut [Weighed], starting: usize) {
        let mut random = Random(0x9e37_79b9);
        for _ in 0..SUBSETS {
            if self.is_good(weighed) {
                return;
            }
            let (mut wanted, mut left) = (self.subset.min(self.kept), starting);
            choose(weighed, |_, own| {
                // Knuth's algorithm S: as many as are wanted, every choice equally likely.
                let chosen = own.starting && random.below(left) < wanted;
                left = left.saturating_sub(usize::from(own.starting));
                wanted = wanted.saturating_sub(usize::from(chosen));
                chosen
            });
            self.try_chosen(weighed, FIRST_STEPS);
        }
    }

    /// Fits the chosen rows, and the nearest to that fit, and so on.
    fn try_chosen(&mut self, weighed: &mut [Weighed], steps: usize) {
        let mut last: Option<f64> = None;
        for _ in 0..=steps {
            let chosen = weighed.iter().filter(|own| own.factor > 0.0).count();
            let Some(correction) = self.fits.fit(self.iterations, weighed, chosen as f64) else {
                return;
            };
            self.fits.measure(&correction, weighed);
            let Some(sum) = choose_nearest(weighed, self.kept) else {
                return;
            };
            let sum = sum + self.fits.prior_cost(&correction);
            let least = self.best.map_or(f64::INFINITY, |(least, _)| least);
            if sum < least {
                self.best = Some((sum, correction));
            }
            let gains = last.is_none_or(|last| sum < last * PROGRESS);
            if sum > HOPELESS * least || !gains {
                return;
            }
            last = Some(sum);
        }
    }
}

/// Lets those rows count alike and the others not at all; how many count.
fn choose(weighed: &mut [Weighed], mut chosen: impl FnMut(usize, &Weighed) -> bool) -> usize {
    let mut count = 0;
    for (index, own) in weighed.iter_mut().enumerate() {
        let counts = chosen(index, own);
        own.factor = if counts { 1.0 } else { 0.0 };
        count += usize::from(counts);
    }
    count
}

/// Chooses as many rows as are to be kept, and sums up their squared distances.
fn choose_nearest(weighed: &mut [Weighed], kept: usize) -> Option<f64> {
    let starting = weighed.iter().filter(|own| own.starting);
    let distances = sorted(starting.map(|own| own.distance).collect());
    let farthest = *distances.get(kept.saturating_sub(1))?;
    let mut sum = 0.0;
    choose(weighed, |_, own| {
        let near = own.starting && own.distance <= farthest;
        if near {
            sum += square(own.distance);
        }
        near
    });
    f64::is_finite(sum).then_some(sum)
}

/// Marsaglia's xorshift (2003): the same subsets everywhere.
struct Random(u32);

impl Random {
    /// A number below `bound`, all alike; 0 for a bound of 0.
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        let scaled = (u64::from(self.0) * bound as u64) >> 32;
        usize::try_from(scaled).unwrap_or(0)
    }
}

fn square(value: f64) -> f64 {
    value * value
}

#[cfg(test)]
mod tests {
    use super::{
        Fits, Loss, Random, SUSPECTED, Search, UsedUp, Weighed, choose_nearest, least_trimmed,
        median, median_length,
    };

    const BOTH: [Loss; 2] = [Loss::Huber, Loss::Tukey];

    /// ρ, written anew from the literature: Huber (1964), Beaton and Tukey (1974).
    fn rho(loss: Loss, r: f64) -> f64 {
        let size = r.abs();
        match loss {
            Loss::Huber if size <= 1.345 => size * size / 2.0,
            Loss::Huber => 1.345 * (size - 1.345 / 2.0),
            Loss::Tukey => {
                let c = 4.685;
                c * c / 6.0 * (1.0 - (1.0 - (size / c).min(1.0).powi(2)).powi(3))
            }
        }
    }

    #[test]
    fn weight_and_slope_are_those_of_rho() {
        for loss in BOTH {
            // On both sides, none at a corner.
            for r in (-930..=930).map(|k| f64::from(k) / 100.0 + 0.0017) {
                let psi = (rho(loss, r + 1e-5) - rho(loss, r - 1e-5)) / 2e-5;
                // Beyond this nothing counts, whatever the loss.
                let psi = if r.abs() < SUSPECTED { psi } else { 0.0 };
                assert!((loss.weight(r) * r - psi).abs() < 1e-8, "{loss:?} {r}");
                let psi = |r: f64| loss.weight(r) * r;
                let slope = (psi(r + 1e-6) - psi(r - 1e-6)) / 2e-6;
                assert!((loss.slope(r) - slope).abs() < 1e-7, "{loss:?} {r}");
            }
            for r in [SUSPECTED, -SUSPECTED, f64::INFINITY, f64::NAN] {
                assert!(loss.weight(r).abs() + loss.slope(r).abs() < 1e-30);
            }
        }
    }

    /// Three residuals of which one has no weight, by hand: w = 1, ½, ψ = 1, 1.345, ψ′ = 1, 0, κ = Σψ² Σw / (Σψr Σψ′).
    /// And vectors of three, twice as far for the same weight: of each size r the mean of ψ′ over the directions is
    /// (2 w + ψ′)/3, of ψ² and ψ r a third of the whole.
    #[test]
    fn the_normalization_is_that_by_hand() {
        let of = |sizes: &[f64], readings, stretch| {
            Loss::Huber.normalization(sizes.iter().map(|size| (*size, readings, stretch)))
        };
        let found = of(&[1.0, 2.69, 7.0], 1.0, 1.0);
        let divisor = (1.0 + 1.345 * 1.345) * 1.5 / (1.0 + 1.345 * 2.69);
        assert!((found.divisor - divisor).abs() < 1e-14);
        assert!((found.effective - 1.0 / divisor).abs() < 1e-14);
        let found = of(&[2.0, 5.38, 0.5, 0.5], 3.0, 2.0);
        let (influences, moments) = ((4.5 + 2.69 * 2.69) / 3.0, (4.5 + 2.69 * 5.38) / 3.0);
        let slopes = 10.0 / 3.0;
        let divisor = influences * 3.5 / (moments * slopes);
        assert!((found.divisor - divisor).abs() < 1e-14);
        assert!((found.effective - slopes / divisor).abs() < 1e-14);
        // Worth less than one row, fitted exactly, none left: their number is stated in its place.
        for (sizes, expected) in [
            (&[1.4, 0.5, 7.0][..], 2.0),
            (&[0.0; 20], 20.0),
            (&[9.0, 10.0], 0.0),
        ] {
            assert!((of(sizes, 1.0, 1.0).effective - expected).abs() < 1e-14);
        }
    }

    /// Half of all normal residuals are shorter: by the distribution of χ² in closed form.
    #[test]
    fn half_of_the_residuals_are_shorter_than_the_median_length() {
        for readings in 1..=5 {
            let length = median_length(readings);
            let (half, density) = (length * length / 2.0, (-length * length / 2.0).exp());
            let of_one = statrs::function::erf::erf(length / std::f64::consts::SQRT_2);
            let odd = (2.0 / std::f64::consts::PI).sqrt() * length * density;
            let shorter = match readings {
                1 => of_one,
                2 => 1.0 - density,
                3 => of_one - odd,
                4 => 1.0 - density * (1.0 + half),
                _ => of_one - odd * (1.0 + 2.0 * half / 3.0),
            };
            // Six decimals of the length.
            assert!((shorter - 0.5).abs() < 1e-6, "{readings}: {shorter}");
        }
        for (values, expected) in [
            (vec![3.0, 1.0, 2.0], 2.0),
            (vec![4.0, f64::NAN, 3.0, 2.0], 3.5),
            (vec![], f64::INFINITY),
        ] {
            assert_eq!(median(values).to_bits(), f64::to_bits(expected));
        }
    }

    /// Marsaglia's own example: of the seed 2463534242 the first number is 723471715.
    #[test]
    fn the_generator_is_marsaglias() {
        assert_eq!(Random(2_463_534_242).below(1 << 32), 723_471_715);
        assert_eq!(Random(1).below(0), 0);
    }

    #[test]
    fn the_nearest_are_chosen_and_summed_up() {
        let mut weighed = [Weighed::new(3); 7];
        for (own, distance) in weighed.iter_mut().zip([5.0, 0.5, 9.0, 2.0, 1.0, 0.1, 4.0]) {
            own.distance = distance;
        }
        // One that the start does not look at.
        weighed[5].starting = false;
        let sum = choose_nearest(&mut weighed, 4).unwrap();
        assert!((sum - 21.25).abs() < 1e-14);
        let chosen = weighed.map(|own| own.factor > 0.0);
        assert_eq!(chosen, [false, true, false, true, true, false, true]);
        weighed[1].distance = f64::INFINITY;
        assert_eq!(choose_nearest(&mut weighed, 6), None);
    }

    /// Fits that keep a record of which rows they were of, by bits. The distance of the row k is k + 1 times `unit` of the
    /// number of fits.
    struct Recorder {
        unit: fn(i32) -> f64,
        sets: Vec<u64>,
        limit: u16,
        stated: u16,
    }

    impl Recorder {
        fn new(unit: fn(i32) -> f64) -> Self {
            Self {
                unit,
                sets: Vec::new(),
                limit: 0,
                stated: 50,
            }
        }

        fn search(&mut self, subset: usize, kept: usize) -> Search<'_, Self> {
            Search {
                fits: self,
                iterations: 15,
                subset,
                kept,
                best: None,
            }
        }
    }

    impl Fits for Recorder {
        type Correction = u64;

        const NOMINAL: u64 = 0;

        fn fit(&mut self, most: u16, weighed: &[Weighed], effective: f64) -> Option<u64> {
            let set = (0..).zip(weighed).fold(0_u64, |set, (index, own)| {
                set | u64::from(own.factor > 0.0) << index
            });
            assert!((effective - f64::from(set.count_ones())).abs() < 1e-9);
            self.sets.push(set);
            self.limit = most;
            Some(set)
        }

        fn measure(&self, _: &u64, weighed: &mut [Weighed]) {
            let unit = (self.unit)(i32::try_from(self.sets.len()).unwrap());
            for (index, own) in (1..).zip(weighed) {
                own.distance = f64::from(index) * unit;
            }
        }

        fn prior_cost(&self, _: &u64) -> f64 {
            7.0
        }

        fn iterations(&self) -> u16 {
            self.stated
        }
    }

    /// Concentration goes on while a step takes off a thousandth of the sum or more, as long as steps are left; the least
    /// sum is kept, with what is known beforehand; and a fit that leaves a hundred times the least sum is not followed.
    #[test]
    fn concentration_ends_where_it_gains_nothing() {
        for (unit, expected) in [
            ((|fits| 0.5_f64.powi(fits)) as fn(i32) -> f64, 4),
            (|fits| 0.999_f64.powi(fits), 4),
            (|fits| 0.9998_f64.powi(fits), 2),
            (|_| 1.0, 2),
            (|fits| f64::from(fits), 2),
        ] {
            let mut fits = Recorder::new(unit);
            let mut search = fits.search(9, 20);
            search.try_chosen(&mut [Weighed::new(3); 30], 3);
            let (least, _) = search.best.unwrap();
            assert_eq!(fits.sets.len(), expected);
            // All rows, and then the nearest to each fit.
            assert_eq!(fits.sets[0], (1 << 30) - 1);
            assert!(fits.sets[1..].iter().all(|set| *set == (1 << 20) - 1));
            // Σ (k + 1)² over the first twenty.
            let sums = (1..=4)
                .take(expected)
                .map(|fits| 2870.0 * unit(fits).powi(2) + 7.0);
            let expected = sums.fold(f64::INFINITY, f64::min);
            assert!((least - expected).abs() < 1e-12 * expected);
        }
        for (part, expected) in [(0.99, 2), (1.01, 1)] {
            let mut fits = Recorder::new(|_| 1.0);
            let mut search = fits.search(9, 20);
            search.best = Some((2877.0 / (100.0 * part), 5));
            search.try_chosen(&mut [Weighed::new(3); 30], 3);
            assert_eq!(search.best.map(|(_, set)| set), Some(5));
            assert_eq!(fits.sets.len(), expected);
        }
    }

    /// All rows before and all after each of 24 places, if there are enough of them; 150 random subsets; none of it where
    /// the noise explains what is kept.
    #[test]
    fn subsets_are_before_and_after_a_change_and_small() {
        let mut weighed = [Weighed::new(3); 30];
        weighed[4].starting = false;
        let mut fits = Recorder::new(|_| 1.0);
        fits.search(10, 20).try_changes(&mut weighed, 29);
        let all: u64 = ((1 << 30) - 1) & !(1 << 4);
        let expected = (1..24).flat_map(|place| {
            let before: u64 = (1 << (30 * place / 24)) - 1;
            [all & before, all & !before]
        });
        let expected = expected.filter(|set| set.count_ones() >= 10);
        assert!(fits.sets.iter().copied().step_by(2).eq(expected));
        for (subset, kept, size) in [(9, 20, 9), (12, 10, 10)] {
            let mut fits = Recorder::new(|_| 1.0);
            fits.search(subset, kept).try_subsets(&mut weighed, 29);
            let chosen = || fits.sets.iter().step_by(2);
            assert_eq!(chosen().count(), 150);
            assert!(chosen().all(|set| set.count_ones() == size && set & (1 << 4) == 0));
            for index in (0..30).filter(|index| *index != 4) {
                let times = chosen().filter(|set| *set & (1 << index) != 0).count();
                // Five σ of a binomial number.
                let share = f64::from(size) / 29.0;
                let sigma = (150.0 * share * (1.0 - share)).sqrt();
                assert!((times as f64 - 150.0 * share).abs() < 5.0 * sigma);
            }
        }
        // Three quarters of the readings of twenty rows.
        let mut fits = Recorder::new(|_| 1.0);
        let mut search = fits.search(9, 20);
        assert!(!search.is_good(&weighed));
        search.best = Some((45.1, 0));
        assert!(!search.is_good(&weighed));
        search.best = Some((44.9, 0));
        assert!(search.is_good(&weighed));
        search.try_changes(&mut weighed, 29);
        search.try_subsets(&mut weighed, 29);
        assert!(fits.sets.is_empty());
    }

    /// The h that the highest breakdown point keeps, with few linearisations, and no row without readings.
    #[test]
    fn the_start_keeps_half_of_the_rows_and_half_of_the_parameters() {
        for (stated, expected) in [(50, 15), (5, 5)] {
            let mut fits = Recorder::new(|_| 1.0);
            fits.stated = stated;
            let mut all = [Weighed::new(3); 62];
            all[17].readings = 0;
            let used_up = UsedUp {
                subset: 9,
                parameters: 8,
            };
            assert!(least_trimmed(&mut fits, used_up, &mut all).is_some());
            assert_eq!(fits.limit, expected);
            assert!(fits.sets.iter().all(|set| set & (1 << 17) == 0));
            assert_eq!(fits.sets[0].count_ones(), 61);
            // (61 + 8 + 1)/2.
            assert_eq!(fits.sets[1].count_ones(), 35);
        }
    }
}
