//! A map of the positions' uncertainty over the workspace.

use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::workspace_poses::WorkspacePoses;
use crate::files::robot_file::RobotFile;
use nalgebra::{SMatrix, Vector3};

/// Horizontal slices of a map.
const SLICES: u32 = 3;
/// Cells of a slice, along its longer side.
const CELLS: u32 = 40;

/// A plane through the workspace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Plane {
    /// Of this z, mm.
    Horizontal(f64),
    /// y = 0.
    Vertical,
}

/// σ of the position in a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Slice {
    /// Which plane.
    pub plane: Plane,
    /// Width and height of a cell, mm.
    pub step: f64,
    /// Middles of the cells that the robot reaches clear of singularities, and σ there, mm.
    pub cells: Vec<(Vector3<f64>, f64)>,
}

impl Slice {
    /// √ of the mean of σ², and the largest σ.
    pub fn rms_and_max(&self) -> Option<(f64, f64)> {
        let squares: f64 = self.cells.iter().map(|(_, sigma)| sigma * sigma).sum();
        let max = self
            .cells
            .iter()
            .map(|(_, sigma)| *sigma)
            .fold(0.0, f64::max);
        #[allow(clippy::cast_precision_loss)] // a few thousand
        let count = self.cells.len() as f64;
        (!self.cells.is_empty()).then(|| ((squares / count).sqrt(), max))
    }
}

/// σ of the position over the workspace, its worst place, and a map of it.
#[derive(Debug, Clone, PartialEq)]
pub struct UncertaintyMap {
    /// Over the whole workspace.
    pub expected: ExpectedError,
    /// Horizontal slices from below to above, and a vertical one. A slice without a cell is left out.
    pub slices: Vec<Slice>,
}

impl UncertaintyMap {
    /// Of the robot of a file; `covariance` as in [`PositionUncertainty`]. `None` if no pose is clear
    /// of singularities.
    pub fn new(file: &RobotFile, covariance: &SMatrix<f64, 24, 24>) -> Option<Self> {
        let uncertainty = PositionUncertainty {
            robot: &file.robot,
            covariance,
        };
        let poses = WorkspacePoses::of(file);
        let expected = ExpectedError::of(&uncertainty, &file.reach(), &poses)?;
        let range = |of: fn(&Vector3<f64>) -> f64| {
            let values = poses.all().map(|pose| of(&pose.position));
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            })
        };
        let (x, y, z) = (range(|x| x.x), range(|x| x.y), range(|x| x.z));
        let heights = (1..=SLICES).map(|slice| {
            let part = f64::from(slice) / f64::from(SLICES + 1);
            Plane::Horizontal((z.0 + (z.1 - z.0) * part).round())
        });
        let slices = heights.chain([Plane::Vertical]).map(|plane| {
            let across = if plane == Plane::Vertical { z } else { y };
            let step = (x.1 - x.0).max(across.1 - across.0) / f64::from(CELLS);
            let cells = cells(x, across, step).filter_map(|(u, v)| {
                let position = match plane {
                    Plane::Horizontal(z) => Vector3::new(u, v, z),
                    Plane::Vertical => Vector3::new(u, 0.0, v),
                };
                let reach = file.reach();
                let joints = reach.joints(&file.robot, &position).ok()?;
                reach.clear_position(&file.robot, &joints).ok()?;
                Some((position, uncertainty.sigma(&position, &joints)?))
            });
            Slice {
                plane,
                step,
                cells: cells.collect(),
            }
        });
        let slices = slices.filter(|slice| !slice.cells.is_empty()).collect();
        Some(Self { expected, slices })
    }
}

/// Middles of square cells over a rectangle and a little beyond.
fn cells(u: (f64, f64), v: (f64, f64), step: f64) -> impl Iterator<Item = (f64, f64)> {
    let beyond = CELLS / 4;
    let middle = move |(low, high): (f64, f64), cell: u32| {
        let centre = f64::midpoint(low, high);
        centre + step * (f64::from(cell) + 0.5 - f64::from(CELLS / 2 + beyond))
    };
    let count = CELLS + 2 * beyond;
    (0..count * count).map(move |cell| (middle(u, cell % count), middle(v, cell / count)))
}
