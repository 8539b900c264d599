//! The order in which poses are visited.

use delta_cal::Sample;

/// First poses that are tried.
const STARTS: usize = 24;
/// An exchange that saves less than this, radians, saves nothing.
const NOTHING: f64 = 1e-9;

/// From one pose to the next, radians: what the joint that moves furthest moves. All joints move at
/// the same time.
pub fn distance(from: &Sample<f64>, to: &Sample<f64>) -> f64 {
    from.joints
        .iter()
        .zip(&to.joints)
        .map(|(from, to)| (to - from).abs())
        .fold(0.0, f64::max)
}

/// Through all poses in their order, radians.
pub fn length(poses: &[Sample<f64>]) -> f64 {
    poses
        .windows(2)
        .map(|pair| distance(&pair[0], &pair[1]))
        .sum()
}

/// The poses in an order that is short to travel: always on to the nearest, then parts of the way
/// turned round as long as that makes it shorter (2-opt; Croes 1958). From several first poses, and
/// the shortest of these ways.
pub fn ordered(poses: &[Sample<f64>]) -> Vec<Sample<f64>> {
    ordered_by(poses, |pose| pose)
}

/// The same of anything that is done at a pose.
pub(in crate::planning) fn ordered_by<T: Clone>(
    stops: &[T],
    pose: impl Fn(&T) -> &Sample<f64>,
) -> Vec<T> {
    let apart = |from: &T, to: &T| distance(pose(from), pose(to));
    let length = |way: &[T]| -> f64 { way.windows(2).map(|pair| apart(&pair[0], &pair[1])).sum() };
    let stride = stops.len().div_ceil(STARTS).max(1);
    (0..stops.len())
        .step_by(stride)
        .map(|first| {
            let mut way = nearest_first(stops, first, apart);
            turn_round(&mut way, apart);
            way
        })
        .min_by(|a, b| length(a).total_cmp(&length(b)))
        .unwrap_or_default()
}

fn nearest_first<T: Clone>(stops: &[T], first: usize, apart: impl Fn(&T, &T) -> f64) -> Vec<T> {
    let mut left = stops.to_vec();
    let mut here = left.swap_remove(first);
    let mut way = vec![here.clone()];
    while let Some(next) =
        (0..left.len()).min_by(|a, b| apart(&here, &left[*a]).total_cmp(&apart(&here, &left[*b])))
    {
        here = left.swap_remove(next);
        way.push(here.clone());
    }
    way
}

/// Until no part of the way is shorter turned round.
fn turn_round<T>(way: &mut [T], apart: impl Fn(&T, &T) -> f64) {
    let step = |way: &[T], from: Option<usize>, to: usize| match (
        from.and_then(|from| way.get(from)),
        way.get(to),
    ) {
        (Some(from), Some(to)) => apart(from, to),
        // The way is open: nothing leads to its first pose or from its last.
        _ => 0.0,
    };
    let mut shorter = true;
    while shorter {
        shorter = false;
        for first in 0..way.len() {
            for last in first + 1..way.len() {
                let before = first.checked_sub(1);
                let now = step(way, before, first) + step(way, Some(last), last + 1);
                let turned = step(way, before, last) + step(way, Some(first), last + 1);
                if turned < now - NOTHING {
                    way[first..=last].reverse();
                    shorter = true;
                }
            }
        }
    }
}
