//! The largest upright cylinder inside the workspace, about the base's z axis.
//!
//! The workspace is cut into vertical lines on rings about the axis. Along each line the reachable
//! intervals are found to the tolerance; those common to all lines within a radius are where a
//! cylinder of that radius can stand.

use super::grid::Intervals;
use super::line::{self, intersection};
use super::{BoundaryPoint, Workspace};
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::f64::consts::{PI, TAU};

/// Rings from the axis to the furthest boundary point.
const RINGS: u32 = 100;
/// Lines on a ring; between them, the ring's ends are interpolated by a parabola.
const LINES: u32 = 360;
/// Refinements of the largest cylinder's radius, each by the golden section.
const REFINEMENTS: usize = 12;

/// An upright cylinder about the base's z axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// mm.
    pub diameter: f64,
    /// z of its lower end, mm.
    pub bottom: f64,
    /// z of its upper end, mm.
    pub top: f64,
}

impl Cylinder {
    /// mm.
    pub fn height(&self) -> f64 {
        self.top - self.bottom
    }

    /// mm³.
    pub fn volume(&self) -> f64 {
        PI / 4.0 * self.diameter.powi(2) * self.height()
    }
}

/// The cylinder of the largest volume first, then the highest cylinder of each ring's diameter, from
/// narrow to wide; none if the axis is not in the workspace.
pub fn cylinders(workspace: &Workspace) -> Vec<Cylinder> {
    let z = |point: &BoundaryPoint| point.position.z;
    let lowest = workspace.points.iter().map(z).fold(f64::INFINITY, f64::min);
    let highest = workspace
        .points
        .iter()
        .map(z)
        .fold(f64::NEG_INFINITY, f64::max);
    let furthest = workspace
        .points
        .iter()
        .map(|point| point.position.xy().norm())
        .fold(0.0, f64::max);
    let scan = Scan {
        workspace,
        low: lowest - workspace.grid.spacing,
        high: highest + workspace.grid.spacing,
    };
    let mut common = scan.line(0.0, 0.0);
    let mut found: Vec<(Cylinder, Intervals)> = Vec::new();
    for ring in 1..=RINGS {
        let radius = furthest * f64::from(ring) / f64::from(RINGS);
        let next = intersection(&common, &scan.ring(radius));
        let Some(cylinder) = scan.highest(radius, &next) else {
            break;
        };
        // What is inside: to be intersected with the next ring.
        found.push((cylinder, common));
        common = next;
    }
    let Some(best) =
        (0..found.len()).max_by(|a, b| found[*a].0.volume().total_cmp(&found[*b].0.volume()))
    else {
        return Vec::new();
    };
    let largest = scan.refined(&found, best, furthest / f64::from(RINGS));
    let all = found.into_iter().map(|(cylinder, _)| cylinder);
    std::iter::once(largest).chain(all).collect()
}

/// Vertical lines through a workspace.
struct Scan<'a> {
    workspace: &'a Workspace,
    low: f64,
    high: f64,
}

impl Scan<'_> {
    /// The reachable intervals on the vertical line through (x, y).
    fn line(&self, x: f64, y: f64) -> Intervals {
        let (origin, up) = (Vector3::new(x, y, self.low), Vector3::z());
        let pieces = line::intervals(self.workspace, &origin, &up, self.high - self.low);
        let heights = pieces
            .iter()
            .map(|(from, to)| (self.low + from, self.low + to));
        heights.collect()
    }

    /// The intervals common to all lines on a ring.
    fn ring(&self, radius: f64) -> Intervals {
        let lines: Vec<Intervals> = (0..LINES)
            .into_par_iter()
            .map(|line| {
                let (sin, cos) = (TAU * f64::from(line) / f64::from(LINES)).sin_cos();
                self.line(radius * cos, radius * sin)
            })
            .collect();
        let common = lines.iter().skip(1).fold(
            lines.first().cloned().unwrap_or_default(),
            |common, line| intersection(&common, line),
        );
        let slack = between_lines(&lines);
        common
            .into_iter()
            .map(|(from, to)| (from + slack, to - slack))
            .filter(|(from, to)| from < to)
            .collect()
    }

    /// The highest cylinder within these intervals, shorter by the tolerance at both ends.
    fn highest(&self, radius: f64, intervals: &Intervals) -> Option<Cylinder> {
        let tolerance = self.workspace.tolerance;
        let (from, to) = intervals
            .iter()
            .copied()
            .max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)))?;
        (to - from > 2.0 * tolerance).then_some(Cylinder {
            diameter: 2.0 * radius,
            bottom: from + tolerance,
            top: to - tolerance,
        })
    }

    /// The largest volume near the ring of the largest one, by golden section over the radius.
    fn refined(&self, found: &[(Cylinder, Intervals)], best: usize, step: f64) -> Cylinder {
        let largest = found[best].0;
        let inner = |radius: f64| {
            // All rings within the radius count.
            let within = found.iter().take_while(|(c, _)| c.diameter / 2.0 < radius);
            within.last().map_or(&found[0].1, |(_, inner)| inner)
        };
        let cylinder = |radius: f64| {
            let common = intersection(inner(radius), &self.ring(radius));
            self.highest(radius, &common)
        };
        let volume = |cylinder: &Option<Cylinder>| cylinder.map_or(0.0, |c| c.volume());
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let (mut low, mut high) = (largest.diameter / 2.0 - step, largest.diameter / 2.0 + step);
        let mut left = cylinder(high - golden * (high - low));
        let mut right = cylinder(low + golden * (high - low));
        let mut kept = largest;
        for _ in 0..REFINEMENTS {
            for candidate in [left, right].into_iter().flatten() {
                if candidate.volume() > kept.volume() {
                    kept = candidate;
                }
            }
            if volume(&left) > volume(&right) {
                (high, right) = (low + golden * (high - low), left);
                left = cylinder(high - golden * (high - low));
            } else {
                (low, left) = (high - golden * (high - low), right);
                right = cylinder(low + golden * (high - low));
            }
        }
        kept
    }
}

/// How far an end may lie inside the lowest of a ring's lines, between two of them. At a kink it goes
/// on falling as on its flatter side, for one step at most; where it is smooth, a parabola through
/// three lines is an eighth of their second difference below the lowest.
fn between_lines(lines: &[Intervals]) -> f64 {
    let mut slack = 0.0_f64;
    for (index, line) in lines.iter().enumerate() {
        let next = &lines[(index + 1) % lines.len()];
        let after = &lines[(index + 2) % lines.len()];
        if let ([a], [b], [c]) = (line.as_slice(), next.as_slice(), after.as_slice()) {
            for [a, b, c] in [[a.0, b.0, c.0], [-a.1, -b.1, -c.1]] {
                if b >= a && b >= c {
                    slack = slack.max((b - a).min(b - c) + 0.125 * (2.0 * b - a - c));
                }
            }
        }
    }
    slack
}
