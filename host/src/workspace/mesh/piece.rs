//! The pieces of which a surface consists.

use nalgebra::Vector3;
use std::collections::BTreeMap;

/// A part of a surface that is not connected with the rest: about a separate region of the workspace, or about a
/// hollow in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// The volume inside, mm³; that of a hollow is negative.
    pub volume: f64,
    /// The mean of its triangles' centres, mm.
    pub centre: Vector3<f64>,
}

/// The volume inside, by the divergence theorem: Σ a·(b × c)/6.
pub(super) fn volume(triangles: impl Iterator<Item = [Vector3<f64>; 3]>) -> f64 {
    let mut triangles = triangles.peekable();
    // About a point nearby, so that less is cancelled.
    let centre = triangles
        .peek()
        .map(|corners| corners[0])
        .unwrap_or_default();
    triangles
        .map(|corners| corners.map(|corner| corner - centre))
        .map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0)
        .sum()
}

/// The triangles of the largest piece, and all other pieces, the largest first.
pub(super) fn apart(
    positions: &[Vector3<f64>],
    triangles: &[[usize; 3]],
) -> (Vec<usize>, Vec<Piece>) {
    let mut joined: Vec<usize> = (0..positions.len()).collect();
    for [a, b, c] in triangles {
        let roots = [*a, *b, *c].map(|corner| root(&mut joined, corner));
        let least = roots.into_iter().fold(usize::MAX, usize::min);
        for root in roots {
            joined[root] = least;
        }
    }
    let mut pieces: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, triangle) in triangles.iter().enumerate() {
        let piece = pieces.entry(root(&mut joined, triangle[0])).or_default();
        piece.push(number);
    }
    let corners = |number: &usize| triangles[*number].map(|corner| positions[corner]);
    let mut pieces: Vec<(Piece, Vec<usize>)> = pieces
        .into_values()
        .map(|numbers| {
            let centres = numbers
                .iter()
                .map(corners)
                .map(|[a, b, c]| (a + b + c) / 3.0);
            let count = numbers.iter().fold(0.0, |count, _| count + 1.0);
            let piece = Piece {
                volume: volume(numbers.iter().map(corners)),
                centre: centres.sum::<Vector3<f64>>() / count,
            };
            (piece, numbers)
        })
        .collect();
    pieces.sort_by(|a, b| b.0.volume.abs().total_cmp(&a.0.volume.abs()));
    let mut pieces = pieces.into_iter();
    let kept = pieces.next().map(|(_, numbers)| numbers);
    (
        kept.unwrap_or_default(),
        pieces.map(|(piece, _)| piece).collect(),
    )
}

fn root(joined: &mut [usize], mut at: usize) -> usize {
    while joined[at] != at {
        joined[at] = joined[joined[at]];
        at = joined[at];
    }
    at
}
