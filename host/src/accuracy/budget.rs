//! The uncertainty budget: what each source contributes to the variance of a position over the workspace (JCGM 100:2008,
//! 5.1 and annex H).
//!
//! ```text
//! C⁻¹ = Σ Nₖ,   C = Σ C Nₖ C,   variance of a position = Σ tr(J C Nₖ C Jᵀ)
//! ```
//!
//! Nₖ is the information of a source: the readings, the tolerance, a target, datum points, a scale. C is that of the fit; what
//! noise is widened by after it counts for the readings.

use super::quantiles::median;
use super::uncertainty::{Sensitivities, Weights};
use crate::effects::{At, Course, Effect, EffectKind, Estimated, Platform};
use crate::files::{Kind, ONLY_TARGET, READINGS, RobotFile};
use crate::fit::jointly::columns_of;
use crate::fit::solution::{OF_ROBOT, Solution};
use crate::geometry::{NUMBERS, Parallelograms};
use crate::order;
use crate::text::joint;
use delta_cal::Sample;
use delta_cal::robot::Drive;
use nalgebra::{DMatrix, SMatrix, SVector};
use serde::Serialize;

/// What one source contributes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contribution {
    /// The source: `readings`, `joint readings`, `causes`, `tolerance`, `planes and points`, `scale`, `datum`, `target` or
    /// the name of a target.
    pub source: String,
    /// How its σ was evaluated: `A` by statistics of these readings, `B` otherwise (JCGM 100:2008, 3.3.4).
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Its σ, in the unit; `None` where it has several.
    pub sigma: Option<f64>,
    /// `mm`, `deg`, or nothing of a ratio.
    pub unit: &'static str,
    /// σ of a position in the frame of the base due to it, rms over the workspace, mm.
    pub absolute_mm: f64,
    /// Its share of the variance, 0 to 1.
    pub absolute_share: f64,
    /// The same for relative positions.
    pub relative_mm: f64,
    /// Its share of the variance.
    pub relative_share: f64,
    /// σ of a position if the source were exact; `None` for readings and tolerance.
    pub without_absolute_mm: Option<f64>,
    /// The same for relative positions.
    pub without_relative_mm: Option<f64>,
}

/// The budget over the poses of these weights, largest contribution to the absolute error first; to the relative error if
/// the robot's place is not measured.
pub(crate) fn budget(
    solution: &Solution,
    robot: &RobotFile,
    [absolute, relative]: &Weights,
) -> Vec<Contribution> {
    let estimated = solution.estimated_freedom().is_some();
    let mut datum = robot.instruments.datum.iter();
    let of_misfit = datum.any(|own| own.sigma.is_none());
    let covariance = &solution.covariance;
    let own = solution.robot_unknowns();
    let mean = |part: &DMatrix<f64>| {
        let part = solution.robots(part);
        [absolute, relative].map(|weights| weights.dot(&part).max(0.0))
    };
    let total = mean(covariance);
    let of_fit = solution.covariance_of_fit();
    let sandwich = |information: &DMatrix<f64>| mean(&(&of_fit * information * &of_fit));
    let mut sources: Vec<(String, [f64; 2], Option<[f64; 2]>)> = Vec::new();
    let readings = mean(&solution.of_readings);
    let [joints, all] = of_readings(solution).map(|own| sandwich(&own));
    let share = |kind: usize| (joints[kind] / all[kind]).clamp(0.0, 1.0);
    let by_joints =
        [0, 1].map(|kind| readings[kind] * if all[kind] > 0.0 { share(kind) } else { 0.0 });
    let by_readings = [0, 1].map(|kind| readings[kind] - by_joints[kind]);
    sources.push(("readings".to_owned(), by_readings, None));
    sources.push(("joint readings".to_owned(), by_joints, None));
    if let Some(of_causes) = &solution.of_causes {
        sources.push((CAUSES.to_owned(), mean(of_causes), None));
    }
    let information = solution.prior.tr_mul(&solution.prior);
    let effects = solution
        .effects
        .first()
        .map_or(covariance.nrows(), |own| own.first);
    let block = |places| block(&information, &places);
    sources.push(("tolerance".to_owned(), sandwich(&block(0..own)), None));
    sources.push((
        "planes and points".to_owned(),
        sandwich(&block(own..effects)),
        None,
    ));
    let exact = |places: std::ops::Range<usize>| {
        let size = places.len();
        let cross = covariance.columns(places.start, size).into_owned();
        let inverse = covariance
            .view((places.start, places.start), (size, size))
            .into_owned()
            .try_inverse()?;
        Some(mean(&(covariance - &cross * inverse * cross.transpose())))
    };
    let mut others = block(effects..covariance.nrows());
    for effect in solution
        .effects
        .iter()
        .filter(|own| own.effect.kind != EffectKind::Datum)
    {
        let mut stated = DMatrix::zeros(covariance.nrows(), covariance.ncols());
        for (place, sigma) in effect.places().zip(&effect.sigma) {
            if *sigma > 0.0 {
                stated[(place, place)] = sigma.powi(-2);
            }
        }
        others -= &stated;
        let name = source_of(solution, effect);
        sources.push((name, sandwich(&stated), exact(effect.places())));
    }
    if let Some(datum) = solution.effect(EffectKind::Datum) {
        sources.push(("datum".to_owned(), sandwich(&others), exact(datum.places())));
    }
    let own = usize::from(!solution.is_absolute());
    sources.retain(|(_, parts, _)| (0..2).any(|kind| parts[kind] > LEAST * total[kind]));
    order::sort_by(&mut sources, |(_, parts, _)| -parts[own]);
    let line = |(source, [absolute, relative], exact): (String, [f64; 2], Option<[f64; 2]>)| {
        Contribution {
            kind: match source.as_str() {
                CAUSES => "A",
                "datum" if of_misfit => "A",
                own if estimated && own.ends_with("readings") => "A",
                _ => "B",
            },
            sigma: sigma(solution, robot, &source),
            unit: unit(robot, &source),
            source,
            absolute_mm: absolute.sqrt(),
            absolute_share: absolute / total[0],
            relative_mm: relative.sqrt(),
            relative_share: relative / total[1],
            without_absolute_mm: exact.map(|own| own[0].sqrt()),
            without_relative_mm: exact.map(|own| own[1].sqrt()),
        }
    };
    sources.into_iter().map(line).collect()
}

/// What rods made to this tolerance, which the fit does not know of, add to σ of a position: absolute and relative, median over
/// these poses, mm.
///
/// ```text
/// δu = C Aᵀ E a,   δX = (J C Aᵀ E − E_tool) a
/// ```
pub(crate) fn unmodelled(
    solution: &Solution,
    robot: &RobotFile,
    rods: Parallelograms,
    poses: Vec<Sample<f64>>,
) -> Option<[f64; 2]> {
    let readings = &solution.readings;
    let tilting = RobotFile {
        parallelograms: Some(rods),
        ..robot.clone()
    };
    let platform = Platform::of(&tilting, &readings.targets);
    let course = Course::of(&solution.robot, platform, &solution.places, readings);
    let effect = Effect::of(EffectKind::Tilt);
    let effects = [Estimated::new(
        effect,
        vec![0.0; NUMBERS],
        rods.sigmas().to_vec(),
    )];
    let every = solution.rows.len() as f64 / (solution.sensitivities.len() as f64).max(1.0);
    let mut absorbed = DMatrix::zeros(solution.covariance.nrows(), NUMBERS);
    for own in &solution.sensitivities {
        let weight = every * solution.rows[own.row].weight;
        let columns = columns_of(solution, readings, &course, &effects, own);
        absorbed += own.by_unknowns.tr_mul(&columns) * weight;
    }
    let absorbed = &solution.covariance * absorbed;
    let places = solution.robot_places();
    let by_robot = SMatrix::<f64, OF_ROBOT, NUMBERS>::from_fn(|own, number| {
        places[own].map_or(0.0, |place| absorbed[(place, number)])
    });
    let tool = robot.tool();
    let all = Sensitivities::<OF_ROBOT>::of(&solution.robot, &tool, poses);
    let moved = all.0.into_iter().filter_map(|(pose, jacobian)| {
        let at = (&pose.position, &pose.joints);
        let own = rods.columns(&solution.robot, at, &tool.place)?;
        Some((pose, jacobian * by_robot - own))
    });
    let moved = Sensitivities::<NUMBERS>(moved.collect());
    let sigmas = SMatrix::<f64, NUMBERS, NUMBERS>::from_diagonal(&SVector::from(rods.sigmas()));
    // Near a singularity of its rotation the platform turns far.
    let typical = |own: &Sensitivities<NUMBERS>| {
        let each = own.0.iter();
        median(each.map(|(_, own)| (own * sigmas).norm()))
    };
    Some([typical(&moved)?, typical(&moved.relative()?)?])
}

/// The part of a matrix that belongs to these unknowns; 0 elsewhere.
fn block(of: &DMatrix<f64>, places: &std::ops::Range<usize>) -> DMatrix<f64> {
    DMatrix::from_fn(of.nrows(), of.ncols(), |row, column| {
        if places.contains(&row) && places.contains(&column) {
            of[(row, column)]
        } else {
            0.0
        }
    })
}

fn unit(robot: &RobotFile, source: &str) -> &'static str {
    match source {
        "joint readings" if robot.robot.drive() == Drive::Rotary => "deg",
        "scale" => "",
        _ => "mm",
    }
}

/// σ of a source, if it is one number: mm, degrees or a ratio.
fn sigma(solution: &Solution, robot: &RobotFile, source: &str) -> Option<f64> {
    let noise = solution.levels.position;
    match source {
        "readings" => {
            let only = solution.readings.only_kind() == Some(Kind::Position);
            only.then(|| noise.position())
        }
        "joint readings" => Some(joint::in_file(robot.robot.drive(), noise.joint())),
        "tolerance" => robot.tolerance.map(|own| own.length()),
        "datum" => {
            let datum = robot.instruments.datum.iter();
            let all: Option<Vec<_>> = datum.map(|own| own.sigma).collect();
            let all = all.filter(|all| !all.is_empty())?;
            Some((all.iter().map(|own| own * own).sum::<f64>() / all.len() as f64).sqrt())
        }
        other => {
            let mut effects = solution.effects.iter();
            let own = effects.find(|own| source_of(solution, own) == other)?;
            // Lengths and angles have no σ in common.
            if own.effect.kind == EffectKind::Tilt {
                return None;
            }
            let squares = own.sigma.iter().map(|own| own * own).sum::<f64>();
            Some((squares / own.sigma.len().max(1) as f64).sqrt())
        }
    }
}

/// The name of an effect as a source.
fn source_of(solution: &Solution, effect: &Estimated) -> String {
    match effect.effect.kind {
        EffectKind::Target => match solution.readings.targets.get(effect.effect.index) {
            Some(name) if name != ONLY_TARGET => format!("target {name}"),
            _ => ONLY_TARGET.to_owned(),
        },
        kind => kind.name().to_owned(),
    }
}

/// What the model cannot represent, as far as it displaces the robot.
const CAUSES: &str = "causes";
/// A smaller share of the variance is not listed.
const LEAST: f64 = 1e-4;

/// The joints' part of the readings' information, and all of it.
///
/// A whitened row has the covariance I = Lᵀ⁻¹(σ² + σq² Jq Jqᵀ)L⁻¹; the second term is the joints' part.
fn of_readings(solution: &Solution) -> [DMatrix<f64>; 2] {
    let size = solution.covariance.nrows();
    let joint = solution.levels.position.joint();
    let (mut of_joints, mut of_all) = (DMatrix::zeros(size, size), DMatrix::zeros(size, size));
    for own in &solution.sensitivities {
        let row = &solution.readings.rows[own.row].value;
        let poses = row.poses().into_iter().zip(&own.by_positions);
        of_all += own.by_unknowns.tr_mul(&own.by_unknowns);
        for (joints, by_position) in poses {
            let at = joints.and_then(|joints| At::new(&solution.robot, &joints));
            let Some(at) = at else { continue };
            let by_position = SMatrix::<f64, READINGS, 3>::from_fn(|r, axis| by_position[r][axis]);
            let noise = by_position * at.by_joints * joint;
            let shown =
                own.by_unknowns
                    .tr_mul(&DMatrix::from_column_slice(READINGS, 3, noise.as_slice()));
            of_joints += &shown * shown.transpose();
        }
    }
    [of_joints, of_all]
}
