//! The report as one HTML file that opens from disk: everything it needs is in it.

use super::{LITRE, sections};
use crate::render::named_figure::{NamedFigure, shown};
use crate::render::page::{View, render_with_view, tile};
use crate::render::plot::PlotError;
use crate::render::section::Section;
use crate::render::table::Table;
use crate::text::words::count;
use crate::workspace::{Analysis, PathPoint, PathRow, PathSummary};
use maud::{Markup, html};

const STYLE: &str = include_str!("viewer.css");
const SCRIPT: &str = include_str!("viewer.js");
/// Rows of a path that are shown.
const ROWS: usize = 200;
/// Rows of the cylinders' table.
const CYLINDERS: usize = 16;

/// The whole report. `scene` is what the view in space shows, as JSON.
///
/// # Errors
/// A figure that cannot be drawn; none is known.
pub(super) fn render(
    analysis: &Analysis,
    figures: &[NamedFigure],
    scene: &str,
) -> Result<String, PlotError> {
    let title = format!("Workspace of {}", analysis.name);
    let drawn = |names: &[&str]| shown(figures, names);
    let beside = |names: &[&str]| -> Result<Markup, PlotError> {
        Ok(html! { div.views { (drawn(names)?) } })
    };
    let mut cylinders = sections::cylinders(analysis, CYLINDERS);
    if !analysis.cylinders.is_empty() {
        cylinders = cylinders.after(drawn(&["cylinders"])?);
    }
    let mut in_space = Section::new("In space").in_page(viewer());
    if let Some(left_out) = sections::left_out(analysis) {
        in_space = in_space.part(left_out);
    }
    let mut parts = vec![
        in_space,
        Section::new("Slices")
            .in_page(beside(&["vertical_xz", "vertical_yz", "horizontal"])?)
            .table(sections::limits(analysis)),
        cylinders,
        sections::influence(analysis).after(drawn(&["influence"])?),
    ];
    parts.extend(analysis.band.as_ref().map(sections::tolerance));
    if let Some((name, comparison)) = &analysis.comparison {
        parts.push(sections::difference(analysis, name, comparison));
    }
    parts.push(
        Section::new("Distance from singularities").in_page(beside(&[
            "serial",
            "parallel",
            "serial_horizontal",
            "parallel_horizontal",
        ])?),
    );
    parts.extend(analysis.path.as_ref().map(path));
    let body = html! {
        h1 { (title) }
        (tiles(analysis))
        @for part in &parts { (part) }
    };
    let view = View {
        style: STYLE,
        script: SCRIPT,
        data: scene,
    };
    Ok(render_with_view(&title, &body, &view))
}

fn tiles(analysis: &Analysis) -> Markup {
    let (workspace, volume) = (&analysis.workspace, &analysis.volume);
    let [x, y, z] = analysis
        .extent()
        .map(|(from, to)| format!("{from:.1} to {to:.1}"));
    html! {
        div.tiles {
            (tile("Volume", &format!("{:.2} l", volume.volume / LITRE),
                &format!("± {:.2} l; boundary {:.3} m²", volume.uncertainty / LITRE, volume.area * 1e-6)))
            @match analysis.cylinders.first() {
                Some(largest) => (tile("Largest cylinder",
                    &format!("⌀ {:.1} × {:.1} mm", largest.diameter, largest.height()),
                    &format!("z from {:.1} to {:.1} mm, {:.2} l", largest.bottom, largest.top, largest.volume() / LITRE))),
                None => (tile("Largest cylinder", "none", "the z axis is not in the workspace")),
            }
            @if let Some(band) = &analysis.band {
                (tile("Boundary for the tolerance", &format!("± {:.3} mm", band.sigma),
                    &format!("one sigma, rms; volume ± {:.3} l", band.volume_sigma / LITRE)))
            }
            @if let Some((name, comparison)) = &analysis.comparison {
                (tile(&format!("Against {name}"), &format!("{:.3} mm rms", comparison.rms),
                    &format!("volume {:+.3} l", (comparison.after.volume - comparison.before.volume) / LITRE)))
            }
        }
        p {
            (count(workspace.points.len(), "boundary point")) ", each within " (workspace.tolerance)
            " mm of the boundary, on lines " (format!("{:.2}", workspace.grid.spacing)) " mm apart. "
            "x " (x) ", y " (y) ", z " (z) " mm."
        }
    }
}

fn viewer() -> Markup {
    html! {
        figure.viewer {
            canvas #view tabindex="0" aria-label="The boundary of the workspace, which can be turned" {}
            div.controls {
                label { "Colour: " select #mode {} }
                label { "Cut: " input #cut type="range"; }
            }
            div #legend {}
            figcaption #view-note { "Drag to turn, wheel or pinch to zoom; or arrow keys, + and −. Grey: \
                base and arms." }
        }
    }
}

fn path(path: &PathSummary) -> Section {
    let of_point = |cell: fn(&PathPoint) -> String| {
        move |row: &&PathRow| row.point.as_ref().map_or_else(|_| String::new(), cell)
    };
    let table = Table::of(path.rows.iter().take(ROWS))
        .column("line", |row| row.line)
        .column(
            "x, mm",
            of_point(|point| format!("{:.1}", point.position.x)),
        )
        .column(
            "y, mm",
            of_point(|point| format!("{:.1}", point.position.y)),
        )
        .column(
            "z, mm",
            of_point(|point| format!("{:.1}", point.position.z)),
        )
        .column(
            "nearest, mm",
            of_point(|point| format!("{:.2}", point.nearest.distance)),
        )
        .column("which", |row| match &row.point {
            Ok(point) => point.nearest.kind.name(),
            Err(limit) => format!("beyond reach: {limit}"),
        })
        .column("type 1", of_point(|point| format!("{:.3}", point.serial())))
        .column(
            "type 2",
            of_point(|point| format!("{:.3}", point.conditioning.parallel)),
        )
        .rows_standing_out(|row| row.point.is_err())
        .table();
    let section = sections::path(path).table(table);
    match path.rows.len().saturating_sub(ROWS) {
        0 => section,
        others => section.note(format!("and {others} more in path.csv")),
    }
}
