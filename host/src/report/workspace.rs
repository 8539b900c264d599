//! What is written of a workspace: text for a terminal, JSON, CSV, mesh, figures, and a page.

mod figures;

use crate::accuracy::information::parameters;
use crate::render::json;
use crate::render::named_figure::{NamedFigure, shown};
use crate::render::page;
use crate::render::plot::PlotError;
use crate::render::section::Section;
use crate::render::table::Table;
use crate::render::terminal;
use crate::text::words::count;
use crate::workspace::{
    Analysis, BoundaryPoint, Cylinder, LimitShare, ParameterInfluence, ToleranceBand,
    WorkspaceReport, unit,
};
use delta_cal::{ArmIndex, Parameter};
pub use figures::figures;
use maud::{Markup, html};
use serde_json::Value;
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
    let figures = figures::NAMES.map(|name| format!("{name}.svg"));
    tables.into_iter().map(str::to_owned).chain(figures)
}

/// Names and contents of the files of an output folder.
///
/// # Errors
/// A figure that cannot be drawn; none is known.
pub fn files(analysis: &Analysis) -> Result<Vec<(String, Vec<u8>)>, PlotError> {
    let figures = figures(analysis);
    let mut contents = vec![
        boundary_csv(analysis).into_bytes(),
        analysis.mesh.to_stl(&analysis.workspace),
        influence_csv(analysis).into_bytes(),
        page(&analysis.report, &figures)?.into_bytes(),
    ];
    for NamedFigure { figure, .. } in &figures {
        contents.push(figure.to_svg()?.into_bytes());
    }
    Ok(names().zip(contents).collect())
}

/// As JSON.
pub fn to_json(report: &WorkspaceReport) -> Value {
    json::report(
        SCHEMA_VERSION,
        serde_json::to_value(report).unwrap_or_default(),
    )
}

/// `x_mm,y_mm,z_mm,kind`: every point of the boundary and what limits it.
pub fn boundary_csv(analysis: &Analysis) -> String {
    let mut csv = String::from("x_mm,y_mm,z_mm,kind\n");
    for point in &analysis.workspace.points {
        let _ = writeln!(csv, "{}", place(point));
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
        let [x, y, z] = point.outward.into();
        let _ = write!(csv, "{},{x:.6},{y:.6},{z:.6}", place(point));
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
fn place(point: &BoundaryPoint) -> String {
    let [x, y, z] = point.position.into();
    format!("{x:.6},{y:.6},{z:.6},{}", point.limit.name())
}

/// For a terminal.
pub fn to_text(report: &WorkspaceReport) -> String {
    let title = Section::new(format!("Workspace of {}", report.robot_file));
    let sections = sections(report, &|_| html! {}, 8);
    terminal::text([title].into_iter().chain(sections))
}

/// As one HTML file that opens from disk: everything it needs is in it.
fn page(report: &WorkspaceReport, figures: &[NamedFigure]) -> Result<String, PlotError> {
    // Drawn before, so that the sections cannot fail.
    let drawn = figures
        .iter()
        .map(|of| Ok((of.name, shown(figures, &[of.name])?)));
    let drawn: Vec<(&str, Markup)> = drawn.collect::<Result<_, PlotError>>()?;
    let beside = |names: &[&str]| {
        let chosen = drawn.iter().filter(|(name, _)| names.contains(name));
        html! { div.views { @for (_, figure) in chosen { (figure) } } }
    };
    let body = html! {
        h1 { "Workspace of " (report.robot_file) }
        @for section in sections(report, &beside, 16) { (section) }
    };
    Ok(page::render(
        &format!("Workspace of {}", report.robot_file),
        &body,
    ))
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
