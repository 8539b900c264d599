//! The report for people at a terminal.

use super::{LITRE, sections};
use crate::render::section::{Part, Section};
use crate::render::terminal;
use crate::text::words::count;
use crate::workspace::{Analysis, ConditionedPosition, PathSummary};

/// Rows of a path that are named, at most.
const NAMED: usize = 10;
/// Rows of the cylinders' table.
const CYLINDERS: usize = 8;

/// The whole report.
pub fn render(analysis: &Analysis) -> String {
    let mut parts = vec![
        summary(analysis),
        Section::new("").table(sections::limits(analysis)),
        sections::cylinders(analysis, CYLINDERS),
        sections::influence(analysis),
    ];
    parts.extend(analysis.band.as_ref().map(sections::tolerance));
    if let Some((name, comparison)) = &analysis.comparison {
        parts.push(sections::difference(analysis, name, comparison));
    }
    parts.push(singularities(analysis));
    parts.extend(analysis.path.as_ref().map(path));
    terminal::text(parts)
}

fn summary(analysis: &Analysis) -> Section {
    let (workspace, volume) = (&analysis.workspace, &analysis.volume);
    let axes = ["x", "y", "z"].into_iter().zip(analysis.extent());
    let section = Section::new(format!("Workspace of {}", analysis.name)).text(format!(
        "Volume {:.2} ± {:.2} litres, boundary {:.3} m²",
        volume.volume / LITRE,
        volume.uncertainty / LITRE,
        volume.area * 1e-6,
    ));
    let section = axes.fold(section, |section, (axis, (from, to))| {
        section.text(format!("{axis} from {from:.2} to {to:.2} mm"))
    });
    let section = section.text(format!(
        "{} of the boundary, each within {} mm of it, on lines {:.2} mm apart",
        count(workspace.points.len(), "point"),
        workspace.tolerance,
        workspace.grid.spacing,
    ));
    match sections::left_out(analysis) {
        Some(left_out) => section.part(left_out),
        None => section,
    }
}

fn singularities(analysis: &Analysis) -> Section {
    let positions = &analysis.conditioning;
    let clear = positions.iter().filter(|at| at.conditioning.is_clear());
    let clear = clear.count();
    let least =
        |value: fn(&ConditionedPosition) -> f64| positions.iter().map(value).fold(1.0, f64::min);
    #[allow(clippy::cast_precision_loss)] // some thousands
    let share = 100.0 * clear as f64 / positions.len() as f64;
    Section::new("Conditioning over the workspace: 0 at a singularity, 1 at best").text(format!(
        "type 1 (serial) at least {:.3}, type 2 (parallel) at least {:.3}; clear of both in {share:.1} %",
        least(ConditionedPosition::serial),
        least(|at| at.conditioning.parallel),
    ))
}

fn path(path: &PathSummary) -> Section {
    let section = sections::path(path);
    let beyond: Vec<_> = path.beyond_reach().collect();
    if beyond.is_empty() {
        return section.text("Every row is within reach.");
    }
    let lines = beyond.iter().take(NAMED);
    let lines = lines.map(|(line, limit)| format!("line {line}: {limit}"));
    let heading = format!("{} beyond reach:", count(beyond.len(), "row"));
    let section = section.part(Part::Doubts(heading, lines.collect()));
    match beyond.len().saturating_sub(NAMED) {
        0 => section,
        others => section.text(format!("and {others} more; --output lists all in path.csv")),
    }
}
