//! The largest upright cylinder inside the workspace, about the base's z axis.
//!
//! The workspace is sampled by vertical lines on rings about the axis. On each line the reachable intervals are found
//! to the tolerance; a cylinder fits within the intervals common to all lines up to its radius.

use super::Workspace;
use super::grid::{Intervals, intersection};
use crate::cores;
use crate::geometry::range;
use crate::halt;
use nalgebra::Vector3;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Number of rings from the axis to the outermost boundary point.
const RINGS: u32 = 100;
/// Lines per ring; between them, the ends are interpolated by a parabola.
const LINES: u32 = 360;
/// The interval around the best ring is refined this many times, each time into `PARTS` rings.
const REFINEMENTS: usize = 3;
const PARTS: u32 = 8;

/// An upright cylinder about the base's z axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cylinder {
    /// Diameter.
    pub diameter_mm: f64,
    /// Height.
    pub height_mm: f64,
    /// z of the lower end.
    pub bottom_mm: f64,
    /// z of the upper end.
    pub top_mm: f64,
    /// Volume.
    pub litres: f64,
}

/// Radius of a ring, intervals common to all lines up to it, and the tallest cylinder there.
type Ring = (f64, Intervals, Cylinder);

/// The cylinder of largest volume, then the tallest cylinder for each ring's diameter in ascending order; empty if the
/// axis is outside the workspace.
pub fn cylinders(workspace: &Workspace) -> Vec<Cylinder> {
    let positions = || workspace.points.iter().map(|point| point.position);
    let (lowest, highest) = range(positions().map(|at| at.z));
    let furthest = positions().map(|at| at.xy().norm()).fold(0.0, f64::max);
    let spacing = workspace.grid.spacing;
    let scan = Scan {
        workspace,
        low: lowest - spacing,
        length: highest - lowest + 2.0 * spacing,
    };
    let on_axis = (0.0, scan.line(0.0, 0.0));
    let mut rings = scan.rings(on_axis.clone(), furthest, RINGS);
    let all: Vec<Cylinder> = rings.iter().map(|ring| ring.2).collect();
    let mut largest: Option<Cylinder> = None;
    for _ in 0..=REFINEMENTS {
        let litres = |ring: &usize| rings[*ring].2.litres;
        let Some(best) = (0..rings.len()).max_by(|a, b| litres(a).total_cmp(&litres(b))) else {
            break;
        };
        let (radius, _, found) = rings[best];
        if largest.is_none_or(|largest| found.litres > largest.litres) {
            largest = Some(found);
        }
        let inner = match best.checked_sub(1).map(|before| &rings[before]) {
            Some((radius, common, _)) => (*radius, common.clone()),
            None => on_axis.clone(),
        };
        let end = rings.get(best + 1).map_or(radius, |ring| ring.0);
        rings = scan.rings(inner, end, PARTS);
    }
    largest.into_iter().chain(all).collect()
}

/// Vertical lines through a workspace.
struct Scan<'a> {
    workspace: &'a Workspace,
    low: f64,
    length: f64,
}

impl Scan<'_> {
    /// The reachable intervals on the vertical line through (x, y).
    fn line(&self, x: f64, y: f64) -> Intervals {
        let origin = Vector3::new(x, y, self.low);
        let pieces = self.workspace.pieces(&origin, &Vector3::z(), self.length);
        pieces
            .iter()
            .map(|(from, to)| (self.low + from, self.low + to))
            .collect()
    }

    /// `count` rings from `start` (exclusive) to `end`, until no cylinder fits.
    fn rings(&self, (start, mut common): (f64, Intervals), end: f64, count: u32) -> Vec<Ring> {
        let mut rings = Vec::new();
        for ring in 1..=count {
            let radius = start + (end - start) * f64::from(ring) / f64::from(count);
            common = intersection(&common, &self.ring(radius));
            let Some(cylinder) = self.highest(radius, &common) else {
                break;
            };
            rings.push((radius, common.clone(), cylinder));
        }
        rings
    }

    /// The intervals common to all lines on a ring.
    fn ring(&self, radius: f64) -> Intervals {
        let line = |line: u32| {
            halt::check();
            let (sin, cos) = (TAU * f64::from(line) / f64::from(LINES)).sin_cos();
            self.line(radius * cos, radius * sin)
        };
        let lines: Vec<Intervals> = cores::map(0..LINES, line);
        let all = lines.iter().cloned();
        let common = all.reduce(|common, line| intersection(&common, &line));
        let slack = between_lines(&lines);
        let ends = common
            .into_iter()
            .flatten()
            .map(|(from, to)| (from + slack, to - slack));
        ends.filter(|(from, to)| from < to).collect()
    }

    /// The tallest cylinder within these intervals, shortened by the tolerance at both ends.
    fn highest(&self, radius: f64, intervals: &Intervals) -> Option<Cylinder> {
        let tolerance = self.workspace.tolerance;
        let longest = intervals
            .iter()
            .max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
        let (bottom_mm, top_mm) = longest.map(|(from, to)| (from + tolerance, to - tolerance))?;
        let height_mm = top_mm - bottom_mm;
        (height_mm > 0.0).then_some(Cylinder {
            diameter_mm: 2.0 * radius,
            height_mm,
            bottom_mm,
            top_mm,
            litres: PI * radius * radius * height_mm * 1e-6,
        })
    }
}

/// How far the boundary may lie inside the lowest of a ring's lines, between two lines. At a kink it continues with the
/// slope of the flatter side for at most one step; where it is smooth, the vertex of a parabola through three lines is
/// at most 1/8 of their second difference below the lowest.
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
