//! Poses to validate with: at random, and none that the calibration used.

use super::request::PlanRequest;
use super::selection::Selection;
use super::setup::{Planned, Setup};
use super::{Kind, LEAST, MOST, PlanError};
use rand_core::SeedableRng;
use rand_pcg::Pcg32;

/// A pose is another one if some joint differs by more than this fraction of its range.
const APART: f64 = 0.02;
/// Draws for each pose, at most.
const DRAWS: usize = 20;

/// Positions to measure at the request's number of random poses, other than those at these joints (radians, mm).
///
/// # Errors
/// An impossible number, or a region out of reach.
pub fn others(request: &PlanRequest<'_>, used: &[[f64; 3]]) -> Result<Vec<Planned>, PlanError> {
    if !(LEAST..=MOST).contains(&request.count) {
        return Err(PlanError::Count(request.count));
    }
    let mut rng = Pcg32::seed_from_u64(request.seed);
    let selection = Selection::new(request.robot, request.region);
    let setup = Setup::of(request, None);
    let limits = &request.robot.limits;
    let least = APART * (limits.maximum() - limits.minimum());
    let is_other = |joints: &[f64; 3]| {
        let near = |own: &[f64; 3]| (0..3).all(|joint| (own[joint] - joints[joint]).abs() <= least);
        !used.iter().any(near)
    };
    let mut poses = selection.draw_many(DRAWS * request.count, &mut rng)?;
    poses.retain(|pose| is_other(&pose.joints) && setup.is_above_planes(&pose.position));
    poses.truncate(request.count);
    if poses.len() < request.count {
        return Err(PlanError::NoPose);
    }
    let targets = (0..setup.targets.len().max(1)).cycle();
    let planned = targets.zip(&poses);
    Ok(planned
        .map(|(target, pose)| setup.planned(Kind::XYZ, target, pose))
        .collect())
}

/// The same measurements with names, a prefix and a number, and repeated so many times, one round after another.
pub fn labelled(mut rows: Vec<Planned>, prefix: Option<&str>, repeats: usize) -> Vec<Planned> {
    let again =
        rows.len() > 1 && rows.first().map(|own| own.joints) == rows.last().map(|own| own.joints);
    if repeats > 1 && again {
        rows.pop();
    }
    let width = rows.len().to_string().len();
    if let Some(prefix) = prefix.or((repeats > 1).then_some("P")) {
        for (number, row) in (1..).zip(&mut rows) {
            row.name = Some(format!("{prefix}{number:0width$}"));
        }
    }
    if repeats <= 1 {
        return rows;
    }
    let rounds = (1..=repeats).flat_map(|round| {
        rows.iter().map(move |row| Planned {
            repeat: Some(round),
            ..row.clone()
        })
    });
    rounds.collect()
}
