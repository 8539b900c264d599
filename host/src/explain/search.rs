//! The search: hypotheses are scanned, refitted and ranked, up to three at once.

use super::scan::{Gain, Hypothesis, Scan};
use crate::effects::{At, Course, Effect, EffectKind, Estimated, Platform};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Reading, Readings, Row};
use crate::fit::jointly::of_platform_point;
use crate::fit::solution::Levels;
use crate::fit::{Case, Frame, Options, Solution, solve_with};
use crate::geometry::Directions;
use crate::halt;
use crate::order;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Real};
use nalgebra::Vector3;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Chance that some hypothesis is accepted for a file without any fault, shared by this many kinds.
const FALSE_ALARM: f64 = 0.003;
const KINDS: f64 = 12.0;
/// Hypotheses of each kind that are refitted; of a file with few rows, of which the first order tells less.
const OF_EACH_KIND: usize = 2;
const OF_FEW_ROWS: (usize, usize) = (24, 4);
/// Most faults at once.
const MOST: usize = 3;
/// Sets of faults that are extended.
const BEAM: usize = 2;
/// χ² that the play of each further joint must explain, with its error before its first move: 3 σ.
const FURTHER_JOINT: f64 = 12.0;
/// A first-order gain may be this much too small.
const FIRST_ORDER: f64 = 0.5;
/// Explanations whose cost is within this of the best are named as well.
const CLEARLY: f64 = 12.0;
/// Files with more rows are thinned before they are refitted.
const MOST_ROWS: usize = 400;
/// Σ r² for each degree of freedom below which nothing is left to explain.
const EXPLAINED: f64 = 1.1;
/// σ of entirely unknown joint zeros: 15°.
const UNKNOWN_ZERO: f64 = 0.26;
/// Least degrees of freedom that tell a fault from an estimated noise.
const LEAST_FREEDOM: f64 = 5.0;
/// The same of a stated noise, or where rows are left out.
const LEAST_LEFT: f64 = 1.0;
/// A stated target that the readings put so many σ beside its place is doubtful.
const DOUBTFUL: f64 = 2.5;
/// A hypothesis that explains less than this part of what the best of all explains is not refitted.
const WORTHWHILE: f64 = 0.05;
/// An estimated noise has converged if the variance that it leaves is within this.
const SETTLED: std::ops::Range<f64> = 0.9..1.1;
const NARROWINGS: u32 = 8;
/// χ² of the parameters within their tolerance, at most: of 24, one in a thousand has more.
const PLAUSIBLE: f64 = 51.0;
/// Part of a surface's shape that the robot may take up.
const TAKEN_UP_OF_SURFACES: f64 = 0.5;
/// Touches that show a surface's shape, for each of its waves.
const TOUCHES_FOR_EACH: usize = 2;
/// Rows that were left out are fitted again if they are at most so many σ from the fit of the others.
const AGREEING: [f64; 2] = [10.0, 5.0];
/// Ways of choosing rows beyond which their chance is less than rounding shows.
const MOST_WAYS: f64 = 1e9;
/// Time constants of the fastest drift in a file.
const FASTEST: usize = 12;
/// Rows on either side of a move.
const LEAST_ROWS: usize = 2;

/// A hypothesis, fitted.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) hypothesis: Hypothesis,
    pub(crate) solution: Solution,
    /// Σ r² in units of a stated noise, and the rest of −2 log of the likelihood: of an estimated noise, for each degree of
    /// freedom, of the prior, and the penalty for the hypothesis.
    squares: f64,
    pub(super) spread: f64,
    prior: f64,
    penalty: f64,
    freedom: f64,
    /// The same of the robot alone, with all rows.
    of_robot: f64,
}

/// What fits are compared with: the least residuals over a stated noise; of an estimated one, the fit that leaves the fewest
/// degrees of freedom, because beside a large noise the prior determines parameters that the readings determine beside a small
/// one.
#[derive(Clone, Copy)]
struct Scale {
    misfit: f64,
    freedom: f64,
    spread: f64,
}

impl Scale {
    fn of<'a>(all: impl IntoIterator<Item = &'a Fitted>) -> Self {
        let none = Self {
            misfit: f64::INFINITY,
            freedom: f64::INFINITY,
            spread: 0.0,
        };
        all.into_iter().fold(none, |least, own| {
            let misfit = least.misfit.min(own.misfit());
            let (freedom, spread) = (own.of_robot, own.spread);
            if freedom < least.freedom {
                Self {
                    misfit,
                    freedom,
                    spread,
                }
            } else {
                Self { misfit, ..least }
            }
        })
    }
}

impl Fitted {
    /// Where residuals exceed the stated noise this many times, they count as noise. The likelihood falls with the logarithm
    /// of an estimated noise as there are degrees of freedom, on average of those at both noises.
    fn score(&self, scale: Scale) -> f64 {
        let spread = 0.5 * (self.of_robot + scale.freedom) * (self.spread - scale.spread);
        let squares = self.squares / (scale.misfit * scale.misfit);
        squares + spread + self.prior + self.penalty
    }

    /// Whether the residuals show it, and not the prior alone: a wrong scale, too, explains a wrong length of the file. The robot
    /// takes up most of a surface's lower waves. Where few residuals are left over, only the prior can show anything.
    pub(super) fn is_in_residuals(&self, base: &Self) -> bool {
        if base.freedom < LEAST_FREEDOM {
            return true;
        }
        let scale = Scale::of([self]);
        let without_prior = |own: &Self| own.score(scale) - own.prior - own.penalty;
        let part = 1.0 - TAKEN_UP_OF_SURFACES * f64::from(self.is_of_a_surface());
        without_prior(base) - without_prior(self) > part * (base.prior - self.prior)
    }

    /// Whether it is a surface's shape, of which the waves are never all.
    pub(super) fn is_of_a_surface(&self) -> bool {
        let mut effects = self.hypothesis.effects.iter();
        effects.any(|own| own.kind == EffectKind::Bed)
    }

    /// Whether the residuals are no larger than a stated noise.
    fn is_explained(&self) -> bool {
        self.squares > 0.0 && self.squares < EXPLAINED * self.freedom
    }

    /// Whether the residuals are larger than a stated noise.
    fn contradicts(&self) -> bool {
        self.squares > EXPLAINED * self.freedom
    }

    /// Whether the robot may have been made to its tolerance.
    pub(super) fn is_plausible(&self) -> bool {
        self.prior < PLAUSIBLE
    }

    /// Whether what it adds is a wrong number of the robot file, which the prior alone may show.
    fn is_number(&self) -> bool {
        let last = self.hypothesis.effects.last();
        last.is_some_and(|own| own.kind.is_number() || own.kind == EffectKind::Target)
    }

    /// Whether each target is nearer to the platform than a forearm is long.
    fn is_on_the_platform(&self) -> bool {
        let [arm, ..] = self.solution.robot.arms();
        let mut all = self.solution.effects.iter();
        all.all(|own| {
            let beside = own.by.iter().map(|by| by * by).sum::<f64>().sqrt();
            own.effect.kind != EffectKind::Target || beside < arm.lb()
        })
    }

    /// Residuals over the stated noise, at least 1.
    pub(super) fn misfit(&self) -> f64 {
        (self.squares / self.freedom.max(1.0)).sqrt().max(1.0)
    }

    /// Names rows as in a file of which these were fitted.
    fn spread(&mut self, chosen: &[usize]) {
        let effects = self.solution.effects.iter_mut().map(|own| &mut own.effect);
        let effects = effects.chain(&mut self.hypothesis.effects);
        for own in effects.filter(|own| own.kind.is_step()) {
            own.index = chosen[own.index];
        }
        for row in &mut self.hypothesis.rows {
            *row = chosen[*row];
        }
    }

    /// The estimate of an effect.
    pub(crate) fn estimate(&self, effect: &Effect) -> Option<&Estimated> {
        self.solution
            .effects
            .iter()
            .find(|own| own.effect == *effect)
    }
}

/// What was found.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    /// As it is.
    pub(crate) base: Fitted,
    /// With what explains the readings best.
    pub(crate) best: Option<Fitted>,
    /// Others that explain them about as well.
    pub(crate) rivals: Vec<Fitted>,
    /// The largest drift that the order of the rows hides, mm.
    pub(crate) hidden_drift: Option<f64>,
    /// Why nothing was looked for.
    pub(crate) not_tested: Option<&'static str>,
}

struct Search<'a> {
    case: &'a Case<'a>,
    options: Options,
    /// Degrees of freedom of the readings as they are.
    freedom: Option<f64>,
    /// The noise of the readings as they are, if it is estimated.
    levels: Option<Levels>,
    rows: usize,
}

/// Looks for what explains the readings better than the robot alone; `None` if they cannot be fitted at all.
///
/// Many rows are thinned, and then all between those on either side of a step are looked at.
pub(crate) fn search(case: &Case<'_>) -> Option<Found> {
    let count = case.readings.rows.len();
    let mut chosen: Vec<_> = evenly(0, count, MOST_ROWS).collect();
    let mut moves = Directions::default();
    let rows = case.readings.rows.iter().enumerate();
    let order = rows.map(|(index, row)| {
        let part = index as f64 / count.saturating_sub(1).max(1) as f64;
        (row.line, (part, moves.next(&row.value.joints)))
    });
    let order: Vec<_> = order.collect();
    for last in [false, false, true] {
        let mut some = case.readings.clone();
        some.order = chosen.iter().map(|row| order[*row]).collect();
        some.rows = chosen.iter().map(|row| some.rows[*row]).collect();
        let mut found = searched(&Case {
            readings: &some,
            ..*case
        })?;
        let best = found.best.iter();
        let steps = best.flat_map(|own| &own.hypothesis.effects);
        let steps = steps.filter(|own| own.kind.is_step());
        let gaps = steps.map(|own| (chosen[own.index - 1] + 1, chosen[own.index]));
        let between = gaps.flat_map(|(from, to)| evenly(from, to, MOST_ROWS / 2));
        let between: Vec<_> = between.collect();
        if last || between.is_empty() {
            for own in found.best.iter_mut().chain(&mut found.rivals) {
                own.spread(&chosen);
            }
            return Some(found);
        }
        chosen.extend(between);
        chosen.sort_unstable();
    }
    None
}

/// At most so many of these rows.
fn evenly(from: usize, to: usize, most: usize) -> impl Iterator<Item = usize> {
    (from..to).step_by((to - from).div_ceil(most).max(1))
}

/// The score of readings that have been changed, if the robot then explains them clearly better than before.
pub(super) fn explains(changed: &Case<'_>, found: Option<&Found>) -> Option<f64> {
    let own = Search::of(changed).fitted(Hypothesis::default())?;
    let scale = Scale {
        misfit: 1.0,
        freedom: found.map_or(own.of_robot, |before| before.base.of_robot),
        spread: 0.0,
    };
    let score = own.score(scale);
    let better = found.is_none_or(|before| score + CLEARLY < before.base.score(scale));
    let plausible = own.is_plausible() && !own.contradicts();
    (plausible && better).then_some(score)
}

fn searched(case: &Case<'_>) -> Option<Found> {
    let mut search = Search::of(case);
    let base = search.fitted(Hypothesis::default())?;
    search.freedom = Some(base.freedom);
    let estimated = base.solution.estimated_freedom();
    search.levels = estimated.map(|_| base.solution.levels);
    let mut found = Found {
        base: base.clone(),
        best: None,
        rivals: Vec::new(),
        hidden_drift: None,
        not_tested: None,
    };
    let Some(scan) = Scan::of(&base.solution) else {
        found.not_tested = Some("the poses do not determine the parameters well enough");
        return Some(found);
    };
    found.hidden_drift = scan.hidden_drift(TAKEN_UP);
    let least = search.levels.map_or(LEAST_LEFT, |_| LEAST_FREEDOM);
    if base.freedom < least {
        found.not_tested = Some("too few samples are left over to tell causes from noise");
        return Some(found);
    }
    let mut beam = vec![base.clone()];
    let mut all = vec![base];
    for depth in 0..MOST {
        let mut next = Vec::new();
        if depth == 0 {
            next = search.without_rows(&beam, 1);
        }
        // What explains a stated noise needs no further fault, and a wrong number of the robot file is corrected first.
        let open = |own: &&Fitted| depth == 0 || !(own.is_explained() || own.is_number());
        for state in beam.iter().filter(open) {
            for hypothesis in search.candidates(state) {
                halt::check();
                let known = |own: &Hypothesis| {
                    let mut others = all.iter().chain(&next);
                    others.any(|other| other.hypothesis == *own)
                };
                let fitted = (!known(&hypothesis)).then(|| search.settled(hypothesis));
                let fitted = fitted.flatten().filter(|own| {
                    // Steps that begin at different rows may settle at the same one.
                    let shown = own.is_number() || own.is_in_residuals(state);
                    shown && own.is_on_the_platform() && !known(&own.hypothesis)
                });
                next.extend(fitted);
            }
        }
        let mut robust = Vec::new();
        let is_alone = |own: &Fitted| own.is_explained() && own.hypothesis.rows.is_empty();
        if !next.iter().any(is_alone) {
            robust = search.without_rows(&next, BEAM);
            // Of rows that were all right, none is left out.
            robust.retain(|own| next.iter().all(|other| other.hypothesis != own.hypothesis));
        }
        let scale = Scale::of(all.iter().chain(&next).chain(&robust));
        for own in [&mut next, &mut robust] {
            order::sort_by(own, |own| own.score(scale));
        }
        let scores = all.iter().map(|own| own.score(scale));
        let before = scores.fold(f64::INFINITY, f64::min);
        beam = next.iter().take(BEAM).cloned().collect();
        beam.extend(robust.first().cloned());
        if !beam.iter().any(|own| own.score(scale) < before) {
            break;
        }
        all.extend(robust);
        all.extend(next);
    }
    let scale = Scale::of(&all);
    order::sort_by(&mut all, |own| own.score(scale));
    let base = found.base.score(scale);
    all.retain(|own| own.hypothesis != Hypothesis::default() && own.score(scale) < base);
    if let Some(best) = all.first() {
        let limit = best.score(scale) + CLEARLY;
        let faults = best.hypothesis.effects.len();
        all.retain(|own| own.score(scale) < limit && own.hypothesis.effects.len() <= faults);
        // What is not clearly better is no reason for more unknowns.
        all.sort_by_key(|own| {
            let missing = faults - own.hypothesis.effects.len();
            (missing, own.hypothesis.unknowns())
        });
        let mut all = all.into_iter();
        found.best = all.next();
        found.rivals = all.collect();
    }
    Some(found)
}

/// A drift is hidden if the unknowns increase its variance by more than this factor.
const TAKEN_UP: f64 = 4.0;

impl<'a> Search<'a> {
    fn of(case: &'a Case<'a>) -> Self {
        let options = Options {
            robust: false,
            ..case.options
        };
        Self {
            case,
            options,
            freedom: None,
            levels: None,
            rows: case.readings.rows.len(),
        }
    }

    /// The χ² that a hypothesis must explain: of so many of its kind, with so many unknowns. Of an estimated noise with few
    /// degrees of freedom ν it is ν ln(1 + k (F − 1)/ν), as far as that is more.
    fn penalty(&self, unknowns: usize, of_kind: f64) -> f64 {
        let level = 1.0 - FALSE_ALARM / KINDS / of_kind.max(1.0);
        let number = unknowns as f64;
        let chi_square =
            ChiSquared::new(number).map_or(f64::INFINITY, |own| own.inverse_cdf(level));
        let Some(freedom) = self.freedom.filter(|_| self.levels.is_some()) else {
            return chi_square;
        };
        let ratio = FisherSnedecor::new(number, freedom - number);
        let ratio = ratio.map_or(f64::INFINITY, |own| own.inverse_cdf(level));
        let of_ratio = freedom * (1.0 + number * (ratio - 1.0) / freedom).natural_logarithm();
        chi_square.max(of_ratio)
    }

    /// How many hypotheses are like this one.
    fn alike(&self, kind: Option<EffectKind>) -> f64 {
        let rows = self.rows as f64;
        match kind {
            None | Some(EffectKind::Move) => rows,
            Some(EffectKind::Slip) => 3.0 * rows,
            Some(EffectKind::Backlash) => 7.0,
            Some(own) if own.is_of_joint() => 3.0,
            Some(_) => 1.0,
        }
    }

    fn penalties(&self, hypothesis: &Hypothesis) -> f64 {
        let mut sum = 0.0;
        let mut backlash = 0;
        let kinds = [Kind::Position, Kind::Distance];
        for own in &hypothesis.effects {
            match own.kind {
                EffectKind::Backlash => backlash += 1,
                // A plate moves up and tilts.
                EffectKind::Move if kinds.iter().all(|kind| !self.case.readings.holds(*kind)) => {
                    sum += self.penalty(3, self.alike(Some(EffectKind::Move)));
                }
                // Of shapes that explain it as well, the most even one.
                EffectKind::Drift => sum += self.penalty(3, 1.0) + own.index as f64,
                kind => sum += self.penalty(kind.unknowns(), self.alike(Some(kind))),
            }
        }
        if backlash > 0 {
            let kind = EffectKind::Backlash;
            let penalty = |unknowns| self.penalty(unknowns, self.alike(Some(kind)));
            let play = penalty(1) + FURTHER_JOINT * (backlash - 1) as f64;
            // The errors before the first move may leave nothing of a row.
            let all = self
                .levels
                .map_or(0.0, |_| penalty(backlash * kind.unknowns()));
            sum += play.max(all);
        }
        let rows = hypothesis.rows.len();
        let each = rows as f64 * self.penalty(3, self.alike(None));
        if self.levels.is_none() || rows < 2 {
            return sum + each;
        }
        // Of few rows, those that agree best by chance show hardly any noise.
        let ways = (0..rows).map(|row| (self.rows - row) as f64 / (row + 1) as f64);
        sum + each.max(self.penalty(3 * rows, ways.product::<f64>().min(MOST_WAYS)))
    }

    /// Fits the robot and the hypothesis.
    fn fitted(&self, mut hypothesis: Hypothesis) -> Option<Fitted> {
        let readings = self.case.readings;
        let penalties = self.penalties(&hypothesis);
        let left_out = hypothesis.rows.clone();
        let mut kept = readings.clone();
        let mut index = 0;
        kept.rows.retain(|_| {
            index += 1;
            !left_out.contains(&(index - 1))
        });
        let shifted = |own: &Effect| {
            let before = (0..own.index).filter(|row| left_out.contains(row)).count();
            match own.kind {
                kind if kind.is_step() => own.at(own.index - before),
                _ => *own,
            }
        };
        // Joint zeros are parameters of the robot, of which nothing is known.
        let zeros = |own: &&Effect| own.kind == EffectKind::Zeros;
        let tolerance = self
            .case
            .robot
            .tolerance
            .filter(|_| hypothesis.effects.iter().any(|own| zeros(&own)));
        let unknown = tolerance.and_then(|own| own.with_joint_zero(UNKNOWN_ZERO).ok());
        let freed = unknown.map(|own| self.case.robot.with_tolerance(Some(own)));
        let mut from = hypothesis.from.iter().copied();
        let started = hypothesis.effects.iter().map(|own| {
            let mut opened = Estimated::open(shifted(own));
            opened
                .by
                .iter_mut()
                .zip(from.by_ref())
                .for_each(|(by, from)| *by = from);
            opened
        });
        let opened: Vec<_> = started.filter(|own| !zeros(&&own.effect)).collect();
        let robot = freed.as_ref().unwrap_or(self.case.robot);
        let mut solution = self.solved(robot, &kept, opened.clone())?;
        let effects = hypothesis.effects.iter().filter(|own| !zeros(own));
        for (own, effect) in opened.iter().zip(effects) {
            let mut all = solution.effects.iter_mut();
            if let Some(found) = all.find(|found| found.effect == own.effect) {
                found.effect = *effect;
            }
        }
        let estimates = hypothesis.effects.iter().flat_map(|own| {
            let found = solution.effects.iter().find(|found| found.effect == *own);
            found.map_or_else(|| vec![0.0; own.unknowns()], |own| own.by.clone())
        });
        hypothesis.from = estimates.collect();
        let stated = self.levels.is_none() && solution.estimated_freedom().is_none();
        let factor = if stated {
            self.widened_by(&solution)
        } else {
            1.0
        };
        let squares = solution.squares() * factor * factor;
        let prior = solution.cost() - solution.squares();
        let left = solution.degrees_of_freedom();
        let freedom = left - hypothesis.unknowns() as f64;
        // Of an estimated noise, its restricted likelihood.
        let per_reading = solution.log_spread / f64::max(kept.readings() as f64, 1.0);
        let variance = solution.squares() / freedom.max(1.0);
        // A noise that vanishes determines nothing, and rounding decides.
        let is_left = hypothesis.rows.is_empty() || freedom >= LEAST_LEFT;
        let is_left = is_left && left <= kept.readings() as f64;
        if self.levels.is_some() && !(variance > 0.0 && is_left) {
            return None;
        }
        let spread = 2.0 * per_reading + variance.natural_logarithm();
        let (squares, spread) = if stated {
            (squares, 0.0)
        } else {
            (0.0, spread)
        };
        Some(Fitted {
            squares,
            spread,
            prior,
            penalty: penalties,
            freedom,
            of_robot: left + (readings.readings() - kept.readings()) as f64,
            solution,
            hypothesis,
        })
    }

    /// A fit with these effects opened. An estimated noise is the one that the readings show with them; all of its parts
    /// are scaled together.
    fn solved(
        &self,
        robot: &RobotFile,
        readings: &Readings,
        mut opened: Vec<Estimated>,
    ) -> Option<Solution> {
        let mut stated = self
            .levels
            .map(|own| robot.with_noise(own.position, own.height, own.distance));
        for _ in 0..NARROWINGS {
            let with = stated.as_ref().unwrap_or(robot);
            let solution = solve_with(with, readings, &self.options, (&opened, false)).ok()?;
            let variance = solution.squares() / solution.degrees_of_freedom();
            let Some(narrower) = stated.filter(|_| !SETTLED.contains(&variance)) else {
                return Some(solution);
            };
            for own in &mut opened {
                let mut found = solution.effects.iter();
                if let Some(found) = found.find(|found| found.effect == own.effect) {
                    own.by.clone_from(&found.by);
                }
            }
            stated = Some(narrower.with_noise_times(variance.sqrt()));
        }
        let with = stated.as_ref().unwrap_or(robot);
        solve_with(with, readings, &self.options, (&opened, false)).ok()
    }

    /// By how much the noise was widened for the fit.
    fn widened_by(&self, solution: &Solution) -> f64 {
        let noise = solution.noise.iter();
        let factors = noise.filter_map(|own| Some(own.sigma / self.case.robot.sigma(own.kind)?));
        factors.fold(1.0, f64::max)
    }

    /// The same with its last step at the row where it fits best, and with the rows that agree with it.
    fn settled(&self, hypothesis: Hypothesis) -> Option<Fitted> {
        // A fit that has not converged continues where it was: no row is tried twice, or it would never end.
        let mut tried = vec![hypothesis.clone()];
        let mut best = self.fitted(hypothesis)?;
        loop {
            let scale = Scale::of([&best]);
            let mut others = self.beside(&best);
            others.retain(|own| !tried.contains(own));
            tried.extend(others.iter().cloned());
            let others = others.into_iter().filter_map(|own| self.fitted(own));
            match others.min_by(|a, b| a.score(scale).total_cmp(&b.score(scale))) {
                Some(next) if next.score(scale) < best.score(scale) => best = next,
                _ => return Some(self.restored(best)),
            }
        }
    }

    /// Its last step a row earlier and later, its drift a little faster and slower.
    fn beside(&self, best: &Fitted) -> Vec<Hypothesis> {
        let Some(step) = best.hypothesis.effects.last() else {
            return Vec::new();
        };
        let at = |index: usize| {
            let mut hypothesis = best.hypothesis.clone();
            *hypothesis.effects.last_mut()? = step.at(index);
            Some(hypothesis)
        };
        let fitted = |row: &usize| !best.hypothesis.rows.contains(row);
        let rows = (0..self.rows).filter(fitted).count();
        let indices = match step.kind {
            EffectKind::Move => LEAST_ROWS..=rows.saturating_sub(LEAST_ROWS),
            EffectKind::Slip => 1..=rows.saturating_sub(1),
            EffectKind::Drift => 0..=FASTEST,
            _ => return Vec::new(),
        };
        let beside = [step.index.checked_sub(1), Some(step.index + 1)];
        let beside = beside.into_iter().flatten().filter(|index| {
            let before = (0..*index).filter(|row| fitted(row) || !step.kind.is_step());
            indices.contains(&before.count())
        });
        beside.filter_map(at).collect()
    }

    /// States with all rows without those that disagree in a robust fit, where this leaves the least noise and leaves few out.
    fn without_rows(&self, states: &[Fitted], most: usize) -> Vec<Fitted> {
        let with_all = states.iter().filter(|own| own.hypothesis.rows.is_empty());
        let readings = self.case.readings.readings() as f64;
        let robust = with_all.filter_map(|own| {
            let (noise, rows) = Scan::of(&own.solution)?.suspected()?;
            let rows = self.original(own, Hypothesis::without(&rows));
            let both = own.hypothesis.and(&rows)?;
            let noise = noise * own.solution.noise.first()?.sigma;
            let score = 2.0 * readings * noise.natural_logarithm() + self.penalties(&both);
            Some((score, both))
        });
        let mut robust: Vec<_> = robust.collect();
        order::sort_by(&mut robust, |own| own.0);
        let robust = robust.into_iter().take(most);
        robust.filter_map(|own| self.settled(own.1)).collect()
    }

    /// The same with the rows that agree: a robust fit leaves out too many rather than too few. Of few rows each is tried alone,
    /// too: a fit to the others is far from right ones as well.
    fn restored(&self, mut best: Fitted) -> Fitted {
        if best.hypothesis.rows.is_empty() {
            return best;
        }
        for most in AGREEING {
            let mut before = usize::MAX;
            while best.hypothesis.rows.len() < before {
                before = best.hypothesis.rows.len();
                let off = self.off(&best);
                let mut rows = best.hypothesis.rows.clone();
                rows.retain(|row| off(*row).is_some_and(|own| own < most));
                drop(off);
                best = self.with(best, &rows);
            }
        }
        let few = self.rows <= OF_FEW_ROWS.0;
        let alone = best.hypothesis.rows.clone().into_iter();
        alone
            .filter(|_| few)
            .fold(best, |best, row| self.with(best, &[row]))
    }

    /// The same with these rows, if that is better.
    fn with(&self, best: Fitted, rows: &[usize]) -> Fitted {
        let mut fewer = best.hypothesis.clone();
        fewer.rows.retain(|row| !rows.contains(row));
        let is_new = fewer != best.hypothesis && fewer != Hypothesis::default();
        let fitted = is_new.then(|| self.fitted(fewer)).flatten();
        let scale = Scale::of([&best]);
        let better = fitted.filter(|own| own.score(scale) < best.score(scale));
        better.unwrap_or(best)
    }

    /// How far a row is from a fit, in σ; `None` for a distance.
    fn off<'b>(&self, best: &'b Fitted) -> impl Fn(usize) -> Option<f64> + use<'a, 'b> {
        let (robot, places) = (&best.solution.robot, &best.solution.places);
        let readings = of_platform_point(self.case.robot, self.case.readings, places.frame);
        let course = Course::of(robot, Platform::default(), places, &readings);
        move |row| {
            let reading = &readings.rows.get(row)?.value;
            let at = At::new(robot, &reading.joints)?;
            let effects = best.hypothesis.effects.iter();
            let moved = effects.filter_map(|own| {
                let by = &best.estimate(own)?.by;
                Some(own.displacement(&at, &course, row, by))
            });
            let there = at.position + moved.sum::<Vector3<f64>>();
            let off = match (reading.sample(), reading.height) {
                (Some(sample), _) => {
                    let seen = places.frame.map_or(there, |frame| frame.apply(&there));
                    (sample.position - seen).norm()
                }
                (None, Some((plane, height))) => {
                    let plane = places.planes.get(plane)?;
                    (height - (plane.normal.dot(&there) - plane.offset)).abs()
                }
                (None, None) => return None,
            };
            let noise = best.solution.noise.iter();
            let mut noise = noise.filter(|own| Some(own.kind) == reading.kind());
            Some(off / noise.next()?.sigma)
        }
    }

    /// A hypothesis about the rows that were fitted.
    fn original(&self, state: &Fitted, own: Hypothesis) -> Hypothesis {
        let fitted = |row: &usize| !state.hypothesis.rows.contains(row);
        let left: Vec<_> = (0..self.rows).filter(fitted).collect();
        let effects = own.effects.into_iter().map(|own| match own.kind {
            kind if kind.is_step() => own.at(left[own.index]),
            _ => own,
        });
        Hypothesis {
            effects: effects.collect(),
            rows: own.rows.into_iter().map(|row| left[row]).collect(),
            from: own.from,
        }
    }

    /// The best hypotheses of each kind beside those of a state, to first order.
    fn candidates(&self, state: &Fitted) -> Vec<Hypothesis> {
        let Some(scan) = Scan::of(&state.solution) else {
            return Vec::new();
        };
        let (of_targets, unstated) = self.of_targets(state);
        let mut kinds = self.gains(&scan, state.solution.rows.len());
        if !unstated.is_empty() {
            let gains = unstated.iter().filter_map(|own| scan.throughout(&[*own]));
            kinds.push(gains.collect());
        }
        let solution = &state.solution;
        // A noise that was widened may be more than the residuals need.
        let stated = if state.squares > 0.0 {
            solution.squares() / state.squares
        } else {
            1.0
        };
        let variance = solution.squares() / solution.degrees_of_freedom().max(1.0);
        let variance = variance.max(stated);
        let mut chosen: Vec<_> = of_targets
            .iter()
            .filter_map(|own| state.hypothesis.and(own))
            .collect();
        let gains = kinds.iter().flatten().map(|own| own.0);
        let least = WORTHWHILE * gains.fold(0.0, f64::max);
        let (few, of_few) = OF_FEW_ROWS;
        let most = if self.rows > few {
            OF_EACH_KIND
        } else {
            of_few
        };
        for mut gains in kinds {
            gains.retain(|own| own.0 > least);
            // Of a backlash, each set of joints gains at least as much as every part of it.
            order::sort_by(&mut gains, |(gain, own)| {
                self.penalties(own) - gain / variance
            });
            for (gain, hypothesis) in gains.into_iter().take(most) {
                if gain / variance > FIRST_ORDER * self.penalties(&hypothesis)
                    && let Some(both) = state.hypothesis.and(&self.original(state, hypothesis))
                {
                    chosen.push(both);
                }
            }
        }
        chosen
    }

    /// The gains of everything that may happen to so many rows, by its kind; of targets apart.
    fn gains(&self, scan: &Scan, count: usize) -> Vec<Vec<Gain>> {
        let drive = self.case.robot.robot.drive();
        let mut kinds: Vec<Vec<Gain>> = Vec::new();
        let throughout = |effects: &[Effect]| scan.throughout(effects);
        let stated = &self.case.robot.instruments;
        let common = stated.oversize.is_none().then_some(EffectKind::Oversize);
        // Several planes have a shape each, and that of a printer's bed is stated.
        let readings = self.case.readings;
        let one = readings.planes.len() == 1 && stated.bed.is_none() && !self.options.of_printer;
        let touched = |row: &&Row<Reading>| row.value.kind() == Some(Kind::Height);
        let touches = readings.rows.iter().filter(touched).count();
        let shown = one && touches >= TOUCHES_FOR_EACH * EffectKind::Bed.unknowns();
        let uneven = shown.then_some(EffectKind::Bed);
        for kind in EffectKind::all(drive).chain(common).chain(uneven) {
            let gains = match kind {
                EffectKind::Backlash => sets()
                    .filter_map(|set| {
                        let arms = ArmIndex::ALL.into_iter().filter(|arm| set[arm.index()]);
                        let effects: Vec<_> = arms.map(|arm| Effect::of_arm(kind, arm)).collect();
                        throughout(&effects)
                    })
                    .collect(),
                kind if kind.is_of_joint() => ArmIndex::ALL
                    .into_iter()
                    .filter_map(|arm| throughout(&[Effect::of_arm(kind, arm)]))
                    .collect(),
                kind => throughout(&[Effect::of(kind)]).into_iter().collect(),
            };
            kinds.push(gains);
        }
        if self.case.robot.tolerance.is_some() {
            let numbers = [
                EffectKind::Zeros,
                EffectKind::Gears,
                EffectKind::Forearm,
                EffectKind::UpperArm,
                EffectKind::Radius,
                EffectKind::Size,
            ];
            let turns = drive == Drive::Rotary;
            let numbers = numbers
                .into_iter()
                .filter(|kind| turns || !matches!(kind, EffectKind::Zeros | EffectKind::UpperArm));
            kinds.extend(numbers.map(|kind| throughout(&[Effect::of(kind)]).into_iter().collect()));
        }
        let slips = ArmIndex::ALL.map(|arm| {
            scan.steps(
                Effect::of_arm(EffectKind::Slip, arm),
                1..count.saturating_sub(1),
            )
        });
        kinds.push(slips.into_iter().flatten().collect());
        if count > 2 * LEAST_ROWS {
            let moves = scan.steps(
                Effect::of(EffectKind::Move),
                LEAST_ROWS..count - LEAST_ROWS + 1,
            );
            kinds.push(moves);
        }
        kinds.push(scan.rows());
        kinds
    }

    /// Targets whose stated places are doubtful, alone and in pairs; and those of which nothing is stated.
    fn of_targets(&self, state: &Fitted) -> (Vec<Hypothesis>, Vec<Effect>) {
        let count = self.case.readings.targets.len().max(1);
        let targets = (0..count).map(|index| Effect::of(EffectKind::Target).at(index));
        let known = |own: &Effect| state.estimate(own).is_some();
        let (stated, unstated): (Vec<_>, Vec<_>) = targets.partition(known);
        // In a sensor's own frame, where the only target is is where the frame is.
        let is_known =
            self.options.frame == Frame::Base || !self.case.robot.instruments.datum.is_empty();
        let placed = is_known || count > 1;
        let may_be = placed && self.case.robot.tolerance.is_some();
        let unstated = if may_be { unstated } else { Vec::new() };
        // What is stated of a target is among the unknowns: opening it frees them.
        let doubtful = |own: &&Estimated| {
            let each = own.by.iter().zip(&own.mean).zip(&own.sigma);
            let mut sigmas = each.map(|((by, mean), sigma)| (by - mean).abs() / sigma);
            sigmas.any(|own| own.is_finite() && (own > DOUBTFUL || placed && state.contradicts()))
        };
        let stated = stated.iter().filter_map(|own| state.estimate(own));
        let stated = stated.filter(doubtful);
        let stated: Vec<_> = stated.collect();
        // Two may have been exchanged.
        let pairs = stated.iter().enumerate().flat_map(|(index, own)| {
            let others = stated[..index].iter();
            others.map(move |other| {
                let from = [&*other.mean, &*own.mean].concat();
                Hypothesis::of(&[own.effect, other.effect], from)
            })
        });
        let alone = stated.iter();
        let alone = alone.map(|own| Hypothesis::of(&[own.effect], own.by.clone()));
        (alone.chain(pairs).collect(), unstated)
    }
}

/// All non-empty sets of the three arms.
fn sets() -> impl Iterator<Item = [bool; 3]> {
    (1_usize..8).map(|bits| [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0])
}
