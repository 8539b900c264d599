//! What is written of a workspace: tables, JSON, CSV, mesh, figures, and all of it in HTML.

pub mod csv;
pub mod figures;
mod html;
pub mod json;
pub mod table;
mod viewer;

use super::{
    Band, BandOptions, Comparison, ConditionedPosition, Cylinder, Mesh, Options,
    ParameterInfluence, PathSummary, Volume, Workspace, WorkspaceError, band, compare,
    conditioning_map, cylinders, influence,
};
use crate::RobotFile;
use crate::plot::PlotError;
use crate::reach::Limit;
use delta_cal::Tolerance;
use std::collections::BTreeMap;

/// Positions of the conditioning map, at most about this many.
const MAP: usize = 20_000;

/// What is looked at in space has lines so many times further apart.
const COARSER: f64 = 2.0;

/// Everything that is known of a robot's workspace.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// The robot file's name.
    pub name: String,
    /// The boundary.
    pub workspace: Workspace,
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

    /// The box that holds the workspace, mm: for each axis from and to.
    pub fn extent(&self) -> [(f64, f64); 3] {
        [0, 1, 2].map(|axis| {
            let along = self
                .workspace
                .points
                .iter()
                .map(|point| point.position[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            })
        })
    }

    /// All files of an output folder.
    ///
    /// # Errors
    /// A figure or a text that cannot be made; none is known.
    pub fn contents(&self) -> Result<Contents, PlotError> {
        let mut contents = Contents::default();
        let comparison = self.comparison.as_ref().map(|(_, comparison)| comparison);
        let mesh = Mesh::of(&self.workspace);
        contents.text("boundary.csv", csv::boundary(&self.workspace));
        contents.bytes("boundary.stl", mesh.to_stl());
        contents.text("influence.csv", csv::influence(&self.workspace, comparison));
        if let Some(band) = &self.band {
            contents.text("band.csv", csv::band(&band.points));
        }
        contents.text("conditioning.csv", csv::conditioning(&self.conditioning));
        contents.text("cylinders.csv", csv::cylinders(&self.cylinders));
        if let Some(path) = &self.path {
            contents.text("path.csv", csv::path(path));
        }
        let coarse = self.coarse();
        let coarse = coarse.as_ref().unwrap_or(&self.workspace);
        let coarse_mesh = Mesh::of(coarse);
        let figures = figures::figures(self, &mesh, &coarse_mesh);
        contents.text("horizontal.svg", figures.horizontal.to_svg()?);
        contents.text("vertical_xz.svg", figures.vertical_xz.to_svg()?);
        contents.text("vertical_yz.svg", figures.vertical_yz.to_svg()?);
        contents.text("serial.svg", figures.serial.to_svg()?);
        contents.text("parallel.svg", figures.parallel.to_svg()?);
        contents.text("cylinders.svg", figures.cylinders.to_svg()?);
        contents.text("influence.svg", figures.influence.to_svg()?);
        contents.text("view.svg", figures.view.to_svg()?);
        contents.bytes("view.png", figures.view.to_png(1.5)?);
        let scene = viewer::scene(self, coarse, &coarse_mesh)
            .map_err(|error| PlotError::Drawing(error.to_string()))?;
        contents.text("report.html", html::render(self, &figures, &scene)?);
        Ok(contents)
    }

    /// The same workspace on fewer lines, for what is looked at.
    fn coarse(&self) -> Option<Workspace> {
        let options = Options {
            tolerance: self.workspace.tolerance,
            spacing: Some(self.workspace.grid.spacing * COARSER),
        };
        Workspace::compute(&self.workspace.robot, &self.workspace.reach, &options).ok()
    }
}

/// The files of an output folder.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Contents(Vec<(&'static str, Vec<u8>)>);

impl Contents {
    /// Every name that can be there.
    pub const NAMES: [&'static str; 17] = [
        "boundary.csv",
        "boundary.stl",
        "influence.csv",
        "band.csv",
        "conditioning.csv",
        "cylinders.csv",
        "path.csv",
        "horizontal.svg",
        "vertical_xz.svg",
        "vertical_yz.svg",
        "serial.svg",
        "parallel.svg",
        "cylinders.svg",
        "influence.svg",
        "view.svg",
        "view.png",
        "report.html",
    ];

    fn text(&mut self, name: &'static str, text: String) {
        self.bytes(name, text.into_bytes());
    }

    fn bytes(&mut self, name: &'static str, bytes: Vec<u8>) {
        self.0.push((name, bytes));
    }

    /// Names and contents.
    pub fn files(&self) -> impl Iterator<Item = (&'static str, &[u8])> {
        self.0.iter().map(|(name, bytes)| (*name, bytes.as_slice()))
    }
}
