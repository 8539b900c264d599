//! The volume of the workspace.

use super::Workspace;

/// A volume and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// mm³.
    pub volume: f64,
    /// How far the lines along one axis are off the mean of all three, at most, mm³.
    pub uncertainty: f64,
    /// The area of the boundary, mm².
    pub area: f64,
}

impl Workspace {
    /// The volume, from the length of the lines inside: spacing² · Σ length. It is taken along each
    /// axis; the three agree but for the lines' spacing.
    pub fn volume(&self) -> Volume {
        let cell = self.grid.spacing.powi(2);
        let mut along = [0.0; 3];
        for point in &self.points {
            let way = point.position[point.axis] - self.grid.origin[point.axis];
            along[point.axis] += if point.leaves { way } else { -way };
        }
        let volume = along.iter().sum::<f64>() * cell / 3.0;
        let off = along.map(|length| (length * cell - volume).abs());
        Volume {
            volume,
            uncertainty: off.into_iter().fold(0.0, f64::max),
            area: self.points.iter().map(|point| point.area).sum(),
        }
    }
}
