//! The order in which measurements are taken.

use super::kind::Kind;
use super::region::below;
use super::setup::Planned;
use delta_cal::Sample;
use rand_pcg::Pcg32;

/// First poses that are tried for a short way.
const STARTS: usize = 24;

/// The order in which measurements are taken, within what is set up for them: a gauge block, or a sensor at a
/// point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// At random, and each instrument's first measurement once more as its last: a drift is then no error that
    /// parameters can explain, and shows in the repeated measurement.
    #[default]
    Random,
    /// A short way of the joints.
    Shortest,
}

/// What has to be set up for a measurement: the instrument, and of a plane the gauge block.
fn instrument(own: &Planned) -> (usize, usize) {
    match own.kind {
        Kind::Position(_) => (0, 0),
        Kind::Distance => (1, 0),
        Kind::Plane => (2, own.plane.map_or(0, |(plane, _)| plane)),
        Kind::Point => (3, own.point.unwrap_or(0)),
    }
}

/// Sorted by what has to be set up, and within that as asked for.
pub(super) fn ordered(measurements: &[Planned], order: Order, rng: &mut Pcg32) -> Vec<Planned> {
    let block = |own: &Planned| own.plane.map_or(0, |(_, block)| block);
    let mut groups: Vec<_> = measurements
        .iter()
        .map(|own| (instrument(own), block(own)))
        .collect();
    groups.sort_unstable();
    groups.dedup();
    let mut all: Vec<Planned> = Vec::with_capacity(measurements.len() + groups.len());
    let mut first = 0;
    for (index, group) in groups.iter().enumerate() {
        let members = measurements.iter();
        let members = members.filter(|own| (instrument(own), block(own)) == *group);
        let mut members: Vec<_> = members.cloned().collect();
        match order {
            Order::Shortest => all.extend(short_way(&members)),
            Order::Random => {
                for place in (1..members.len()).rev() {
                    members.swap(place, below(place + 1, rng));
                }
                all.extend(members);
                let next = groups.get(index + 1);
                if next.is_none_or(|(instrument, _)| *instrument != group.0) {
                    all.extend(all.get(first).cloned());
                    first = all.len();
                }
            }
        }
    }
    all
}

/// From one pose to the next, radians: what the joint that moves furthest moves. All joints move at the same time.
fn apart(from: &Sample<f64>, to: &Sample<f64>) -> f64 {
    let moves = from.joints.iter().zip(&to.joints);
    moves
        .map(|(from, to)| (to - from).abs())
        .fold(0.0, f64::max)
}

/// An order that is short to travel: from each stop on to the nearest, from several first ones, and the shortest of
/// these ways.
fn short_way(stops: &[Planned]) -> Vec<Planned> {
    let length = |way: &[Planned]| -> f64 {
        let steps = way.windows(2);
        steps.map(|pair| apart(&pair[0].pose, &pair[1].pose)).sum()
    };
    let stride = stops.len().div_ceil(STARTS).max(1);
    let firsts = (0..stops.len()).step_by(stride);
    let ways = firsts.map(|first| nearest_first(stops, first));
    ways.min_by(|a, b| length(a).total_cmp(&length(b)))
        .unwrap_or_default()
}

fn nearest_first(stops: &[Planned], first: usize) -> Vec<Planned> {
    let mut left = stops.to_vec();
    let mut here = left.swap_remove(first);
    let mut way = vec![here.clone()];
    let distance = |here: &Planned, to: &Planned| apart(&here.pose, &to.pose);
    while let Some(next) = (0..left.len())
        .min_by(|a, b| distance(&here, &left[*a]).total_cmp(&distance(&here, &left[*b])))
    {
        here = left.swap_remove(next);
        way.push(here.clone());
    }
    way
}
