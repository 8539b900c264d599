//! The volume of the workspace.

use super::Workspace;
use serde::Serialize;

/// A volume and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Volume {
    /// The volume.
    pub litres: f64,
    /// What the spacing of the lines may put it off by: the larger of how far the lines along one
    /// axis are off the mean of all three, and half of how far every second line alone is off it, rms.
    pub uncertainty_litres: f64,
    /// The area of the boundary.
    pub boundary_m2: f64,
}

impl Workspace {
    /// The volume, from the length inside of all lines of the grid: spacing² · Σ length. It is taken
    /// along each axis; the three agree but for the lines' spacing.
    pub fn volume(&self) -> Volume {
        let litres = self.grid.spacing.powi(2) * 1e-6;
        // Every second line both ways: four sets for each axis.
        let quarters = [0, 1, 2].map(|axis| self.lengths_along(axis).map(|sum| sum * litres));
        let along = quarters.map(|quarters| quarters.iter().sum::<f64>());
        let volume = along.iter().sum::<f64>() / 3.0;
        let off = along.map(|along| (along - volume).abs());
        let of_quarters = quarters.as_flattened().iter();
        let squares = of_quarters.map(|quarter| (4.0 * quarter - volume).powi(2));
        let spread = (squares.sum::<f64>() / 12.0).sqrt();
        Volume {
            litres: volume,
            uncertainty_litres: off.into_iter().fold(0.5 * spread, f64::max),
            boundary_m2: self.points.iter().map(|point| point.area * 1e-6).sum(),
        }
    }

    /// The length inside of all lines along an axis, mm, for odd and even lines each.
    fn lengths_along(&self, axis: usize) -> [f64; 4] {
        let across = self.grid.counts[(axis + 1) % 3];
        let mut sums = [0.0; 4];
        for (index, pieces) in self.lines[axis].iter().enumerate() {
            let length: f64 = pieces.iter().map(|(from, to)| to - from).sum();
            sums[index % across % 2 + 2 * (index / across % 2)] += length;
        }
        sums
    }
}
