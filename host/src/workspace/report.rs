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
use figures::Figures;
use std::collections::BTreeMap;

/// Positions of the conditioning map, at most about this many.
const MAP: usize = 20_000;

/// What is looked at in space has lines so many times further apart.
const COARSER: f64 = 2.0;

/// Dots a pixel of the figures as PNG.
const PNG_SCALE: f32 = 1.5;

/// The files that are no figures.
const TABLES: [&str; 8] = [
    "boundary.csv",
    "boundary.stl",
    "influence.csv",
    "band.csv",
    "conditioning.csv",
    "cylinders.csv",
    "path.csv",
    "report.html",
];

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
        let drawn = self.drawn(&mesh);
        let figures = &drawn.figures;
        for (name, figure) in figures.named() {
            contents.text(&format!("{name}.svg"), figure.to_svg()?);
            contents.bytes(&format!("{name}.png"), figure.to_png(PNG_SCALE)?);
        }
        let scene = viewer::scene(self, &drawn.coarse, &drawn.coarse_mesh)
            .map_err(|error| PlotError::Drawing(error.to_string()))?;
        contents.text("report.html", html::render(self, figures, &scene)?);
        Ok(contents)
    }

    /// The figures alone.
    pub fn figures(&self) -> Figures {
        self.drawn(&Mesh::of(&self.workspace)).figures
    }

    fn drawn(&self, mesh: &Mesh) -> Drawn {
        let coarse = self.coarse().unwrap_or_else(|| self.workspace.clone());
        let coarse_mesh = Mesh::of(&coarse);
        Drawn {
            figures: figures::figures(self, mesh, &coarse_mesh),
            coarse,
            coarse_mesh,
        }
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

/// The figures, and the coarser workspace that is shown in space.
struct Drawn {
    figures: Figures,
    coarse: Workspace,
    coarse_mesh: Mesh,
}

/// The files of an output folder.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Contents(Vec<(String, Vec<u8>)>);

impl Contents {
    /// Every name that can be there.
    pub fn names() -> impl Iterator<Item = String> {
        let of_figures = Figures::NAMES.into_iter();
        TABLES
            .into_iter()
            .map(str::to_owned)
            .chain(of_figures.flat_map(|name| [format!("{name}.svg"), format!("{name}.png")]))
    }

    fn text(&mut self, name: &str, text: String) {
        self.bytes(name, text.into_bytes());
    }

    fn bytes(&mut self, name: &str, bytes: Vec<u8>) {
        self.0.push((name.to_owned(), bytes));
    }

    /// Names and contents.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.0
            .iter()
            .map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
    }
}
