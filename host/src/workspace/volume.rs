//! The volume of the workspace.

use super::{Workspace, line};
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// A volume and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// mm³.
    pub volume: f64,
    /// What the spacing of the lines may put it off by, mm³: the larger of how far the lines along one
    /// axis are off the mean of all three, and half of how far every second line alone is off it, rms.
    pub uncertainty: f64,
    /// The area of the boundary, mm².
    pub area: f64,
}

impl Workspace {
    /// The volume, from the length inside of all lines of the grid: spacing² · Σ length. It is taken
    /// along each axis; the three agree but for the lines' spacing.
    pub fn volume(&self) -> Volume {
        let cell = self.grid.spacing.powi(2);
        // Every second line both ways: four sets for each axis.
        let quarters = [0, 1, 2].map(|axis| self.lengths_along(axis).map(|length| length * cell));
        let along = quarters.map(|quarters| quarters.iter().sum::<f64>());
        let volume = along.iter().sum::<f64>() / 3.0;
        let off = along.map(|along| (along - volume).abs());
        let of_quarters = quarters
            .iter()
            .flatten()
            .map(|quarter| (4.0 * quarter - volume).powi(2));
        let spread = (of_quarters.sum::<f64>() / 12.0).sqrt();
        Volume {
            volume,
            uncertainty: off.into_iter().fold(0.5 * spread, f64::max),
            area: self.points.iter().map(|point| point.area).sum(),
        }
    }

    /// The length inside of all lines along an axis, mm, for odd and even lines each.
    #[allow(clippy::cast_precision_loss)] // some hundreds
    fn lengths_along(&self, axis: usize) -> [f64; 4] {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let counts = self.grid.counts;
        let length = (counts[axis] - 1) as f64 * self.grid.spacing;
        let direction = Vector3::ith(axis, 1.0);
        let lengths: Vec<f64> = (0..counts[b] * counts[c])
            .into_par_iter()
            .map(|index| {
                let mut place = [0; 3];
                (place[b], place[c]) = (index % counts[b], index / counts[b]);
                let origin = self.grid.node(place);
                let intervals = line::intervals(self, &origin, &direction, length);
                intervals.iter().map(|(from, to)| to - from).sum()
            })
            .collect();
        // In one order, whatever the number of threads.
        let mut sums = [0.0; 4];
        for (index, length) in lengths.iter().enumerate() {
            sums[index % counts[b] % 2 + 2 * (index / counts[b] % 2)] += length;
        }
        sums
    }
}
