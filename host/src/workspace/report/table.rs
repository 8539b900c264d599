//! The report for people, with colour as ANSI codes that the printer strips where they are not
//! wanted.

use super::Analysis;
use crate::words::count;
use crate::workspace::{Band, Comparison, Cylinder, PathSummary};
use anstyle::{AnsiColor, Style};
use delta_cal::{ArmIndex, Parameter};
use std::fmt::Write;

const HEADING: Style = Style::new().bold();
const DOUBTFUL: Style = AnsiColor::Yellow.on_default().bold();
/// mm³ in a litre.
const LITRE: f64 = 1e6;
/// Rows of a path that are named, at most.
const NAMED: usize = 10;
/// Rows of the cylinders' table.
pub(super) const CYLINDERS: usize = 8;

/// The whole report.
pub fn render(analysis: &Analysis) -> String {
    let mut text = String::new();
    summary(&mut text, analysis);
    cylinders(&mut text, &analysis.cylinders);
    influence(&mut text, analysis);
    if let Some(band) = &analysis.band {
        tolerance(&mut text, band);
    }
    if let Some((name, comparison)) = &analysis.comparison {
        difference(&mut text, analysis, name, comparison);
    }
    singularities(&mut text, analysis);
    if let Some(summary) = &analysis.path {
        path(&mut text, summary);
    }
    text
}

fn heading(text: &mut String, title: &str) {
    let _ = writeln!(text, "\n{HEADING}{title}{HEADING:#}");
}

fn summary(text: &mut String, analysis: &Analysis) {
    let (workspace, volume) = (&analysis.workspace, &analysis.volume);
    let _ = writeln!(text, "{HEADING}Workspace of {}{HEADING:#}", analysis.name);
    let _ = writeln!(
        text,
        "Volume {:.2} ± {:.2} litres, boundary {:.3} m²",
        volume.volume / LITRE,
        volume.uncertainty / LITRE,
        volume.area * 1e-6,
    );
    for (axis, (from, to)) in ["x", "y", "z"].into_iter().zip(analysis.extent()) {
        let _ = writeln!(text, "{axis} from {from:9.2} to {to:9.2} mm");
    }
    let _ = writeln!(
        text,
        "{} of the boundary, each within {} mm of it, on lines {:.2} mm apart",
        count(workspace.points.len(), "point"),
        workspace.tolerance,
        workspace.grid.spacing,
    );
    heading(text, "What limits it                share of the boundary");
    for (limit, share) in analysis.limits() {
        let _ = writeln!(text, "{:<29} {:6.1} %", limit.name(), 100.0 * share);
    }
}

/// Evenly chosen cylinders, narrow to wide.
pub(super) fn chosen(cylinders: &[Cylinder], most: usize) -> Vec<Cylinder> {
    let rest = cylinders.get(1..).unwrap_or_default();
    let stride = rest.len().div_ceil(most).max(1);
    rest.iter()
        .skip(stride - 1)
        .step_by(stride)
        .copied()
        .collect()
}

fn cylinders(text: &mut String, cylinders: &[Cylinder]) {
    heading(text, "Upright cylinders about the z axis, mm");
    let Some(largest) = cylinders.first() else {
        let _ = writeln!(
            text,
            "{DOUBTFUL}None: the z axis is not in the workspace.{DOUBTFUL:#}"
        );
        return;
    };
    let _ = writeln!(text, "diameter     height     from z       to z     litres");
    let mut line = |cylinder: &Cylinder, note: &str| {
        let _ = writeln!(
            text,
            "{:8.1}   {:8.1}   {:8.1}   {:8.1}   {:8.2}{note}",
            cylinder.diameter,
            cylinder.height(),
            cylinder.bottom,
            cylinder.top,
            cylinder.volume() / LITRE,
        );
    };
    line(largest, "   the largest");
    for cylinder in chosen(cylinders, CYLINDERS) {
        line(&cylinder, "");
    }
}

fn influence(text: &mut String, analysis: &Analysis) {
    heading(
        text,
        "Displacement of the boundary along its normal, rms, mm per mm and mm per degree",
    );
    let _ = write!(text, "      ");
    for parameter in Parameter::ALL {
        let _ = write!(text, "{:>8}", parameter.symbol());
    }
    text.push('\n');
    for arm in ArmIndex::ALL {
        let _ = write!(text, "{arm} ");
        for of in analysis.influence.iter().filter(|of| of.arm == arm) {
            let _ = write!(text, "{:8.3}", of.rms);
        }
        text.push('\n');
    }
}

fn tolerance(text: &mut String, band: &Band) {
    heading(text, "For the stated tolerance");
    let _ = writeln!(
        text,
        "The boundary is off by {:.3} mm (one sigma along its normal, rms over the boundary; {:.3} mm at \
         the\nworst point), the volume by {:.3} litres. 5 % to 95 % of {} drawn robots, rms over {} \
         points:\n{:+.3} to {:+.3} mm.",
        band.sigma,
        band.largest_sigma,
        band.volume_sigma / LITRE,
        band.options.robots,
        band.points.len(),
        -band.low_rms(),
        band.high_rms(),
    );
}

fn difference(text: &mut String, analysis: &Analysis, name: &str, comparison: &Comparison) {
    heading(text, &format!("{} against {name}", analysis.name));
    let _ = writeln!(
        text,
        "Volume {:+.3} litres ({:+.3} %), boundary moved by {:.3} mm rms along its normal",
        (comparison.after.volume - comparison.before.volume) / LITRE,
        100.0 * (comparison.after.volume / comparison.before.volume - 1.0),
        comparison.rms,
    );
    for (way, most) in [
        ("outwards", comparison.outwards),
        ("inwards", comparison.inwards),
    ] {
        if let Some((moved, index)) = most {
            let point = &analysis.workspace.points[index];
            let [x, y, z] = point.position.data.0[0];
            let _ = writeln!(
                text,
                "most {way}: {moved:+.3} mm at ({x:.1}, {y:.1}, {z:.1}), {}",
                point.limit.name(),
            );
        }
    }
    let missing = comparison
        .displacements
        .iter()
        .filter(|moved| moved.is_none())
        .count();
    if missing > 0 {
        let _ = writeln!(
            text,
            "{DOUBTFUL}{} of the boundary have no point of the other robot's boundary near \
             them.{DOUBTFUL:#}",
            count(missing, "point"),
        );
    }
}

fn singularities(text: &mut String, analysis: &Analysis) {
    heading(
        text,
        "Conditioning over the workspace: 0 at a singularity, 1 at best",
    );
    let positions = &analysis.conditioning;
    let clear = positions
        .iter()
        .filter(|at| at.conditioning.is_clear())
        .count();
    let least = |value: fn(&crate::workspace::ConditionedPosition) -> f64| {
        positions.iter().map(value).fold(1.0, f64::min)
    };
    #[allow(clippy::cast_precision_loss)] // some thousands
    let share = 100.0 * clear as f64 / positions.len() as f64;
    let _ = writeln!(
        text,
        "type 1 (serial) at least {:.3}, type 2 (parallel) at least {:.3}; clear of both in {share:.1} %",
        least(crate::workspace::ConditionedPosition::serial),
        least(|at| at.conditioning.parallel),
    );
}

fn path(text: &mut String, path: &PathSummary) {
    heading(
        text,
        &format!("Distance of {} from singularities", path.name),
    );
    if let Some((line, point)) = path.nearest() {
        let [x, y, z] = point.position.data.0[0];
        let _ = writeln!(
            text,
            "{}; the nearest is {:.2} mm away from line {line} at ({x:.1}, {y:.1}, {z:.1}): {}",
            count(path.rows.len(), "row"),
            point.nearest.distance,
            point.nearest.kind.name(),
        );
    }
    let beyond: Vec<_> = path.beyond_reach().collect();
    if beyond.is_empty() {
        let _ = writeln!(text, "Every row is within reach.");
        return;
    }
    let _ = writeln!(
        text,
        "{DOUBTFUL}{} beyond reach:{DOUBTFUL:#}",
        count(beyond.len(), "row")
    );
    for (line, limit) in beyond.iter().take(NAMED) {
        let _ = writeln!(text, "line {line}: {limit}");
    }
    if beyond.len() > NAMED {
        let _ = writeln!(
            text,
            "and {} more; --output lists all in path.csv",
            beyond.len() - NAMED
        );
    }
}
