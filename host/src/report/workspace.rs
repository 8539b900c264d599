//! What is written of a workspace: text for a terminal, JSON, CSV, mesh, figures, and a page.

use super::Versioned;
use crate::accuracy::information::parameters;
use crate::files::convention::{Convention, Vertical};
use crate::geometry::{Limit, range};
use crate::render::page::{self, figure};
use crate::render::plot::{Axis, Colour, Figure, Patch, STEPS, Shape};
use crate::render::{Section, Table, terminal};
use crate::text::count;
use crate::workspace::{
    Analysis, BoundaryPoint, Cylinder, Extent, LimitShare, Mesh, Options, ParameterInfluence,
    ToleranceBand, Workspace, WorkspaceReport, unit,
};
use delta_cal::kinematics::SingularityDistance;
use delta_cal::{ArmIndex, Parameter};
use maud::{Markup, html};
use nalgebra::Vector3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Changes whenever a key of the JSON changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 2;

/// The names of all files, in the order of [`files`].
pub fn names() -> impl Iterator<Item = String> {
    let tables = [
        "boundary.csv",
        "boundary.stl",
        "influence.csv",
        "report.html",
    ];
    let figures = NAMES.map(|name| format!("{name}.svg"));
    tables.into_iter().map(str::to_owned).chain(figures)
}

/// Names and contents of the files of an output folder.
pub fn files(analysis: &Analysis) -> Vec<(String, Vec<u8>)> {
    let figures = figures(analysis);
    let mut contents = vec![
        boundary_csv(analysis).into_bytes(),
        analysis
            .mesh
            .to_stl(&analysis.workspace, &analysis.convention),
        influence_csv(analysis).into_bytes(),
        page(&analysis.report, &figures).into_bytes(),
    ];
    contents.extend(
        figures
            .iter()
            .map(|(figure, _)| figure.to_svg().into_bytes()),
    );
    names().zip(contents).collect()
}

/// As JSON.
pub fn to_json(report: &WorkspaceReport) -> String {
    super::json(&Versioned::new(SCHEMA_VERSION, report))
}

/// `x_mm,y_mm,z_mm,kind`: every point of the boundary and what limits it.
pub fn boundary_csv(analysis: &Analysis) -> String {
    let mut csv = String::from("x_mm,y_mm,z_mm,kind\n");
    for point in &analysis.workspace.points {
        let _ = writeln!(csv, "{}", place(point, &analysis.convention));
    }
    csv
}

/// The same points, the outward normal, and its displacement for each of the 24 parameters, in mm
/// per mm and mm per degree.
fn influence_csv(analysis: &Analysis) -> String {
    let robot = &analysis.workspace.robot;
    let mut csv = String::from("x_mm,y_mm,z_mm,kind,normal_x,normal_y,normal_z");
    for (arm, parameter) in parameters(robot) {
        let _ = write!(csv, ",{}_{}", parameter.symbol(), arm.index() + 1);
    }
    csv.push('\n');
    let points = analysis.workspace.points.iter();
    for (point, moved) in points.zip(&analysis.influence.displacements) {
        let [x, y, z] = analysis.convention.vector(&point.outward).into();
        let place = place(point, &analysis.convention);
        let _ = write!(csv, "{place},{x:.6},{y:.6},{z:.6}");
        for (arm, parameter) in parameters(robot) {
            let value = moved.map(|moved| moved[8 * arm.index() + parameter.index()]);
            let value = value.map(|value| format!("{:.6}", value * unit(parameter)));
            let _ = write!(csv, ",{}", value.unwrap_or_default());
        }
        csv.push('\n');
    }
    csv
}

/// To a nanometre: far below any tolerance.
fn place(point: &BoundaryPoint, convention: &Convention) -> String {
    let [x, y, z] = convention.vector(&point.position).into();
    let limit = convention.limit(point.limit).name();
    format!("{x:.6},{y:.6},{z:.6},{limit}")
}

/// For a terminal.
pub fn to_text(report: &WorkspaceReport) -> String {
    let title = Section::new(format!("Workspace of {}", report.robot_file));
    let sections = sections(report, &|_| html! {}, 8);
    terminal::text([title].into_iter().chain(sections))
}

/// As one HTML file that opens from disk: everything it needs is in it.
fn page(report: &WorkspaceReport, figures: &[(Figure, String)]) -> String {
    let beside = |names: &[&str]| {
        let named = NAMES.iter().zip(figures);
        let chosen = named.filter(|(name, _)| names.contains(name));
        html! { div.views { @for (_, (drawn, caption)) in chosen { (figure(drawn, caption)) } } }
    };
    let title = format!("Workspace of {}", report.robot_file);
    let body = html! {
        h1 { (title) }
        @for section in sections(report, &beside, 16) { (section) }
    };
    page::render(&title, &body)
}

/// What the terminal and the page show; `figures` are seen in a page only. So many cylinders.
fn sections(
    report: &WorkspaceReport,
    figures: &dyn Fn(&[&str]) -> Markup,
    most: usize,
) -> Vec<Section> {
    let WorkspaceReport {
        volume,
        extent_mm: extent,
        conditioning,
        ..
    } = report;
    let axis = |axis, (from, to): (f64, f64)| format!("{axis} {from:.2} to {to:.2} mm");
    let mut sections =
        vec![
        Section::new("Volume and extent")
            .text(format!(
                "Volume {:.2} ± {:.2} litres, boundary {:.3} m²",
                volume.litres, volume.uncertainty_litres, volume.boundary_m2
            ))
            .text([axis("x", extent.x), axis("y", extent.y), axis("z", extent.z)].join(", "))
            .text(format!(
                "{} within {} mm of the boundary, on lines {:.2} mm apart",
                count(report.boundary_points, "point"),
                report.tolerance_mm,
                report.spacing_mm
            ))
            .in_page(figures(&["view", "vertical_xz"])),
        Section::new("What limits the boundary").table(limits(&report.limits)),
        cylinders(report, most),
        Section::new("Influence of the parameters on the boundary")
            .in_page(figures(&["influence"]))
            .table(influence(&report.influence))
            .note("Displacement along the normal, rms over the boundary, mm per mm or per degree."),
    ];
    sections.extend(report.tolerance_band.as_ref().map(band));
    sections.push(
        Section::new("Singularities: conditioning from 0 (singular) to 1 (best)")
            .in_page(figures(&["serial", "parallel"]))
            .text(format!(
                "Clear of singularities in {:.1} % of the volume, {:.2} litres. Least conditioning: \
                 {:.3} for type 1 (serial), {:.3} for type 2 (parallel).",
                100.0 * conditioning.clear_share(),
                conditioning.clear_litres,
                conditioning.least_serial,
                conditioning.least_parallel
            )),
    );
    sections
}

fn limits(limits: &[LimitShare]) -> Table {
    Table::of(limits)
        .column("limit", |limit| limit.kind.name())
        .column("share of the area", |limit| {
            format!("{:.1} %", 100.0 * limit.share)
        })
        .table()
}

/// The largest cylinder, and so many others, evenly chosen.
fn cylinders(report: &WorkspaceReport, most: usize) -> Section {
    let section = Section::new("Upright cylinders about the z axis");
    let Some(largest) = &report.largest_cylinder else {
        return section.text("None: the z axis is not in the workspace.");
    };
    let stride = report.cylinders.len().div_ceil(most).max(1);
    let chosen = report.cylinders.iter().skip(stride - 1).step_by(stride);
    let length = |of: fn(&Cylinder) -> f64| move |row: &&Cylinder| format!("{:.1}", of(row));
    let table = Table::of([largest].into_iter().chain(chosen))
        .column("diameter, mm", length(|of| of.diameter_mm))
        .column("height, mm", length(|of| of.height_mm))
        .column("from z, mm", length(|of| of.bottom_mm))
        .column("to z, mm", length(|of| of.top_mm))
        .column("litres", |of| format!("{:.2}", of.litres))
        .column("", |of| if *of == largest { "the largest" } else { "" });
    section.table(table.table())
}

/// The displacement, and in a page the change of the volume.
fn influence(influence: &[ParameterInfluence]) -> Table {
    let of = |arm: ArmIndex, parameter: Parameter| {
        let mut all = influence.iter();
        all.find(|of| of.arm == arm && of.parameter == parameter)
    };
    let of_first = influence.iter().filter(|of| of.arm == ArmIndex::First);
    let mut rows = Table::of(of_first.map(|of| of.parameter)).column("", |of| of.symbol());
    for arm in ArmIndex::ALL {
        rows = rows.column(format!("mm\n{arm}"), |parameter| {
            of(arm, *parameter).map_or_else(String::new, |of| format!("{:.3}", of.rms_mm))
        });
    }
    for arm in ArmIndex::ALL {
        rows = rows.page_column(format!("volume, l\n{arm}"), |parameter| {
            let of = of(arm, *parameter);
            of.map_or_else(String::new, |of| format!("{:+.3}", of.volume_litres))
        });
    }
    rows.table()
}

fn band(band: &ToleranceBand) -> Section {
    let facts = [
        (
            "boundary along its normal, rms",
            format!("{:.3} mm", band.sigma_mm),
        ),
        (
            "at the worst point",
            format!("{:.3} mm", band.largest_sigma_mm),
        ),
        ("volume", format!("{:.3} litres", band.volume_sigma_litres)),
    ];
    Section::new("Standard uncertainty σ within the stated tolerance").table(Table::facts(facts))
}

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

/// All of them with their captions, in the order of their names.
fn figures(analysis: &Analysis) -> Vec<(Figure, String)> {
    let serial = |at: &SingularityDistance<f64>| at.serial.into_iter().fold(1.0, f64::min);
    let drawn = [
        view(&analysis.workspace),
        section(analysis),
        map(analysis, serial),
        map(analysis, |at| at.parallel),
        displacements(&analysis.report.influence),
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
    drawn.into_iter().zip(captions).collect()
}

/// The plane y = 0, upright whichever way z points.
fn plain(analysis: &Analysis) -> Figure {
    let axis = |label, (from, to): (f64, f64)| {
        let margin = 0.04 * (to - from);
        Axis::linear(label, from - margin, to + margin)
    };
    let [x, _, z] = inside(analysis);
    let label = match analysis.convention.z_axis {
        Vertical::Up => "z, mm",
        Vertical::Down => "−z, mm",
    };
    Figure::new(axis("x, mm", x), axis(label, z))
        .sized(460, 460)
        .with_equal_scales()
}

/// The box that holds the workspace, in the axes inside.
fn inside(analysis: &Analysis) -> [(f64, f64); 3] {
    let Extent { x, y, z } = analysis.report.extent_mm;
    analysis.convention.ranges([x, y, z])
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
    let mut figure = plain(analysis);
    if let Some(cylinder) = &analysis.report.largest_cylinder {
        let r = cylinder.diameter_mm / 2.0;
        let upright = (cylinder.bottom_mm, cylinder.top_mm);
        let [.., (low, high)] = analysis.convention.ranges([(-r, r), (-r, r), upright]);
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
    let [across, _, up] = inside(analysis);
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
    let mut figure = plain(analysis);
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

fn displacements(influences: &[ParameterInfluence]) -> Figure {
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
