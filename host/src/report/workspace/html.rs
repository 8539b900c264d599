//! The report as one HTML file that opens from disk: everything it needs is in it.

use super::figures::{Figures, INFLUENCE, caption};
use super::table::{CYLINDERS, chosen};
use crate::render::page::{View, figure, render_with_view};
use crate::render::plot::PlotError;
use crate::text::words::count;
use crate::workspace::Analysis;
use crate::workspace::{Band, Comparison, Cylinder, PathSummary};
use delta_cal::{ArmIndex, Parameter};
use maud::{Markup, html};

const STYLE: &str = include_str!("viewer.css");
const SCRIPT: &str = include_str!("viewer.js");
/// mm³ in a litre.
const LITRE: f64 = 1e6;
/// Rows of a path that are shown.
const ROWS: usize = 200;

/// The whole report. `scene` is what the view in space shows, as JSON.
///
/// # Errors
/// A figure that cannot be drawn; none is known.
pub(super) fn render(
    analysis: &Analysis,
    figures: &Figures,
    scene: &str,
) -> Result<String, PlotError> {
    let title = format!("Workspace of {}", analysis.name);
    let body = html! {
            h1 { (title) }
            (tiles(analysis))
            section {
                h2 { "In space" }
                (viewer())
            }
            section {
                h2 { "Slices" }
                div.views {
                    (figure(&figures.vertical_xz, "Section y = 0.")?)
                    (figure(&figures.vertical_yz, "Section x = 0.")?)
                    (figure(&figures.horizontal, "Outlines at five heights, from above.")?)
                }
                (limits(analysis))
            }
            section {
                h2 { "Upright cylinders about the z axis" }
                @if analysis.cylinders.is_empty() {
                    p { "None: the z axis is not in the workspace." }
                } @else {
                    (figure(&figures.cylinders, "The highest cylinder of each diameter that \
                        is all inside the workspace.")?)
                    (cylinders(&analysis.cylinders))
                }
            }
            section {
                h2 { "Influence of the parameters on the boundary" }
                (figure(&figures.influence, INFLUENCE)?)
                (influence(analysis))
            }
            @if let Some(band) = &analysis.band {
                section { h2 { "For the stated tolerance" } (tolerance(band)) }
            }
            @if let Some((name, comparison)) = &analysis.comparison {
                section {
                    h2 { "Compared with " (name) }
                    (difference(analysis, comparison))
                }
            }
            section {
                h2 { "Distance from singularities" }
                div.views {
                    (figure(&figures.serial, &caption("Type 1 (an arm stretched or folded), \
                        section y = 0"))?)
                    (figure(&figures.parallel, &caption("Type 2 (forearms in one plane), \
                        section y = 0"))?)
                    (figure(&figures.serial_horizontal, "Type 1, horizontal section at the \
                        top of the largest cylinder.")?)
                    (figure(&figures.parallel_horizontal, "Type 2, the same section.")?)
                }
            }
            @if let Some(summary) = &analysis.path {
                section { h2 { "Path " (summary.name) } (path(summary)) }
            }
    };
    let view = View {
        style: STYLE,
        script: SCRIPT,
        data: scene,
    };
    Ok(render_with_view(&title, &body, &view))
}

fn tile(name: &str, value: &str, note: &str) -> Markup {
    html! {
        div.tile {
            div.name { (name) }
            div.value { (value) }
            div.was { (note) }
        }
    }
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

fn limits(analysis: &Analysis) -> Markup {
    html! {
        table {
            thead { tr { th { "what limits it" } th { "share of the boundary" } } }
            tbody {
                @for (limit, share) in analysis.limits() {
                    tr { th scope="row" { (limit.name()) } td { (format!("{:.1} %", 100.0 * share)) } }
                }
            }
        }
    }
}

fn cylinders(cylinders: &[Cylinder]) -> Markup {
    let largest = cylinders.iter().take(1).copied();
    html! {
        table {
            thead { tr { th { "diameter, mm" } th { "height, mm" } th { "from z, mm" } th { "to z, mm" } th { "litres" } th {} } }
            tbody {
                @for (index, cylinder) in largest.chain(chosen(cylinders, 2 * CYLINDERS)).enumerate() {
                    tr {
                        td { (format!("{:.1}", cylinder.diameter)) }
                        td { (format!("{:.1}", cylinder.height())) }
                        td { (format!("{:.1}", cylinder.bottom)) }
                        td { (format!("{:.1}", cylinder.top)) }
                        td { (format!("{:.2}", cylinder.volume() / LITRE)) }
                        td { @if index == 0 { "the largest" } }
                    }
                }
            }
        }
    }
}

fn influence(analysis: &Analysis) -> Markup {
    let of = |arm: ArmIndex, parameter: Parameter| {
        analysis
            .influence
            .iter()
            .find(move |of| of.arm == arm && of.parameter == parameter)
    };
    html! {
        table {
            thead {
                tr { th rowspan="2" {} th colspan="3" { "rms, mm per mm or °" } th colspan="3" { "volume, litres per mm or °" } }
                tr { @for arm in [1, 2, 3, 1, 2, 3] { th { "arm " (arm) } } }
            }
            tbody {
                @for parameter in Parameter::ALL {
                    tr {
                        th scope="row" { (parameter.symbol()) }
                        @for arm in ArmIndex::ALL {
                            td { @if let Some(of) = of(arm, parameter) { (format!("{:.3}", of.rms)) } }
                        }
                        @for arm in ArmIndex::ALL {
                            td { @if let Some(of) = of(arm, parameter) { (format!("{:+.3}", of.volume / LITRE)) } }
                        }
                    }
                }
            }
        }
    }
}

fn tolerance(band: &Band) -> Markup {
    html! {
        table {
            tbody {
                tr { th scope="row" { "σ of the boundary along its normal, rms" } td { (format!("{:.3} mm", band.sigma)) } }
                tr { th scope="row" { "σ at the worst point" } td { (format!("{:.3} mm", band.largest_sigma)) } }
                tr { th scope="row" { "5 % to 95 % of the drawn robots, rms over the points" } td {
                    (format!("{:.3} to {:+.3} mm", -band.low_rms(), band.high_rms())) } }
                tr { th scope="row" { "σ of the volume" } td { (format!("{:.3} l", band.volume_sigma / LITRE)) } }
            }
        }
        p.note {
            "σ to first order. Quantiles: the boundaries of " (band.options.robots) " robots, each parameter \
            drawn normally with the tolerance as its σ, found anew at " (band.points.len()) " points."
        }
    }
}

fn difference(analysis: &Analysis, comparison: &Comparison) -> Markup {
    let litres = |volume: f64| format!("{:.3} l", volume / LITRE);
    html! {
        table {
            tbody {
                tr { th scope="row" { "volume before" } td { (litres(comparison.before.volume)) } }
                tr { th scope="row" { "volume after" } td { (litres(comparison.after.volume)) } }
                tr { th scope="row" { "displacement of the boundary, rms" } td { (format!("{:.3} mm", comparison.rms)) } }
                @for (way, most) in [("outwards", comparison.outwards), ("inwards", comparison.inwards)] {
                    @if let Some((moved, index)) = most {
                        @let point = &analysis.workspace.points[index];
                        @let [x, y, z] = point.position.data.0[0];
                        tr {
                            th scope="row" { "most " (way) }
                            td { (format!("{moved:+.3} mm at ({x:.1}, {y:.1}, {z:.1})")) }
                        }
                    }
                }
            }
        }
    }
}

fn path(path: &PathSummary) -> Markup {
    let rows = path.rows.len();
    html! {
        @if let Some((line, point)) = path.nearest() {
            p {
                "The nearest singularity is " b { (format!("{:.2} mm", point.nearest.distance)) }
                " away from line " (line) ": " (point.nearest.kind.to_string()) "."
            }
        }
        table {
            thead { tr { th { "line" } th { "x, mm" } th { "y, mm" } th { "z, mm" } th { "nearest, mm" } th { "which" } th { "type 1" } th { "type 2" } } }
            tbody {
                @for row in path.rows.iter().take(ROWS) {
                    @match &row.point {
                        Ok(point) => {
                            tr {
                                td { (row.line) }
                                @for value in point.position.iter() { td { (format!("{value:.1}")) } }
                                td { (format!("{:.2}", point.nearest.distance)) }
                                td { (point.nearest.kind.name()) }
                                td { (format!("{:.3}", point.conditioning.serial.into_iter().fold(1.0, f64::min))) }
                                td { (format!("{:.3}", point.conditioning.parallel)) }
                            }
                        }
                        Err(limit) => {
                            tr.outlying { td { (row.line) } td colspan="7" { "beyond reach: " (limit) } }
                        }
                    }
                }
            }
        }
        @if rows > ROWS { p.note { "and " (rows - ROWS) " more in path.csv" } }
    }
}
