//! The files of an output folder.

use super::figures;
use super::{csv, html, viewer};
use crate::render::named_figure::NamedFigure;
use crate::render::plot::PlotError;
use crate::workspace::{Analysis, Mesh, Options, Workspace};

/// What is looked at in space has lines so many times further apart.
const COARSER: f64 = 2.0;

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

/// Names and contents.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Contents(Vec<(String, Vec<u8>)>);

impl Contents {
    /// All files of an analysis.
    ///
    /// # Errors
    /// A figure or a text that cannot be made; none is known.
    pub fn of(analysis: &Analysis) -> Result<Self, PlotError> {
        let mut contents = Self::default();
        let comparison = analysis
            .comparison
            .as_ref()
            .map(|(_, comparison)| comparison);
        contents.text("boundary.csv", csv::boundary(&analysis.workspace));
        contents.bytes("boundary.stl", analysis.mesh.to_stl());
        contents.text(
            "influence.csv",
            csv::influence(&analysis.workspace, comparison),
        );
        if let Some(band) = &analysis.band {
            contents.text("band.csv", csv::band(&band.points));
        }
        contents.text(
            "conditioning.csv",
            csv::conditioning(&analysis.conditioning),
        );
        contents.text("cylinders.csv", csv::cylinders(&analysis.cylinders));
        if let Some(path) = &analysis.path {
            contents.text("path.csv", csv::path(path));
        }
        let drawn = Drawn::of(analysis);
        let figures = &drawn.figures;
        for NamedFigure { name, figure, .. } in figures {
            contents.text(&format!("{name}.svg"), figure.to_svg()?);
        }
        let scene = viewer::scene(analysis, &drawn.coarse, &drawn.coarse_mesh).unwrap_or_default();
        contents.text("report.html", html::render(analysis, figures, &scene)?);
        Ok(contents)
    }

    /// Every name that can be there.
    pub fn names() -> impl Iterator<Item = String> {
        let of_figures = figures::NAMES.map(|name| format!("{name}.svg"));
        TABLES.into_iter().map(str::to_owned).chain(of_figures)
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

/// The figures alone.
pub fn figures(analysis: &Analysis) -> Vec<NamedFigure> {
    Drawn::of(analysis).figures
}

/// The figures, and the coarser workspace that is shown in space.
struct Drawn {
    figures: Vec<NamedFigure>,
    coarse: Workspace,
    coarse_mesh: Mesh,
}

impl Drawn {
    fn of(analysis: &Analysis) -> Self {
        let coarse = coarse(&analysis.workspace).unwrap_or_else(|| analysis.workspace.clone());
        let coarse_mesh = Mesh::of(&coarse);
        Self {
            figures: figures::figures(analysis, &coarse_mesh),
            coarse,
            coarse_mesh,
        }
    }
}

/// The same workspace on fewer lines, for what is looked at.
fn coarse(workspace: &Workspace) -> Option<Workspace> {
    let options = Options {
        tolerance: workspace.tolerance,
        spacing: Some(workspace.grid.spacing * COARSER),
    };
    Workspace::compute(&workspace.robot, &workspace.reach, &options).ok()
}
