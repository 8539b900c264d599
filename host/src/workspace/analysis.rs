//! Everything that is known of a robot's workspace, computed at once.

use super::{
    Band, BandOptions, Comparison, ConditionedPosition, Cylinder, Mesh, Options,
    ParameterInfluence, PathSummary, Volume, Workspace, WorkspaceError, band, compare,
    conditioning_map, cylinders, influence,
};
use crate::files::robot_file::RobotFile;
use crate::geometry::range::range;
use crate::geometry::reach::Limit;
use delta_cal::Tolerance;
use std::collections::BTreeMap;

/// Positions of the conditioning map, at most about this many.
const MAP: usize = 20_000;

/// Everything that is known of a robot's workspace.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// The robot file's name.
    pub name: String,
    /// The boundary.
    pub workspace: Workspace,
    /// The boundary as a mesh.
    pub mesh: Mesh,
    /// How large it is.
    pub volume: Volume,
    /// The largest cylinder, then one of each diameter.
    pub cylinders: Vec<Cylinder>,
    /// What each parameter does to the boundary.
    pub influence: Vec<ParameterInfluence>,
    /// Where the boundary lies for the stated tolerance.
    pub band: Option<Band>,
    /// The other robot's name, its workspace, and how it differs.
    pub comparison: Option<(String, Comparison)>,
    /// The other robot's workspace.
    pub other: Option<Workspace>,
    /// The stated tolerance.
    pub tolerance: Option<Tolerance<f64>>,
    /// Distance from singularities inside.
    pub conditioning: Vec<ConditionedPosition>,
    /// Distance of a path from singularities.
    pub path: Option<PathSummary>,
}

impl Analysis {
    /// Computes all of it. `progress` is told what is being computed.
    ///
    /// # Errors
    /// A robot without a workspace, and its file's name.
    pub fn compute(
        robot: &RobotFile,
        other: Option<&RobotFile>,
        path: Option<PathSummary>,
        options: &Options,
        band_options: &BandOptions,
        progress: &mut dyn FnMut(&'static str),
    ) -> Result<Self, (WorkspaceError, String)> {
        progress("boundary");
        let workspace = Workspace::compute(&robot.robot, &robot.reach(), options)
            .map_err(|error| (error, robot.name.clone()))?;
        let (comparison, other) = match other {
            None => (None, None),
            Some(other) => {
                progress("comparison");
                // On lines of the same distance, so that the volumes compare.
                let options = Options {
                    spacing: Some(workspace.grid.spacing),
                    ..*options
                };
                let second = Workspace::compute(&other.robot, &other.reach(), &options)
                    .map_err(|error| (error, other.name.clone()))?;
                let comparison = compare(&workspace, &second);
                (Some((other.name.clone(), comparison)), Some(second))
            }
        };
        progress("mesh");
        let mesh = Mesh::of(&workspace);
        progress("cylinders");
        let cylinders = cylinders(&workspace);
        progress("influence of the parameters");
        let influence = influence(&workspace);
        let band = robot.tolerance.as_ref().map(|tolerance| {
            progress("band of the tolerance");
            band(&workspace, tolerance, band_options)
        });
        progress("conditioning");
        Ok(Self {
            name: robot.name.clone(),
            mesh,
            volume: workspace.volume(),
            cylinders,
            influence,
            band,
            comparison,
            other,
            tolerance: robot.tolerance,
            conditioning: conditioning_map(&workspace, MAP),
            path,
            workspace,
        })
    }

    /// The share of the boundary's area that each limit makes, largest first.
    pub fn limits(&self) -> Vec<(Limit, f64)> {
        let mut areas: BTreeMap<Limit, f64> = BTreeMap::new();
        for point in &self.workspace.points {
            *areas.entry(point.limit).or_default() += point.area;
        }
        let share = |(limit, area)| (limit, area / self.volume.area);
        let mut shares: Vec<_> = areas.into_iter().map(share).collect();
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares
    }

    /// The box that holds the workspace, mm: for each axis from and to. Its corners are between the boundary's points,
    /// but the mesh has them.
    pub fn extent(&self) -> [(f64, f64); 3] {
        let points = || self.workspace.points.iter().chain(&self.mesh.vertices);
        [0, 1, 2].map(|axis| range(points().map(|point| point.position[axis])))
    }
}
