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
    let stride = poses.len().div_ceil(STARTS).max(1);
    (0..poses.len())
        .step_by(stride)
        .map(|first| {
            let mut way = nearest_first(poses, first);
            turn_round(&mut way);
            way
        })
        .min_by(|a, b| length(a).total_cmp(&length(b)))
        .unwrap_or_default()
}

fn nearest_first(poses: &[Sample<f64>], first: usize) -> Vec<Sample<f64>> {
    let mut left = poses.to_vec();
    let mut here = left.swap_remove(first);
    let mut way = vec![here];
    while let Some(next) = (0..left.len())
        .min_by(|a, b| distance(&here, &left[*a]).total_cmp(&distance(&here, &left[*b])))
    {
        here = left.swap_remove(next);
        way.push(here);
    }
    way
}

/// Until no part of the way is shorter turned round.
fn turn_round(way: &mut [Sample<f64>]) {
    let step = |way: &[Sample<f64>], from: Option<usize>, to: usize| match (
        from.and_then(|from| way.get(from)),
        way.get(to),
    ) {
        (Some(from), Some(to)) => distance(from, to),
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
