//! One robot's boundary against another's.

use super::band::{displacement_to, predicted};
use super::influence::displacements;
use super::{BoundaryPoint, Volume, Workspace};
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

/// The other boundary is searched for within this distance of where it is expected, or twice as far
/// as it moves, mm.
const RANGE: f64 = 2.0;

/// How the boundary moves from one robot to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// For each boundary point of the first robot, how far outwards along its normal the second
    /// robot's boundary is, mm; `None` where it is not near.
    pub displacements: Vec<Option<f64>>,
    /// The same to first order, from the parameters' difference, mm.
    pub predicted: Vec<Option<f64>>,
    /// rms over the boundary's area, mm.
    pub rms: f64,
    /// The largest outwards, and where: the index of its point.
    pub outwards: Option<(f64, usize)>,
    /// The largest inwards, and where.
    pub inwards: Option<(f64, usize)>,
    /// The first robot's volume.
    pub before: Volume,
    /// The second robot's volume.
    pub after: Volume,
}

/// How far outwards along the normals of these points of the first robot's boundary the second robot's is, mm;
/// found, and to first order.
pub fn displacements_to(
    first: &Workspace,
    points: &[BoundaryPoint],
    second: &Workspace,
) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
    let linear = displacements(first, points);
    let predicted: Vec<Option<f64>> = linear
        .iter()
        .map(|moved| Some(predicted(&first.robot, &second.robot, moved.as_ref()?)))
        .collect();
    let found = points.par_iter().zip(&predicted).map(|(point, predicted)| {
        let expected = predicted.unwrap_or(0.0);
        let other = (&second.robot, &second.reach);
        displacement_to(first, other, point, (expected, RANGE.max(expected.abs())))
    });
    (found.collect(), predicted)
}

/// Compares two robots with the same limits.
pub fn compare(first: &Workspace, second: &Workspace) -> Comparison {
    let (displacements, predicted) = displacements_to(first, &first.points, second);
    let (mut square, mut area) = (0.0, 0.0);
    let mut outwards: Option<(f64, usize)> = None;
    let mut inwards: Option<(f64, usize)> = None;
    for (index, (point, moved)) in first.points.iter().zip(&displacements).enumerate() {
        let Some(moved) = *moved else { continue };
        square += moved * moved * point.area;
        area += point.area;
        if outwards.is_none_or(|(most, _)| moved > most) {
            outwards = Some((moved, index));
        }
        if inwards.is_none_or(|(most, _)| moved < most) {
            inwards = Some((moved, index));
        }
    }
    Comparison {
        rms: (square / area).sqrt(),
        displacements,
        predicted,
        outwards,
        inwards,
        before: first.volume(),
        after: second.volume(),
    }
}
