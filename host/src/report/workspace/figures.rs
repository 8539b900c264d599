//! Slices, maps and a view in space.

use crate::geometry::range::range;
use crate::geometry::reach::Limit;
use crate::render::named_figure::NamedFigure;
use crate::render::plot::{Axis, Colour, Figure, Patch, STEPS, Shape};
use crate::workspace::{Analysis, Mesh, Options, ParameterInfluence, Workspace, WorkspaceReport};
use delta_cal::ArmIndex;
use delta_cal::kinematics::SingularityDistance;
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::collections::BTreeMap;

/// The names of the figures' files, without ending.
pub(super) const NAMES: [&str; 5] = ["view", "vertical_xz", "serial", "parallel", "influence"];

/// Cells of a map across its width.
const CELLS: u32 = 120;
/// The eye of the view in space: turned about z and raised, radians.
const TURN: f64 = 0.6;
const RISE: f64 = 0.3;
/// Lines of the view are so many times further apart than those of the boundary.
const COARSER: f64 = 3.0;
/// By how much the faces of the view overlap, in parts of the spacing of its lines.
const OVERLAP: f64 = 0.1;
/// Upper ends of the classes of a map; the last one is open.
const CLASSES: [f64; 5] = [0.05, 0.1, 0.25, 0.5, 0.75];

/// The colour of what limits a point, and its name without the arm.
const fn class_of(limit: Limit) -> (Colour, &'static str) {
    match limit {
        Limit::JointMaximum(_) => (Colour::Blue, "joint maximum"),
        Limit::JointMinimum(_) => (Colour::Orange, "joint minimum"),
        Limit::Forearm(_) => (Colour::Green, "forearm angle"),
        Limit::Serial(_) | Limit::Unreachable(_) => (Colour::Vermilion, "singularity, type 1"),
        Limit::Parallel(_) => (Colour::Purple, "singularity, type 2"),
        Limit::Assembly(_) | Limit::NonFinite(_) => (Colour::Grey, "elbows upright"),
    }
}

/// All of them, in the order of their names.
pub fn figures(analysis: &Analysis) -> Vec<NamedFigure> {
    let serial = |at: &SingularityDistance<f64>| at.serial.into_iter().fold(1.0, f64::min);
    let drawn = [
        view(&analysis.workspace),
        section(analysis),
        map(analysis, serial),
        map(analysis, |at| at.parallel),
        influence(&analysis.report.influence),
    ];
    let captions = [
        "The boundary, coloured by what limits it.".to_owned(),
        "Section y = 0.".to_owned(),
        format!(
            "Type 1: an arm stretched or folded. Section y = 0; clear above {}.",
            SingularityDistance::<f64>::LEAST_SERIAL
        ),
        format!(
            "Type 2: forearms in one plane. Section y = 0; clear above {}.",
            SingularityDistance::<f64>::LEAST_PARALLEL
        ),
        "Displacement of the boundary along its outward normal for 1 mm or 1° of each parameter: \
         range and rms (dot)."
            .to_owned(),
    ];
    let figures = NAMES.into_iter().zip(drawn).zip(captions);
    figures
        .map(|((name, figure), caption)| NamedFigure::new(name, figure, caption))
        .collect()
}

/// The plane y = 0.
fn plain(report: &WorkspaceReport) -> Figure {
    let axis = |label, (from, to): (f64, f64)| {
        let margin = 0.04 * (to - from);
        Axis::linear(label, from - margin, to + margin)
    };
    let (x, z) = (report.extent_mm.x, report.extent_mm.z);
    Figure::new(axis("x, mm", x), axis("z, mm", z))
        .sized(460, 460)
        .with_equal_scales()
}

type Segments = Vec<[(f64, f64); 2]>;

/// Where the mesh meets that plane, by what limits it, and the largest cylinder.
fn section(analysis: &Analysis) -> Figure {
    let mut kinds: BTreeMap<&str, (Colour, Segments)> = BTreeMap::new();
    for corners in analysis.mesh.corners(&analysis.workspace) {
        let mut crossings = Vec::with_capacity(2);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let [a, b] = [corners[a], corners[b]].map(|corner| corner.position);
            if (a.y > 0.0) != (b.y > 0.0) {
                let x = a + (b - a) * (a.y / (a.y - b.y));
                crossings.push((x.x, x.z));
            }
        }
        if let [from, to] = crossings[..] {
            let (colour, name) = class_of(corners[0].limit);
            let of_kind = kinds.entry(name).or_insert((colour, Vec::new()));
            of_kind.1.push([from, to]);
        }
    }
    let mut figure = plain(&analysis.report);
    if let Some(cylinder) = &analysis.report.largest_cylinder {
        let (r, low, high) = (
            cylinder.diameter_mm / 2.0,
            cylinder.bottom_mm,
            cylinder.top_mm,
        );
        let corners = vec![(-r, low), (r, low), (r, high), (-r, high)];
        figure = figure.with("largest cylinder", Colour::Grey, Shape::Region(corners));
    }
    for (name, (colour, segments)) in kinds {
        figure = figure.with(name, colour, Shape::Segments(segments));
    }
    figure
}

/// Conditioning in the plane y = 0, in classes.
fn map(analysis: &Analysis, value: fn(&SingularityDistance<f64>) -> f64) -> Figure {
    let (across, up) = (analysis.report.extent_mm.x, analysis.report.extent_mm.z);
    let side = (across.1 - across.0).max(up.1 - up.0) / f64::from(CELLS);
    // Runs of cells of one class become one rectangle.
    let row = |row: u32| {
        let from = |column: u32| across.0 + side * f64::from(column);
        let low = up.0 + side * f64::from(row);
        let mut runs: Vec<(usize, u32, u32)> = Vec::new();
        for column in 0..CELLS {
            let x = Vector3::new(from(column) + 0.5 * side, 0.0, low + 0.5 * side);
            let Some(at) = analysis.workspace.conditioning(&x) else {
                continue;
            };
            let class = CLASSES.iter().filter(|end| value(&at) >= **end).count();
            match runs.last_mut() {
                Some((of, _, end)) if *of == class && *end == column => *end += 1,
                _ => runs.push((class, column, column + 1)),
            }
        }
        let rectangle = |(class, begin, end): (usize, u32, u32)| {
            // Rows overlap a little, or the paper shines through between them.
            let (left, right, high) = (from(begin), from(end), low + 1.1 * side);
            let corners = vec![(left, low), (right, low), (right, high), (left, high)];
            (class, corners)
        };
        runs.into_iter().map(rectangle).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<_>> = (0..CELLS).into_par_iter().map(row).collect();
    let mut classes = vec![Vec::new(); STEPS.len()];
    for (class, corners) in rows.into_iter().flatten() {
        classes[class].push((corners, STEPS[class]));
    }
    let mut figure = plain(&analysis.report);
    for (class, patches) in classes.into_iter().enumerate() {
        let name = match class.checked_sub(1).map(|below| CLASSES[below]) {
            None => format!("below {}", CLASSES[0]),
            Some(from) => match CLASSES.get(class) {
                Some(to) => format!("{from} to {to}"),
                None => format!("above {from}"),
            },
        };
        if !patches.is_empty() {
            figure = figure.with(name, Colour::Ink, Shape::Patches(patches));
        }
    }
    figure
}

fn influence(influences: &[ParameterInfluence]) -> Figure {
    let names = influences
        .iter()
        .map(|of| format!("{} {}", of.arm.index() + 1, of.parameter.symbol()))
        .collect();
    let ends = influences
        .iter()
        .flat_map(|of| [of.rms_mm, of.outwards_mm, -of.inwards_mm]);
    let most = ends.fold(1e-9, f64::max) * 1.05;
    let along = Axis::linear(
        "displacement outwards, mm per mm or per degree",
        -most,
        most,
    );
    let mut figure = Figure::new(along, Axis::named("", names)).sized(800, 560);
    let rows = || (0..).map(f64::from).zip(influences);
    let colours = [Colour::Blue, Colour::Vermilion, Colour::Green];
    for (arm, colour) in ArmIndex::ALL.into_iter().zip(colours) {
        let of_arm = || rows().filter(move |(_, of)| of.arm == arm);
        let ranges = of_arm().map(|(row, of)| [(of.inwards_mm, row), (of.outwards_mm, row)]);
        let rms = of_arm().map(|(row, of)| (of.rms_mm, row));
        figure = figure
            .with(arm.to_string(), colour, Shape::Segments(ranges.collect()))
            .with("", colour, Shape::Points(rms.collect()));
    }
    figure
}

/// Shades of each triangle of a coarser mesh, the farthest first.
fn view(fine: &Workspace) -> Figure {
    let spacing = fine.grid.spacing * COARSER;
    let options = Options {
        tolerance: fine.tolerance,
        spacing: Some(spacing),
    };
    // Too coarse for a thin workspace.
    let coarse = Workspace::compute(&fine.robot, &fine.reach, &options);
    let workspace = &coarse.unwrap_or_else(|_| fine.clone());
    let (sin_turn, cos_turn) = TURN.sin_cos();
    let (sin_rise, cos_rise) = RISE.sin_cos();
    let right = Vector3::new(cos_turn, -sin_turn, 0.0);
    let into = Vector3::new(sin_turn * cos_rise, cos_turn * cos_rise, -sin_rise);
    let up = right.cross(&into);
    let light = (up * 0.5 - into + right * -0.4).normalize();
    let mut faces: Vec<(f64, Patch)> = Vec::new();
    let mut kinds: BTreeMap<&str, Colour> = BTreeMap::new();
    for corners in Mesh::of(workspace).corners(workspace) {
        let (colour, name) = class_of(corners[0].limit);
        kinds.insert(name, colour);
        let [a, b, c] = corners.map(|corner| corner.position);
        let normal = (b - a).cross(&(c - a));
        if normal.dot(&into) >= 0.0 {
            continue;
        }
        let shade = 0.45 + 0.55 * normal.normalize().dot(&light).max(0.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 255
        let fill = colour
            .channels()
            .map(|channel| (f64::from(channel) * shade) as u8);
        // A little larger than they are, or the paper shines through between them.
        let centre = (a + b + c) / 3.0;
        let grown = [a, b, c].map(|at| at + (at - centre).normalize() * (OVERLAP * spacing));
        let outline = grown.map(|at| (at.dot(&right), at.dot(&up)));
        faces.push((centre.dot(&into), (outline.to_vec(), fill)));
    }
    faces.sort_by(|a, b| b.0.total_cmp(&a.0));
    let corners = || faces.iter().flat_map(|(_, (outline, _))| outline);
    let (x, y) = (
        range(corners().map(|at| at.0)),
        range(corners().map(|at| at.1)),
    );
    let mut figure = Figure::new(Axis::linear("", x.0, x.1), Axis::linear("", y.0, y.1))
        .sized(460, 420)
        .with_equal_scales()
        .without_axes();
    for (name, colour) in kinds {
        let key = Shape::Patches(vec![(Vec::new(), colour.channels())]);
        figure = figure.with(name, colour, key);
    }
    let patches = faces.into_iter().map(|(_, patch)| patch);
    figure.with("", Colour::Ink, Shape::Patches(patches.collect()))
}
