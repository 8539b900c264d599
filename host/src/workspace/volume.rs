//! The volume of the workspace.

use super::Workspace;

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
    fn lengths_along(&self, axis: usize) -> [f64; 4] {
        let across = self.grid.counts[(axis + 1) % 3];
        let mut sums = [0.0; 4];
        for (index, pieces) in self.lines()[axis].iter().enumerate() {
            let length: f64 = pieces.iter().map(|(from, to)| to - from).sum();
            sums[index % across % 2 + 2 * (index / across % 2)] += length;
        }
        sums
    }
}
