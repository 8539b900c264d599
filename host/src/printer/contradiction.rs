//! Readings and statements of a printer that contradict each other.

use super::area::{Touched, off};
use crate::accuracy::information::prior;
use crate::accuracy::uncertainty::jacobian;
use crate::calibration::Refused;
use crate::effects::EffectKind;
use crate::files::robot_file::Tool;
use crate::files::samples_file::{Kind, Reading};
use crate::fit::observations::{USUAL_DISTANCE, USUAL_HEIGHT, USUAL_TOUCH};
use crate::fit::solution::{OF_ROBOT, PARAMETERS, RowFit, of_parameters};
use crate::fit::{HEIGHTS, Options, Solution, solve};
use crate::geometry::range;
use crate::import::Imported;
use crate::order;
use crate::text::rounded;
use delta_cal::robot::{Arm, Drive};
use delta_cal::{Real, Robot};
use nalgebra::{DMatrix, DVector, SVector, Vector3};

/// Noise so many times the usual is doubtful.
pub(crate) const DOUBTFUL: f64 = 3.0;
/// One reading of so many may contradict the others; of touches alone two at most, for which of three is chance.
const READINGS_FOR_ONE: usize = 8;
/// The readings without which the noise is at most this part of itself explain it, with few degrees of freedom for each of
/// these: simulated printers with rough beds are then never refused (of 560), and 0.4 mm are found in 16 touches (266 of 280).
const EXPLAINED: f64 = 1.0 / 3.0;
const EXPLAINED_FOR_EACH: f64 = 0.1;

/// The largest noise of the kinds of readings, in usual ones.
pub(crate) fn lack_of_fit(solution: &Solution) -> f64 {
    let shaped = solution.effect(EffectKind::Bed).is_some();
    let kinds = solution.noise.iter().filter_map(|own| {
        let usual = match own.kind {
            Kind::Position => return None,
            Kind::Height if shaped => USUAL_TOUCH,
            Kind::Height => USUAL_HEIGHT,
            // Of printed lengths, whose calliper is known.
            Kind::Distance if own.stated => own.sigma,
            Kind::Distance => USUAL_DISTANCE,
        };
        let widening = (own.squares / own.freedom.max(1.0)).sqrt().max(1.0);
        Some(own.sigma * widening / usual)
    });
    kinds.fold(0.0, f64::max)
}

/// What the configuration calls the reading that fits worst.
pub(crate) fn worst_reading(imported: &Imported, solution: &Solution) -> Option<String> {
    let measured = imported.readings.rows.len() - imported.held;
    let furthest = furthest(solution).filter(|own| *own < measured)?;
    imported.names.get(furthest).cloned()
}

/// The reading without which the squared residuals shrink most.
fn furthest(solution: &Solution) -> Option<usize> {
    let explains = |own: &RowFit| {
        let readings = own.whitened.iter().zip(&own.leverage);
        let squares = readings.map(|(own, leverage)| own * own / (1.0 - leverage));
        own.weight * squares.sum::<f64>()
    };
    let rows = solution.rows.iter().map(explains).enumerate();
    let furthest = rows.max_by(|(_, one), (_, other)| one.total_cmp(other));
    furthest.map(|(index, _)| index)
}

/// The names of readings that alone make the noise doubtful, and the noise of the others, in usual ones.
pub(crate) fn contradicting(
    imported: &Imported,
    solution: &Solution,
) -> Option<(Vec<String>, f64)> {
    let first = lack_of_fit(solution);
    let (mut others, mut solution) = (imported.clone(), solution.clone());
    let (mut names, mut kinds) = (Vec::new(), Vec::new());
    let measured = imported.readings.rows.len() - imported.held;
    let most = measured / READINGS_FOR_ONE;
    let alone = imported.counts()[1] == 0;
    for _ in 0..=if alone { most.min(1) } else { most } {
        let index = furthest(&solution).filter(|own| *own < measured - names.len())?;
        kinds.push(others.readings.rows.remove(index).value.kind()?);
        names.push(others.names.remove(index));
        solution = solve(&others.robot, &others.readings, &Options::default()).ok()?;
        let own = solution
            .noise
            .iter()
            .filter(|own| kinds.contains(&own.kind));
        let freedom = own.map(|own| own.freedom).fold(f64::INFINITY, f64::min);
        let left = lack_of_fit(&solution);
        let explained = first * EXPLAINED.min(EXPLAINED_FOR_EACH * freedom);
        if left < DOUBTFUL.min(explained) {
            return Some((names, left));
        }
    }
    None
}

/// One touch of so many may be bad; of more, one does not decide.
const TOUCHES: std::ops::RangeInclusive<usize> = 6..=30;
/// How often a touch is bad, and σ of what it is off then, mm.
const OFTEN: f64 = 0.007;
const BADLY: f64 = 1.0;
/// How far a printer is off its configuration if it was never calibrated and if it was, in tolerances, and the factors of the noise
/// below and above the usual; σ of the height that all touches have in common, mm.
const PRINTERS: [(f64, [f64; 2]); 2] = [(1.0, HEIGHTS.1), (0.01, [2.0, 2.5])];
const COMMON: f64 = 0.3;
/// End stops are alike to this, mm.
const ALIKE: f64 = 1e-6;
/// Levels of the noise, each half a σ of its logarithm from the next, to either side of the usual.
const LEVELS: u8 = 4;
/// A second touch is named if its odds are so much less at most, as a logarithm.
const AS_LIKELY: f64 = 2.3;

/// ln(eᵃ + eᵇ).
fn log_sum(a: f64, b: f64) -> f64 {
    a.max(b) + (1.0 + (-(a - b).abs()).exp()).natural_logarithm()
}

/// The covariance J P Jᵀ of what these touches of a printer within the tolerance are off.
fn spread(imported: &Imported, touches: &[Touched]) -> Option<DMatrix<f64>> {
    let (robot, own) = (&imported.robot, &imported.configured);
    let by_errors = touches.iter().map(|(row, ..)| {
        let Reading { joints, target, .. } = imported.readings.rows.get(*row)?.value;
        let at = own.forward(&joints).ok()?;
        let target = robot.instruments.targets.get(target);
        let tool = Tool {
            place: target.map_or_else(Vector3::zeros, |own| own.place),
            ..robot.tool()
        };
        let jacobian = jacobian::<OF_ROBOT>(own, &tool, &at, &joints)?;
        Some(jacobian.row(2).transpose())
    });
    let by_errors: Vec<_> = by_errors.collect::<Option<_>>()?;
    let prior = prior(robot)?;
    let between = |a: usize, b: usize| by_errors[a].dot(&(prior * by_errors[b]));
    Some(DMatrix::from_fn(touches.len(), touches.len(), between))
}

/// ln p(y), and of each touch v and d.
type Hypothesis = (f64, DVector<f64>, DVector<f64>);

/// Of each touch the logarithm of the odds that it is bad, against none being so, and how far it is off what the others expect, mm.
/// Whether the printer was calibrated, so that it is off by t tolerances, and the noise σ, which is log-normal, are unknown: sums over
/// both. With what touches are off, y, and S = t² J P Jᵀ + σ² + the common height's variance,
///
/// ```text
/// ln p(y) = −½ yᵀ S⁻¹ y − ½ ln |S|
/// ```
///
/// and if touch i is off by N(0, s²) besides, with v = 1 / (S⁻¹)ᵢᵢ and d = v (S⁻¹ y)ᵢ, its distance from what the others expect,
/// this is larger by
///
/// ```text
/// ½ ln v/(v + s²) + d²/2v − d²/2(v + s²)
/// ```
fn hypotheses(imported: &Imported, touches: &[Touched]) -> Option<Vec<Hypothesis>> {
    let y = DVector::from_iterator(touches.len(), touches.iter().map(|own| own.2));
    let of_errors = spread(imported, touches)?;
    let mut found = Vec::new();
    // End stops that are all alike were never calibrated.
    let (low, high) = range(imported.home);
    let printers = if high - low < ALIKE { 1 } else { 2 };
    let sides =
        PRINTERS.map(|(part, [below, above])| [(part, 1.0 / below.sqrt()), (part, above.sqrt())]);
    for (part, factor) in sides.into_iter().take(printers).flatten() {
        let mut noise = HEIGHTS.0;
        for level in 0..=LEVELS {
            let widths = 0.5 * f64::from(level);
            let mut spread = (&of_errors * (part * part)).add_scalar(COMMON * COMMON);
            for place in 0..touches.len() {
                spread[(place, place)] += noise * noise;
            }
            let root = spread.cholesky()?;
            let weighed = root.solve(&y);
            let diagonal = root.l_dirty().diagonal();
            let logarithms = diagonal.iter().map(|own| own.natural_logarithm());
            // The distance of two levels in ln σ weighs them.
            let all = factor.natural_logarithm().abs().natural_logarithm()
                - 0.5 * (widths * widths + y.dot(&weighed))
                - logarithms.sum::<f64>();
            let inverse = root.inverse();
            let variances = inverse.diagonal().map(|own| 1.0 / own);
            let off = variances.component_mul(&weighed);
            found.push((all, variances, off));
            noise *= factor;
        }
    }
    Some(found)
}

/// The odds of a touch and how far it is off, as [`hypotheses`] says, if it were further off by so much: the exponent of p(y) then
/// is less by ((d + by)² − d²)/2v.
fn odds(hypotheses: &[Hypothesis], place: usize, by: f64) -> [f64; 2] {
    let (mut none, mut any, mut most) = (
        f64::NEG_INFINITY,
        f64::NEG_INFINITY,
        [f64::NEG_INFINITY, 0.0],
    );
    for (all, variances, off) in hypotheses {
        let (variance, own) = (variances[place], off[place]);
        let moved = own + by;
        let wide = variance + BADLY * BADLY;
        let all = all - 0.5 * (moved * moved - own * own) / variance;
        none = log_sum(none, all);
        let gain = (OFTEN * OFTEN * variance / wide).natural_logarithm()
            + moved * moved * (1.0 / variance - 1.0 / wide);
        let bad = all + 0.5 * gain;
        any = log_sum(any, bad);
        if bad > most[0] {
            most = [bad, moved];
        }
    }
    [any - none, most[1]]
}

/// The touches of which one may decide; the end stops of arms that motors turn make a bowl.
fn deciding(imported: &Imported) -> Option<Vec<Touched>> {
    let towers = imported.configured.drive() == Drive::Linear;
    Some(off(imported)).filter(|own| towers && TOUCHES.contains(&own.len()))
}

/// Errors of a touch that are tried, mm: the least, the most, and each so many times the last.
const TRIED: [f64; 3] = [0.1, 5.0, 1.2];
/// As many touches as are proposed.
const ENOUGH: usize = 16;
/// Less is not worth mention, mm.
const UNNOTICED: f64 = 0.25;

/// What is to be known of few touches: how far off one of them may be and not be called bad.
pub(super) fn unnoticed(imported: &Imported) -> Option<String> {
    let touches = deciding(imported)?;
    let hypotheses = hypotheses(imported, &touches)?;
    let mut most = TRIED[0];
    for place in 0..touches.len() {
        for sign in [1.0, -1.0] {
            while most < TRIED[1] && odds(&hypotheses, place, sign * most)[0] < 0.0 {
                most *= TRIED[2];
            }
        }
    }
    (most > UNNOTICED).then(|| {
        let (count, more) = (touches.len(), ": touch 16 places");
        let more = if count < ENOUGH { more } else { "" };
        format!("Of {count} touches, one that is off by up to {most:.1} mm may go unnoticed{more}.")
    })
}

/// The refusal of touches of which one decides, so that it has to be touched again before any line is pasted.
pub(crate) fn bad_touch(imported: &Imported) -> Option<Refused> {
    let touches = deciding(imported)?;
    let hypotheses = hypotheses(imported, &touches)?;
    let odds = (0..touches.len()).map(|place| odds(&hypotheses, place, 0.0));
    let odds: Vec<_> = odds.collect();
    let any = odds.iter().map(|own| own[0]);
    if any.fold(f64::NEG_INFINITY, log_sum) < 0.0 {
        return None;
    }
    let mut likely: Vec<_> = touches.iter().zip(odds).collect();
    order::sort_by(&mut likely, |(_, [odds, _])| -odds);
    let least = likely.first()?.1[0] - AS_LIKELY;
    let likely = likely.iter().take(2).filter(|(_, [odds, _])| *odds > least);
    let named = likely.filter_map(|((row, at, _), [_, by])| {
        let name = imported.names.get(*row)?;
        Some(format!(
            "{name}, at x {:.0}, y {:.0} mm, is {by:+.2} mm off",
            at.x, at.y
        ))
    });
    let named = named.collect::<Vec<_>>().join(", or ");
    Some(Refused::new(
        format!("One touch decides: {named} what the other touches expect."),
        "Clean bed and nozzle, and touch that place again. If it is the same again, touch four more places around it.",
    ))
}

/// What is stated is contradicted by so many σ.
const CONTRADICTED: f64 = 3.0;
/// Index of the rod among an arm's parameters.
const LB: usize = 7;

/// The refusal of a stated length of the rods, or radius, that the distances contradict.
pub(crate) fn contradicted_length(imported: &Imported, solution: &Solution) -> Option<Refused> {
    let [_, distances] = imported.counts();
    if distances == 0 || imported.robot.robot.drive() == Drive::Rotary {
        return None;
    }
    let (rods, radius) = imported.stated;
    let of = |stated, rods| contradicted(imported, solution, rods).filter(|_| stated);
    Some(Refused::new(
        of(rods, true).or_else(|| of(radius, false))?,
        "Measure it again, between the joints of a rod or from the towers' axis to that of the platform's joints. If it is \
         right, the distances share an error: state --shrinkage.",
    ))
}

/// The stated mean length of the rods, or radius, and what the readings alone say of it, in words, if these contradict each
/// other. With its variances p before and v after the readings, a change d between the two is expected to have the variance
/// p − v, and the readings alone say a change of d p/(p − v), with the variance p v/(p − v).
fn contradicted(imported: &Imported, solution: &Solution, rods: bool) -> Option<String> {
    let robot = &imported.robot;
    let length = |arm: &Arm<f64>| if rods { arm.lb() } else { arm.d().xy().norm() };
    let mean = |robot: &Robot<f64>| robot.arms().iter().map(length).sum::<f64>() / 3.0;
    let [own, found] = [&robot.robot, &solution.robot].map(mean);
    let mut by_parameters = SVector::<f64, PARAMETERS>::zeros();
    for (index, arm) in robot.robot.arms().iter().enumerate() {
        if rods {
            by_parameters[8 * index + LB] = 1.0 / 3.0;
        } else {
            let out = arm.d().xy().normalize() / 3.0;
            by_parameters.fixed_rows_mut::<2>(8 * index).copy_from(&out);
        }
    }
    let [before, after] = [of_parameters(&prior(robot)?), solution.of_parameters()]
        .map(|covariance| by_parameters.dot(&(covariance * by_parameters)));
    let learnt = before - after;
    ((found - own).abs() > CONTRADICTED * learnt.sqrt()).then(|| {
        let is = own + (found - own) * before / learnt;
        let (own, sigma) = (rounded(own), (before * after / learnt).sqrt());
        let option = if rods {
            "--rods states rods"
        } else {
            "--radius states a radius"
        };
        format!("{option} of {own} mm; the distances say {is:.1} ± {sigma:.1} mm.")
    })
}
