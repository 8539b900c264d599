//! Where the boundary of a robot lies whose parameters are known to their tolerance only.

use super::influence::displacements;
use super::{BoundaryPoint, Workspace};
use crate::accuracy::information::sigma_of_sum;
use crate::geometry::reach::Reach;
use delta_cal::simulate::made_robot;
use delta_cal::{Parameter, Robot, Tolerance};
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg32;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// The share of robots whose boundary is further in, or further out, than the band.
pub const TAIL: f64 = 0.05;
/// A boundary is searched for along the normal within so many σ of where it is expected, at most:
/// where two faces meet at an edge, another robot may have none of the same face there.
const RANGE: f64 = 4.0;

/// How a band is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BandOptions {
    /// Robots.
    pub robots: u32,
    /// Boundary points at most, evenly among all.
    pub points: usize,
    /// Of the random numbers.
    pub seed: u64,
}

impl Default for BandOptions {
    fn default() -> Self {
        Self {
            robots: 200,
            points: 400,
            seed: 1,
        }
    }
}

/// The band at one boundary point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointBand {
    /// The point.
    pub point: BoundaryPoint,
    /// One σ of the displacement along the normal, mm, to first order: √Σ (∂n/∂p · tolerance)².
    pub sigma: f64,
    /// The 5 % quantile of the recomputed displacements, mm.
    pub low: f64,
    /// The 95 % quantile, mm.
    pub high: f64,
    /// Robots whose boundary was found along the normal.
    pub robots: u32,
}

/// The band of all points that were drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// How it was drawn.
    pub options: BandOptions,
    /// The points.
    pub points: Vec<PointBand>,
    /// One σ of the displacement, mm, rms over the whole boundary.
    pub sigma: f64,
    /// The largest σ of a point, mm.
    pub largest_sigma: f64,
    /// One σ of the volume, mm³, to first order.
    pub volume_sigma: f64,
}

impl Band {
    /// rms over the points of the 5 % quantile, mm.
    pub fn low_rms(&self) -> f64 {
        rms(self.points.iter().map(|point| point.low))
    }

    /// rms over the points of the 95 % quantile, mm.
    pub fn high_rms(&self) -> f64 {
        rms(self.points.iter().map(|point| point.high))
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| {
        (sum + value * value, count + 1.0)
    });
    f64::sqrt(sum / count)
}

/// Draws robots about a workspace's own, each parameter normal with the tolerance as its σ, and
/// finds the boundary of each along the normals. The same seed gives the same band.
pub fn band(workspace: &Workspace, tolerance: &Tolerance<f64>, options: &BandOptions) -> Band {
    let linear = displacements(workspace, &workspace.points);
    let sigma_of = |moved: &[f64; 24]| sigma_of_sum(&workspace.robot, tolerance, moved);
    let robots: Vec<Option<Robot<f64>>> = (0..options.robots)
        .map(|robot| drawn(&workspace.robot, tolerance, options.seed, robot))
        .collect();
    let chosen = evenly(workspace.points.len(), options.points);
    let points = chosen
        .into_par_iter()
        .filter_map(|index| {
            let point = workspace.points[index];
            let linear = linear[index].as_ref()?;
            let sigma = sigma_of(linear);
            let mut moved: Vec<f64> = robots
                .iter()
                .flatten()
                .filter_map(|robot| {
                    let expected = predicted(&workspace.robot, robot, linear);
                    let range = RANGE * sigma;
                    displacement_to(
                        workspace,
                        (robot, &workspace.reach),
                        &point,
                        (expected, range),
                    )
                })
                .collect();
            moved.sort_by(f64::total_cmp);
            Some(PointBand {
                point,
                sigma,
                low: quantile(&moved, TAIL)?,
                high: quantile(&moved, 1.0 - TAIL)?,
                robots: u32::try_from(moved.len()).unwrap_or(u32::MAX),
            })
        })
        .collect();
    let (mut square, mut area, mut largest) = (0.0, 0.0, 0.0_f64);
    let mut volume = [0.0; 24];
    for (point, moved) in workspace.points.iter().zip(&linear) {
        let Some(moved) = moved else { continue };
        let sigma = sigma_of(moved);
        square += sigma * sigma * point.area;
        area += point.area;
        largest = largest.max(sigma);
        for (volume, moved) in volume.iter_mut().zip(moved) {
            *volume += moved * point.area;
        }
    }
    Band {
        options: *options,
        points,
        sigma: (square / area).sqrt(),
        largest_sigma: largest,
        volume_sigma: sigma_of(&volume),
    }
}

/// `number` of `count` indices, evenly spread; all if there are fewer.
pub(super) fn evenly(count: usize, number: usize) -> Vec<usize> {
    if count <= number {
        return (0..count).collect();
    }
    (0..number)
        .map(|n| (2 * n + 1) * count / (2 * number))
        .collect()
}

/// One robot of the Monte-Carlo; `None` in the rare case that its numbers are no robot.
fn drawn(
    robot: &Robot<f64>,
    tolerance: &Tolerance<f64>,
    seed: u64,
    number: u32,
) -> Option<Robot<f64>> {
    // A generator for each robot: the order in which they are computed does not matter.
    let mut rng =
        Pcg32::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(number));
    made_robot(robot, tolerance, &mut rng).ok()
}

/// To first order, from one robot's boundary to another's: Σ ∂n/∂p Δp. Azimuths are compared the
/// short way round.
pub(super) fn predicted(from: &Robot<f64>, to: &Robot<f64>, displacements: &[f64; 24]) -> f64 {
    let values = |robot: &Robot<f64>| {
        let arms = *robot.arms();
        arms.into_iter().flat_map(|arm| arm.parameters())
    };
    let places = from.drive().places();
    let parameters = places.into_iter().cycle();
    let changes = values(from)
        .zip(values(to))
        .zip(parameters)
        .map(|((from, to), parameter)| {
            let change = to - from;
            match parameter {
                Some(Parameter::Theta | Parameter::Alpha) => change.sin().atan2(change.cos()),
                _ => change,
            }
        });
    changes
        .zip(displacements)
        .map(|(change, moved)| change * moved)
        .sum()
}

/// How far outwards along the point's normal another robot's boundary is, mm: found about the
/// displacement that is expected. `None` if it is not found within the range about it.
pub(super) fn displacement_to(
    workspace: &Workspace,
    (robot, reach): (&Robot<f64>, &Reach),
    point: &BoundaryPoint,
    (expected, range): (f64, f64),
) -> Option<f64> {
    let tolerance = workspace.tolerance;
    let at = |way: f64| point.position + point.outward * way;
    let is_inside = |x: &Vector3<f64>| reach.any_joints(robot, x).is_ok();
    let mut step = tolerance.max(0.02 * expected.abs());
    while step <= range.max(4.0 * tolerance) {
        let (low, high) = (at(expected - step), at(expected + step));
        if is_inside(&low) && !is_inside(&high) {
            let ends = (low, high);
            let (inside, outside) = super::boundary::bisect(is_inside, ends, tolerance / 16.0);
            let middle = (inside + outside) * 0.5;
            return Some((middle - point.position).dot(&point.outward));
        }
        step *= 2.0;
    }
    None
}

/// Linear between neighbours.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss
)]
fn quantile(sorted: &[f64], fraction: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = fraction * last as f64;
    let below = sorted[place as usize];
    let above = sorted[(place as usize + 1).min(last)];
    Some(below + (above - below) * place.fract())
}
