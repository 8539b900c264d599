//! Reports of a workspace: terminal text, JSON, CSV, mesh and a figure.

use super::Versioned;
use crate::accuracy::information::parameters;
use crate::files::Convention;
use crate::geometry::Limit;
use crate::render::plot::{Axis, Colour, Figure, Shape};
use crate::render::{Section, Table, terminal};
use crate::text::count;
use crate::workspace::{Analysis, BoundaryPoint, Extent, ParameterInfluence, ToleranceBand, unit};
use delta_cal::ArmIndex;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Incremented whenever a key of the JSON is renamed, removed or changes its meaning.
pub const SCHEMA_VERSION: u32 = 2;

/// The names of all files, in the order of [`files`].
pub const NAMES: [&str; 4] = [
    "boundary.csv",
    "boundary.stl",
    "influence.csv",
    "section.svg",
];

/// Names and contents of the files of an output folder.
pub fn files(analysis: &Analysis) -> Vec<(&'static str, Vec<u8>)> {
    let stl = (analysis.mesh).to_stl(&analysis.workspace, &analysis.convention);
    let contents = [
        boundary_csv(analysis).into_bytes(),
        stl,
        influence_csv(analysis).into_bytes(),
        section(analysis).to_svg().into_bytes(),
    ];
    NAMES.into_iter().zip(contents).collect()
}

/// The report as JSON.
pub fn to_json(report: &Analysis) -> String {
    super::json(&Versioned::new(SCHEMA_VERSION, report))
}

/// `x_mm,y_mm,z_mm,kind`: every boundary point and the limit that causes it.
pub fn boundary_csv(analysis: &Analysis) -> String {
    let mut csv = String::from("x_mm,y_mm,z_mm,kind\n");
    for point in &analysis.workspace.points {
        let _ = writeln!(csv, "{}", place(point, &analysis.convention));
    }
    csv
}

/// The same points with the outward normal and its displacement for each of the 24 parameters, in mm per mm and mm per
/// degree.
fn influence_csv(analysis: &Analysis) -> String {
    let robot = &analysis.workspace.robot;
    let mut csv = String::from("x_mm,y_mm,z_mm,kind,normal_x,normal_y,normal_z");
    for (arm, parameter) in parameters(robot) {
        let _ = write!(csv, ",{}_{}", parameter.symbol(), arm.index() + 1);
    }
    csv.push('\n');
    let points = analysis.workspace.points.iter();
    for (point, moved) in points.zip(&analysis.displacements.0) {
        let [x, y, z] = analysis.convention.vector(&point.outward).into();
        let place = place(point, &analysis.convention);
        let _ = write!(csv, "{place},{x:.6},{y:.6},{z:.6}");
        for (arm, parameter) in parameters(robot) {
            let value = moved.map(|moved| moved[8 * arm.index() + parameter.index()]);
            let unit = analysis.convention.sign(parameter) * unit(parameter);
            let value = value.map(|value| format!("{:.6}", value * unit + 0.0));
            let _ = write!(csv, ",{}", value.unwrap_or_default());
        }
        csv.push('\n');
    }
    csv
}

/// Position to a nanometre, far below any tolerance, and limit.
fn place(point: &BoundaryPoint, convention: &Convention) -> String {
    let [x, y, z] = convention.vector(&point.position).into();
    let limit = convention.limit(point.limit).name();
    format!("{x:.6},{y:.6},{z:.6},{limit}")
}

/// The report for the terminal.
pub fn to_text(report: &Analysis) -> String {
    let Analysis {
        volume,
        extent_mm: extent,
        conditioning,
        ..
    } = report;
    let axis = |axis, (from, to): (f64, f64)| format!("{axis} {from:.2} to {to:.2} mm");
    let mut sections =
        vec![
        Section::new(format!("Workspace of {}", report.robot_file)),
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
            )),
        Section::new("What limits the boundary").table(
            Table::of(&report.limits)
                .column("limit", |own| own.kind.clone())
                .column("share of the area", |own| format!("{:.1} %", 100.0 * own.share)),
        ),
        cylinders(report),
        Section::new("Influence of the parameters on the boundary")
            .table(influence(&report.influence))
            .note("Displacement along the normal, rms over the boundary, mm per mm or per degree."),
    ];
    sections.extend(report.tolerance_band.as_ref().map(band));
    sections.push(
        Section::new("Singularities: conditioning from 0 (singular) to 1 (best)").text(format!(
            "Clear of singularities in {:.1} % of the volume, {:.2} litres. Least conditioning: \
             {:.3} for type 1 (serial), {:.3} for type 2 (parallel).",
            100.0 * conditioning.clear_share(),
            conditioning.clear_litres,
            conditioning.least_serial,
            conditioning.least_parallel
        )),
    );
    terminal::text(sections)
}

/// Number of cylinders shown besides the largest.
const CYLINDERS: usize = 8;

/// The largest cylinder and an even selection of the others.
fn cylinders(report: &Analysis) -> Section {
    let section = Section::new("Upright cylinders about the z axis");
    let Some(largest) = &report.largest_cylinder else {
        return section.text("None: the z axis is not in the workspace.");
    };
    let stride = report.cylinders.len().div_ceil(CYLINDERS).max(1);
    let chosen = report.cylinders.iter().skip(stride - 1).step_by(stride);
    let headings = ["diameter, mm", "height, mm", "from z, mm", "to z, mm"];
    let table = Table::of([largest].into_iter().chain(chosen))
        .vector(headings, |of| {
            [of.diameter_mm, of.height_mm, of.bottom_mm, of.top_mm].map(|own| format!("{own:.1}"))
        })
        .column("litres", |of| format!("{:.2}", of.litres))
        .column("", |of| if *of == largest { "the largest" } else { "" });
    section.table(table)
}

fn influence(influence: &[ParameterInfluence]) -> Table {
    let of_first = influence.iter().filter(|of| of.arm == 1);
    let mut rows = Table::of(of_first.map(|of| of.parameter)).column("", |of| *of);
    for arm in ArmIndex::ALL {
        let own = |of: &&ParameterInfluence| of.arm == arm.index() + 1;
        rows = rows.column(format!("mm\n{arm}"), |parameter| {
            let mut own = influence.iter().filter(own);
            let of = own.find(|of| of.parameter == *parameter);
            of.map_or_else(String::new, |of| format!("{:.3}", of.rms_mm))
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

/// The colour of a limit, and its name without the arm.
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

type Segments = Vec<[(f64, f64); 2]>;

/// Cross-section of the mesh at y = 0, coloured by limit, with the largest cylinder.
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
    let axis = |label, (from, to): (f64, f64)| {
        let margin = 0.04 * (to - from);
        Axis::linear(label, from - margin, to + margin)
    };
    // The internal axes: upright whichever way z points.
    let Extent { x, y, z } = analysis.extent_mm;
    let [x, _, z] = analysis.convention.ranges([x, y, z]);
    let upright = analysis.convention.height(1.0) > 0.0;
    let label = if upright { "z, mm" } else { "−z, mm" };
    let mut figure = Figure::new(axis("x, mm", x), axis(label, z))
        .sized(460, 460)
        .with_equal_scales();
    if let Some(cylinder) = &analysis.largest_cylinder {
        let r = cylinder.diameter_mm / 2.0;
        let upright = (cylinder.bottom_mm, cylinder.top_mm);
        let [.., (low, high)] = analysis.convention.ranges([(-r, r), (-r, r), upright]);
        let shape = Shape::Tiles(vec![[(-r, low), (r, high)]], 0.2);
        figure = figure.with("largest cylinder", Colour::Grey, shape);
    }
    for (name, (colour, segments)) in kinds {
        figure = figure.with(name, colour, Shape::Segments(segments));
    }
    figure
}
