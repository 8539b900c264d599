//! From readings to a solution: chooses the estimator and estimates noise that the robot file does not state.

use super::estimators::Task;
use super::jointly::jointly;
use super::observations::{SETTLED, USUAL_DISTANCE, is_stated, levels, tolerance};
use super::solution::{KindNoise, Levels, Solution, Unsolved};
use super::{Frame, Method, Options};
use crate::effects::Estimated;
use crate::files::{Kind, Readings, RobotFile};
use crate::halt;
use delta_cal::{Noise, Real, Refusal};
use statrs::function::gamma::ln_gamma;

/// Degrees of freedom of the typical noise of distances, known within a factor of 3 either way.
const USUAL_FREEDOM: f64 = 3.0;
/// Fewest degrees of freedom that can tell a noise without prior.
const LEAST_FREEDOM: f64 = 2.5;
/// The most likely σ of heights, mm, and the factors below and above it that are one σ of its logarithm: few touches are much better,
/// and those of rough beds much worse. Its degrees of freedom, with which stated bed errors are those of simulated printers.
pub(crate) const HEIGHTS: (f64, [f64; 2]) = (0.015, [2.0, 4.0]);
const HEIGHT_FREEDOM: f64 = 4.8;
const ROUNDS: u32 = 60;
/// A σ below this fraction of the forearm is rounding error.
const ROUNDING: f64 = 1e-11;
/// Shares of the joints in an unstated noise of positions, tried with at most this many rows and enough degrees of
/// freedom.
const JOINT_PARTS: [f64; 4] = [0.2, 0.5, 0.8, 0.95];
const MOST_ROWS_TRIED: usize = 1000;
const LEAST_FREEDOM_TRIED: f64 = 20.0;
/// Gain in log-likelihood that a share of the joints must bring.
const SHOWN: f64 = 2.0;

/// Calibrates the robot of a file from readings; the estimator follows from `options` and the file. σ of a kind of
/// reading that the robot file does not state is estimated from the residuals (evidence, MacKay 1992): with νₖ = nₖ −
/// tr(Jₖ C Jₖᵀ)
///
/// ```text
/// σₖ² ← (Σ rₖ² + ν₀ s₀²)/(νₖ + ν₀)
/// ```
///
/// s₀ and ν₀ are typical of such readings; coordinates have no typical value. The σ of heights is log-normal about s₀, with a
/// factor f below and another one above, of which this is the most likely:
///
/// ```text
/// Σ rₖ²/σₖ² − νₖ = ln(σₖ/s₀)/ln² f
/// ```
///
/// # Errors
/// Readings that do not determine the robot.
pub fn solve(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Result<Solution, Unsolved> {
    solve_with(robot, readings, options, (&[], true))
}

/// The same with effects opened beside those that the robot file states; if that is not strict, with a noise as large as the
/// readings need.
pub(crate) fn solve_with(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
    opened: (&[Estimated], bool),
) -> Result<Solution, Unsolved> {
    let alone = |readings: &Readings, frame, factor, height: Option<f64>| {
        let options = Options { frame, ..*options };
        if factor > 1.0 || height.is_some() {
            let mut robot = robot.with_noise_times(factor);
            let facts = &mut robot.instruments;
            let height = height.map(|own| own * factor);
            facts.height_noise = height.or(facts.height_noise);
            alone(&robot, &readings.clone().with_sigma_times(factor), &options)
        } else {
            alone(robot, readings, &options)
        }
    };
    jointly(robot, readings, options.frame, opened, alone).map(as_student)
}

/// Fits the robot and the instruments' places to readings without effects.
fn alone(robot: &RobotFile, readings: &Readings, options: &Options) -> Result<Solution, Unsolved> {
    let complete = readings.is_complete() && options.frame == Frame::Base;
    let weighted = readings.rows.iter().any(|row| row.value.sigma.is_some());
    let closures = complete && robot.transmission.is_none() && !options.robust && !weighted;
    let default = if closures { Method::Joint } else { Method::Fkm };
    let task = Task {
        robot,
        readings,
        method: options.method.unwrap_or(default),
        frame: options.frame,
        robust: options.robust,
        tolerance: tolerance(robot, options.frame),
    };
    let first = levels(robot).ok_or(Refusal::Unfinished)?;
    let solution = settled(&task, first)?;
    Ok(with_joints_part(&task, solution))
}

/// Solves until every unstated σ has converged.
fn settled(task: &Task<'_>, first: Levels) -> Result<Solution, Unsolved> {
    let [arm, ..] = task.robot.robot.arms();
    let least = ROUNDING * arm.lb();
    let mut levels = first;
    let mut last = Err(Unsolved::NoRedundancy);
    for _ in 0..ROUNDS {
        halt::check();
        let mut solution = match task.solve(&levels) {
            Ok(solution) => solution,
            Err(Unsolved::Refused(refusal)) => {
                // If σ starts too small, the residuals contradict it or the robot ends up far off.
                let factor = match refusal {
                    Refusal::ResidualContradictsNoise { ratio, .. } => f64::from(ratio).max(1.5),
                    Refusal::FarFromNominal { .. } | Refusal::NotConverged { .. } => 3.0,
                    _ => return Err(refusal.into()),
                };
                levels = match all_scaled(task, &levels, factor) {
                    Some(levels) if levels.position.position() < arm.lb() => levels,
                    _ => return Err(refusal.into()),
                };
                last = last.or(Err(refusal.into()));
                continue;
            }
            Err(error) => return Err(error),
        };
        let mut change: f64 = 0.0;
        for own in solution.noise.iter_mut().filter(|own| !own.stated) {
            let factor = next(own)?;
            if own.sigma * factor < least {
                continue;
            }
            change = change.max(factor.ln().abs());
            levels = one_scaled(&levels, own.kind, factor);
        }
        if change < SETTLED {
            return Ok(solution);
        }
        last = Ok(solution);
    }
    last
}

/// Factor for the next σ of a kind.
fn next(own: &mut KindNoise) -> Result<f64, Unsolved> {
    let (usual, worth) = match own.kind {
        Kind::Position => (0.0, 0.0),
        Kind::Height => (HEIGHTS.0, HEIGHT_FREEDOM),
        Kind::Distance => (USUAL_DISTANCE, USUAL_FREEDOM),
    };
    own.known = own.freedom + worth;
    if !(own.known > LEAST_FREEDOM) {
        return Err(Unsolved::NoRedundancy);
    }
    if own.kind == Kind::Height {
        // The core's logarithm, and no `powi` of a constant: a page in a browser computes the same bits.
        let [below, above] = HEIGHTS.1.map(|own| {
            let width = own.natural_logarithm();
            1.0 / (width * width)
        });
        let off = (own.sigma / HEIGHTS.0).natural_logarithm();
        // Newton's method, for the square of the factor.
        let mut square: f64 = 1.0;
        for _ in 0..ROUNDS {
            let squares = own.squares / square;
            let off = off + 0.5 * square.natural_logarithm();
            let tight = if off < 0.0 { below } else { above };
            let over = squares - own.freedom - tight * off;
            square += (over * square / (squares + 0.5 * tight)).max(-0.75 * square);
        }
        return Ok(square.sqrt());
    }
    let squares = own.squares + worth * (usual / own.sigma).powi(2);
    Ok((squares / own.known).sqrt())
}

/// Attributes a share of the positions' noise to the joints if that makes the residuals clearly more likely (restricted
/// likelihood, Patterson and Thompson 1971).
fn with_joints_part(task: &Task<'_>, even: Solution) -> Solution {
    let facts = &task.robot.instruments;
    let [own] = even.noise.as_slice() else {
        return even;
    };
    let open = own.kind == Kind::Position && !own.stated && facts.joint_noise.is_none();
    let few = task.readings.rows.len() <= MOST_ROWS_TRIED && own.freedom >= LEAST_FREEDOM_TRIED;
    if !(open && few) {
        return even;
    }
    let squares = task.readings.rows.iter().filter_map(|row| {
        let position = even.robot.forward(&row.value.joints).ok()?;
        let jacobian = even.robot.platform_jacobian(&position, &row.value.joints);
        Some(jacobian.ok()?.by_joints.norm_squared())
    });
    let squares: Vec<_> = squares.collect();
    let by_joint = (squares.iter().sum::<f64>() / (3.0 * squares.len() as f64)).sqrt();
    let sigma = own.sigma;
    let mut best = likelihood(&even).map_or(f64::INFINITY, |own| own + SHOWN);
    let mut chosen = even;
    for part in JOINT_PARTS {
        let Ok(noise) = Noise::new(sigma * (1.0 - part).sqrt(), sigma * part.sqrt() / by_joint)
        else {
            continue;
        };
        let levels = Levels {
            position: noise,
            ..chosen.levels
        };
        if let Ok(tried) = settled(task, levels)
            && let Some(own) = likelihood(&tried)
            && own > best
        {
            best = own;
            chosen = Solution {
                joint_noise_estimated: true,
                ..tried
            };
        }
    }
    chosen
}

/// −Σ log |Lₖ| − ½ Σ r² − ½ |U u|² + ½ log |C|, up to a constant.
fn likelihood(solution: &Solution) -> Option<f64> {
    let used: Vec<_> = (0..solution.covariance.nrows())
        .filter(|place| solution.covariance[(*place, *place)] > 0.0)
        .collect();
    let covariance = solution.covariance.select_rows(&used).select_columns(&used);
    let diagonal = covariance.cholesky()?.l_dirty().diagonal();
    let determinant: f64 = diagonal.iter().map(|entry| entry.ln()).sum();
    let found = determinant - 0.5 * solution.cost() - solution.log_spread;
    found.is_finite().then_some(found)
}

/// Applies the variances of Student's distribution where a noise is estimated: what comes from the readings has ν/(ν − 2)
/// times the variance of a known noise.
fn as_student(solution: Solution) -> Solution {
    let Some(freedom) = solution.estimated_freedom().filter(|own| *own > 2.0) else {
        return solution;
    };
    let mean = freedom / (freedom - 2.0);
    // E[σ]² of the same distribution.
    let gammas = ln_gamma(0.5 * (freedom - 1.0)) - ln_gamma(0.5 * freedom);
    let expected = 0.5 * freedom * (2.0 * gammas).exp();
    Solution {
        beyond_expected: (mean - expected) / mean,
        ..solution.widened(mean.sqrt())
    }
}

/// Scales the noise of positions and joints together.
fn scaled(noise: &Noise<f64>, factor: f64) -> Noise<f64> {
    let axes = noise.position_by_axis().map(|own| own * factor);
    Noise::by_axis(axes, noise.joint() * factor).unwrap_or(*noise)
}

fn one_scaled(levels: &Levels, kind: Kind, factor: f64) -> Levels {
    let mut levels = *levels;
    match kind {
        Kind::Position => levels.position = scaled(&levels.position, factor),
        Kind::Height => levels.height *= factor,
        Kind::Distance => levels.distance *= factor,
    }
    levels
}

/// Scales every unstated σ; `None` if all are stated.
fn all_scaled(task: &Task<'_>, levels: &Levels, factor: f64) -> Option<Levels> {
    let open = |kind: &Kind| !is_stated(task.robot, *kind) && task.readings.holds(*kind);
    let mut kinds = Kind::ALL.into_iter().filter(open).peekable();
    kinds.peek()?;
    Some(kinds.fold(*levels, |levels, kind| one_scaled(&levels, kind, factor)))
}
