//! One robot's boundary against another's.

use super::band::{displacement_to, predicted};
use super::influence::displacements;
use super::{Volume, Workspace};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

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

/// Compares two robots with the same limits.
pub fn compare(first: &Workspace, second: &Workspace) -> Comparison {
    let linear = displacements(first);
    let predicted: Vec<Option<f64>> = linear
        .iter()
        .map(|moved| Some(predicted(&first.robot, &second.robot, moved.as_ref()?)))
        .collect();
    let displacements: Vec<Option<f64>> = (0..first.points.len())
        .into_par_iter()
        .map(|index| {
            let (point, expected) = (&first.points[index], predicted[index].unwrap_or(0.0));
            let range = RANGE.max(expected.abs());
            displacement_to(
                first,
                (&second.robot, &second.reach),
                point,
                (expected, range),
            )
        })
        .collect();
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
