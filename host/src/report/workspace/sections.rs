//! What the terminal and the page have in common.

use super::LITRE;
use crate::render::section::{Part, Section};
use crate::render::table::Table;
use crate::text::words::count;
use crate::workspace::{Analysis, Band, Comparison, Cylinder, PathSummary};
use delta_cal::{ArmIndex, Parameter};
use maud::html;

/// Pieces that the mesh leaves out are named from so many cells on, and so many of them at most.
const CELLS: f64 = 8.0;
const NAMED: usize = 10;
/// In mm³.
const CUBIC_CENTIMETRE: f64 = 1e3;

/// What limits the boundary.
pub(super) fn limits(analysis: &Analysis) -> Table {
    Table::of(analysis.limits())
        .column("what limits it", |(limit, _)| limit.name())
        .column("share of the boundary", |(_, share)| {
            format!("{:.1} %", 100.0 * share)
        })
        .table()
}

/// What the mesh leaves out, if anything; pieces larger than some cells are named.
pub(super) fn left_out(analysis: &Analysis) -> Option<Part> {
    let pieces = &analysis.mesh.left_out;
    if pieces.is_empty() {
        return None;
    }
    let volume: f64 = pieces.iter().map(|piece| piece.volume.abs()).sum();
    let heading = format!(
        "The mesh is one piece. It leaves out {} apart from it, {:.3} cm³ in all",
        count(pieces.len(), "piece"),
        volume / CUBIC_CENTIMETRE
    );
    let cell = analysis.workspace.grid.spacing.powi(3);
    let named = pieces
        .iter()
        .filter(|piece| piece.volume.abs() > CELLS * cell);
    let named = named.take(NAMED).map(|piece| {
        let [x, y, z] = piece.centre.into();
        let what = if piece.volume < 0.0 {
            "a hollow"
        } else {
            "a piece"
        };
        let volume = piece.volume.abs() / CUBIC_CENTIMETRE;
        format!("{what} of {volume:.1} cm³ about x {x:.0}, y {y:.0}, z {z:.0} mm")
    });
    Some(Part::Doubts(heading, named.collect()))
}

/// The largest upright cylinder, and at most so many others, evenly chosen, narrow to wide.
pub(super) fn cylinders(analysis: &Analysis, most: usize) -> Section {
    let section = Section::new("Upright cylinders about the z axis");
    let Some((largest, others)) = analysis.cylinders.split_first() else {
        let none = "None: the z axis is not in the workspace.".to_owned();
        return section.part(Part::Doubts(none, Vec::new()));
    };
    let stride = others.len().div_ceil(most).max(1);
    let chosen = others.iter().skip(stride - 1).step_by(stride);
    let length = |of: fn(&Cylinder) -> f64| {
        move |(cylinder, _): &(&Cylinder, &str)| format!("{:.1}", of(cylinder))
    };
    let rows = chosen.map(|cylinder| (cylinder, ""));
    let table = Table::of([(largest, "the largest")].into_iter().chain(rows))
        .column("diameter, mm", length(|cylinder| cylinder.diameter))
        .column("height, mm", length(Cylinder::height))
        .column("from z, mm", length(|cylinder| cylinder.bottom))
        .column("to z, mm", length(|cylinder| cylinder.top))
        .column("litres", |(cylinder, _)| {
            format!("{:.2}", cylinder.volume() / LITRE)
        })
        .column("", |(_, note)| *note)
        .table();
    section.table(table)
}

/// How the boundary moves with each parameter.
pub(super) fn influence(analysis: &Analysis) -> Section {
    let of = |arm: ArmIndex, parameter: Parameter| {
        let mut all = analysis.influence.iter();
        all.find(|of| of.arm == arm && of.parameter == parameter)
    };
    let heading = |arm: ArmIndex, over: &str| match arm {
        ArmIndex::First => format!("{over}\n{arm}"),
        _ => format!("\n{arm}"),
    };
    let drive = analysis.workspace.robot.drive();
    let mut rows =
        Table::of(drive.parameters().iter().copied()).column("", |parameter| parameter.symbol());
    for arm in ArmIndex::ALL {
        rows = rows.column(heading(arm, "rms"), |parameter| {
            of(arm, *parameter).map_or_else(String::new, |of| format!("{:.3}", of.rms))
        });
    }
    for arm in ArmIndex::ALL {
        rows = rows.page_column(heading(arm, "volume"), |parameter| {
            let of = of(arm, *parameter);
            of.map_or_else(String::new, |of| format!("{:+.3}", of.volume / LITRE))
        });
    }
    Section::new("Influence of the parameters on the boundary")
        .table(rows.table())
        .note("rms: displacement along the normal over the boundary, mm per mm and mm per degree.")
        .in_page(html! { p.note { "volume: its change, litres per mm and litres per degree." } })
}

/// Where the boundary lies for the stated tolerance.
pub(super) fn tolerance(band: &Band) -> Section {
    let (low, high) = (-band.low_rms(), band.high_rms());
    let facts = [
        (
            "one sigma of the boundary along its normal, rms",
            format!("{:.3} mm", band.sigma),
        ),
        (
            "one sigma at the worst point",
            format!("{:.3} mm", band.largest_sigma),
        ),
        (
            "5 % to 95 % of the drawn robots, rms over the points",
            format!("{low:+.3} to {high:+.3} mm"),
        ),
        (
            "one sigma of the volume",
            format!("{:.3} litres", band.volume_sigma / LITRE),
        ),
    ];
    Section::new("For the stated tolerance")
        .table(Table::facts(facts))
        .note(format!(
            "One sigma to first order. Drawn: the boundaries of {} robots, each parameter drawn normally \
             with the tolerance as its sigma, found anew at {} points.",
            band.options.robots,
            band.points.len()
        ))
}

/// What is different in another robot.
pub(super) fn difference(analysis: &Analysis, name: &str, comparison: &Comparison) -> Section {
    let (before, after) = (comparison.before.volume, comparison.after.volume);
    let change = format!(
        "{:+.3} litres ({:+.3} %)",
        (after - before) / LITRE,
        100.0 * (after / before - 1.0)
    );
    let facts = [
        ("volume before", format!("{:.3} litres", before / LITRE)),
        ("volume after", format!("{:.3} litres", after / LITRE)),
        ("change of the volume", change),
        (
            "displacement of the boundary along its normal, rms",
            format!("{:.3} mm", comparison.rms),
        ),
    ];
    let section = Section::new(format!("Compared with {name}")).table(Table::facts(facts));
    let most = [
        ("outwards", comparison.outwards),
        ("inwards", comparison.inwards),
    ];
    let section = most.into_iter().fold(section, |section, (way, most)| {
        let Some((moved, index)) = most else {
            return section;
        };
        let point = &analysis.workspace.points[index];
        let [x, y, z] = point.position.data.0[0];
        let limit = point.limit.name();
        section.text(format!(
            "most {way}: {moved:+.3} mm at ({x:.1}, {y:.1}, {z:.1}), {limit}"
        ))
    });
    let missing = comparison
        .displacements
        .iter()
        .filter(|moved| moved.is_none());
    match missing.count() {
        0 => section,
        missing => section.part(Part::Doubts(
            format!(
                "{} of the boundary have no point of the other robot's boundary near them.",
                count(missing, "point")
            ),
            Vec::new(),
        )),
    }
}

/// How near a path comes to a singularity.
pub(super) fn path(path: &PathSummary) -> Section {
    let section = Section::new(format!("Distance of {} from singularities", path.name));
    let Some((line, point)) = path.nearest() else {
        return section;
    };
    let [x, y, z] = point.position.data.0[0];
    section.text(format!(
        "{}; the nearest singularity is {:.2} mm away from line {line} at ({x:.1}, {y:.1}, {z:.1}): {}.",
        count(path.rows.len(), "row"),
        point.nearest.distance,
        point.nearest.kind,
    ))
}
