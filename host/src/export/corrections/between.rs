//! What linear interpolation between the nodes leaves.

use super::kind::Pair;
use super::table::Table;
use crate::export::loss::Loss;
use crate::export::wanted::{Wanted, controller_reaches};
use crate::files::robot_file::RobotFile;
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Random points.
const POINTS: usize = 2000;
/// Draws for them; a robot may be in a small part of the box.
const DRAWS: usize = 100_000;

/// Where the table is tested: in the box around the wanted positions, where the robot can be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Region<'a> {
    robot: &'a RobotFile,
    low: Vector3<f64>,
    high: Vector3<f64>,
    wanted: &'a Wanted,
}

impl<'a> Region<'a> {
    pub(crate) fn of(robot: &'a RobotFile, wanted: &'a Wanted) -> Self {
        let each = wanted.evaluated.iter();
        let infinite = Vector3::repeat(f64::INFINITY);
        let (low, high) = each.fold((infinite, -infinite), |(low, high), at| {
            (low.inf(at), high.sup(at))
        });
        Self {
            robot,
            low,
            high,
            wanted,
        }
    }

    /// Its corners, mm.
    pub(crate) const fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.low, self.high)
    }

    fn holds(&self, at: &Vector3<f64>) -> bool {
        let inside = (0..3).all(|axis| at[axis] >= self.low[axis] && at[axis] <= self.high[axis]);
        let beyond = |within| at.xy().norm() > within;
        inside && !self.wanted.within.is_some_and(beyond) && controller_reaches(self.robot, at)
    }

    /// The same points at every call.
    fn random_points(&self) -> Vec<Vector3<f64>> {
        let mut generator = Pcg32::seed_from_u64(1);
        let mut uniform = || f64::from(generator.next_u32()) / f64::from(u32::MAX);
        let size = self.high - self.low;
        let draws = std::iter::repeat_with(|| {
            let part = Vector3::new(uniform(), uniform(), uniform());
            self.low + size.component_mul(&part)
        });
        let inside = draws.take(DRAWS).filter(|at| self.holds(at));
        inside.take(POINTS).collect()
    }
}

/// How far the robot is from where it was wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Between {
    /// At the wanted positions.
    pub wanted: Loss,
    /// In the middle of each cell, farthest from the nodes.
    pub centres: Loss,
    /// At random points.
    pub random: Loss,
}

impl Between {
    pub(crate) fn of(table: &Table, pair: &Pair<'_>, region: &Region<'_>) -> Self {
        let off = |at: Vector3<f64>| (at, table.off(pair, &at));
        let wanted = region.wanted.evaluated.iter().copied();
        let centres = table.grid.centres().filter(|at| region.holds(at));
        Self {
            wanted: Loss::of(wanted.map(off)),
            centres: Loss::of(centres.map(off)),
            random: Loss::of(region.random_points().into_iter().map(off)),
        }
    }

    /// Where it leaves most.
    pub fn worst(&self) -> &Loss {
        let mut worst = &self.wanted;
        for other in [&self.centres, &self.random] {
            if other.worst > worst.worst {
                worst = other;
            }
        }
        worst
    }
}
