//! Reports of planned measurements and of what the rows of a file determine, for terminals, programs, and as a samples
//! file to fill in.

use super::Versioned;
use crate::accuracy::uncertainty::ExpectedError;
use crate::files::{Convention, Quantity};
use crate::fit::Frame;
use crate::geometry::range;
use crate::planning::{Determined, Kind, Order, PLANE, Plan, Planned, Precision};
use crate::render::{Section, Table, terminal};
use crate::text::{count, in_lines, list, rounded, small, small_or};
use nalgebra::Vector3;

/// Incremented whenever a field is renamed, removed or changes its meaning.
const SCHEMA_VERSION: u32 = 2;

/// A plan as JSON: lengths in millimetres, angles in degrees; `null` if unknown.
pub fn json(plan: &Plan) -> String {
    super::json(&Versioned::new(SCHEMA_VERSION, plan))
}

/// What the rows of a file determine, as JSON: lengths in millimetres, angles in degrees; `null` if unknown.
pub fn samples_json(determined: &Determined) -> String {
    super::json(&Versioned::new(SCHEMA_VERSION, determined))
}

/// A plan for the terminal, without the measurements.
pub fn text(plan: &Plan) -> String {
    let kinds = number_of_kinds(plan);
    let mut sentences = vec![
        format!("Plan for {}: {kinds}", plan.robot_file),
        plan.assumptions.clone(),
    ];
    sentences.extend(plan.within.as_ref().map(|own| format!("Within: {own} mm")));
    sentences.push(match plan.order {
        Order::Random => format!(
            "Order: random (seed {}). Measure in this order: the last row repeats the first, to show drift.",
            plan.seed
        ),
        Order::Shortest => "Order: shortest path of the joints. A drift during the measurement would go unnoticed.".to_owned(),
    });
    sentences.extend(places(plan));
    sentences.extend(targets(plan));
    terminal::text([Section::new("").texts(sentences), expected(plan)])
}

/// "20 measurements, 1 of them repeated: 13 heights above a plane and 8 distances between two poses".
fn number_of_kinds(plan: &Plan) -> String {
    let kinds = Kind::ALL.into_iter().filter_map(|kind| {
        let own = plan.measurements.iter().filter(|own| own.kind == kind);
        let number = own.count();
        (number > 0).then(|| format!("{number} {}", kind.title()))
    });
    let kinds: Vec<_> = kinds.collect();
    let repeated = match plan.measurements.len() - plan.count {
        0 => String::new(),
        repeated => format!(", {repeated} of them repeated"),
    };
    let measured = count(plan.count, "measurement");
    format!("{measured}{repeated}: {}", list(&kinds))
}

/// What further targets bring.
fn targets(plan: &Plan) -> Option<String> {
    let each = plan
        .by_targets
        .iter()
        .map(|own| small(own.of(plan.absolute)));
    let each: Vec<_> = each.collect();
    (!each.is_empty()).then(|| {
        format!(
            "With one, two and three targets, as many measurements bring {} mm, because the platform tilts.",
            list(&each)
        )
    })
}

/// Where to put planes and points.
fn places(plan: &Plan) -> Vec<String> {
    let setup = &plan.setup;
    let mut sentences = Vec::new();
    for (plane, (name, height)) in setup.planes.iter().zip(&plan.planes) {
        let own = plan.measurements.iter();
        let own = own.filter(|own| own.plane.as_ref() == Some(name));
        let at: Vec<_> = own.map(|own| own.position_mm).collect();
        let range = |axis: usize| {
            let (least, most) = range(at.iter().map(|place| place[axis]));
            let [least, most] = [least, most].map(|own| own.round() + 0.0);
            format!("{least:.0} to {most:.0}")
        };
        let blocks: Vec<_> = plane.blocks.iter().map(|block| rounded(*block)).collect();
        if !at.is_empty() {
            sentences.push(format!(
                "Put {name} at z = {} mm (± 1 cm); touches: x {} and y {} mm, on blocks of {} mm.",
                rounded(*height),
                range(0),
                range(1),
                list(&blocks)
            ));
        }
    }
    if !setup.points.is_empty() {
        let each = setup.points.iter().zip(&plan.points);
        let each = each.map(|(own, (name, at))| {
            let [x, y, z] = at.map(|c| c + 0.0);
            format!("{name} at ({x}, {y}, {z}), {}", lengths(own.lengths))
        });
        let each = each.collect::<Vec<_>>().join("; ");
        sentences.push(format!("Place the points within 2 cm of: {each}."));
    }
    let mut kinds = plan.measurements.iter().map(|own| own.kind);
    if kinds.any(|kind| kind == Kind::Distance) {
        let lengths = lengths(setup.lengths);
        sentences.push(format!("Distances between poses are {lengths}."));
    }
    if setup.frame == Frame::Sensor {
        let known = match setup.datum {
            Some(_) => "known from the datum points",
            None => "unknown (--frame sensor)",
        };
        sentences.push(format!("The frame of the coordinates is {known}."));
    }
    sentences
}

fn lengths((shortest, longest): (f64, f64)) -> String {
    if shortest >= longest {
        format!("{} mm", rounded(shortest))
    } else if longest.is_finite() {
        format!("{} to {} mm", rounded(shortest), rounded(longest))
    } else {
        format!("{} mm or longer", rounded(shortest))
    }
}

fn expected(plan: &Plan) -> Section {
    let place = match &plan.within {
        Some(_) => "the region",
        None => "the workspace",
    };
    let row = |table: Table, name: &str, of: fn(&Precision) -> f64, worst: f64, at: [f64; 3]| {
        let before = small_or("unknown", plan.before.as_ref().map(of));
        let [x, y, z] = at.map(|coordinate| coordinate.round() + 0.0);
        let worst_name = format!("  worst (at {x}, {y}, {z})");
        let name = format!("{name}, rms over {place}");
        let table = table.row(name, [before, small(of(&plan.after))]);
        table.row(worst_name, [String::new(), small(worst)])
    };
    let error = &plan.expected;
    let (worst, at) = (error.relative_worst_mm, error.relative_worst_at_mm);
    let table = Table::new(["Expected position error, mm (σ)", "before", "calibrated"]);
    let table = row(table, "Relative", |own| own.relative, worst, at);
    let (worst, at) = (error.absolute_worst_mm, error.absolute_worst_at_mm);
    let table = row(table, "Absolute", |own| own.absolute, worst, at);
    let criterion = if plan.absolute {
        "absolute"
    } else {
        "relative"
    };
    Section::new("").table(table).note(format!(
        "Relative: after the best rigid motion. Absolute: in the frame of the robot's base. The poses minimise the \
         {criterion} error."
    ))
}

/// What so many poses are for that are not in the file of a calibration.
pub fn others(count: usize, robot: &str, used: &str) -> String {
    format!("{count} random poses to validate {robot} with, none of them in {used}.\n")
}

/// The samples file to fill in: joint angles, empty cells for the readings, and ignored columns with the nominal
/// robot's readings.
pub fn csv(planned: &[Planned], convention: &Convention) -> String {
    let has = |of: &dyn Fn(&Planned) -> bool| planned.iter().any(of);
    let joints = convention.joint_columns();
    let positions = convention.position_columns();
    let heights = has(&|own| own.plane.is_some());
    let named = heights && has(&|own| own.plane.as_deref() != Some(PLANE));
    let points = has(&|own| own.point.is_some());
    let poses = has(&|own| own.to_joints.is_some());
    let mut lines = vec![Vec::new(); planned.len() + 1];
    let mut column = |name: &str, cell: &dyn Fn(&Planned) -> Option<String>| {
        let cells = planned.iter().map(|own| cell(own).unwrap_or_default());
        let cells = std::iter::once(name.to_owned()).chain(cells);
        for (line, cell) in lines.iter_mut().zip(cells) {
            line.push(if cell.contains([',', '"']) {
                format!("\"{}\"", cell.replace('"', "\"\""))
            } else {
                cell
            });
        }
    };
    let empty = |_: &Planned| None;
    if has(&|own| own.name.is_some()) {
        column("name", &|own| own.name.clone());
    }
    if has(&|own| own.repeat.is_some()) {
        column("repeat", &|own| own.repeat.map(|own| own.to_string()));
    }
    for (joint, name) in joints.iter().enumerate() {
        column(name, &|own| Some(rounded(own.joints[joint])));
    }
    for (axis, name) in positions.iter().enumerate() {
        if has(&|own| own.kind.coordinates()[axis]) {
            column(name, &empty);
        }
    }
    if has(&|own| own.reading.turn.is_some()) {
        for own in Quantity::TURNS {
            column(&convention.column(own), &empty);
        }
    }
    if heights {
        column(&convention.column(Quantity::Height), &empty);
    }
    if has(&|own| own.target.is_some()) {
        column("target", &|own| own.target.clone());
    }
    if named {
        column("plane", &|own| own.plane.clone());
    }
    if points || poses {
        column(&convention.column(Quantity::Distance), &empty);
    }
    if points {
        column("point", &|own| own.point.clone());
    }
    for (joint, name) in joints.iter().enumerate().filter(|_| poses) {
        let to = |own: &Planned| Some(rounded(own.to_joints?[joint]));
        column(&format!("to_{name}"), &to);
    }
    for (axis, name) in positions.iter().enumerate() {
        column(&format!("_nominal_{name}"), &|own| {
            let position = convention.vector(&Vector3::from(own.nominal_mm));
            Some(rounded(convention.position(&position)[axis]))
        });
    }
    if heights {
        column("_block_mm", &|own| own.block_mm.map(rounded));
    }
    if points || poses {
        let nominal = |own: &Planned| Some(format!("{:.3}", own.reading.distance?.1));
        column("_nominal_distance_mm", &nominal);
    }
    let lines = lines.iter().map(|cells| cells.join(",") + "\n");
    lines.collect()
}

type Figure = fn(&ExpectedError) -> f64;

/// What the rows of a file determine, for the terminal.
pub fn samples_text(determined: &Determined) -> String {
    let mut summary = Section::new("").text(format!(
        "{} of {} for {}",
        count(determined.row_count, "row"),
        determined.samples_file,
        determined.robot_file
    ));
    let lines = [
        ("Not measured yet", &determined.unmeasured_lines),
        (
            "Not counted: the nominal robot does not reach them",
            &determined.not_reached_lines,
        ),
        (
            "Hardly checked by any other row",
            &determined.unchecked_lines,
        ),
    ];
    for (what, lines) in lines.into_iter().filter(|(_, lines)| !lines.is_empty()) {
        summary = summary.text(format!("{what}: {}.", in_lines(lines)));
    }
    let [before, now, next] = [
        &determined.expected_error_before,
        &determined.expected_error,
        &determined.expected_error_with_next,
    ];
    let row = |rms: Figure, worst: Figure| {
        let cell =
            |own: &Option<ExpectedError>, of: Figure| small_or("unknown", own.as_ref().map(of));
        let mut cells = vec![cell(before, rms), cell(now, rms), cell(now, worst)];
        cells.extend(next.as_ref().map(|own| small(rms(own))));
        cells
    };
    let mut headings = vec![
        "Expected position error, mm (σ)",
        "before",
        "calibrated",
        "worst place",
    ];
    headings.extend(next.as_ref().map(|_| "with additions"));
    let relative = row(|own| own.relative_rms_mm, |own| own.relative_worst_mm);
    let absolute = row(|own| own.absolute_rms_mm, |own| own.absolute_worst_mm);
    let table = Table::new(headings)
        .row("Relative, rms over the workspace", relative)
        .row("Absolute, rms over the workspace", absolute);
    let mut parts = vec![
        summary.text(&determined.verdict),
        Section::new("").table(table),
    ];
    if let Some(obstacle) = &determined.no_next {
        let obstacle = format!("No addition: {obstacle}; {}.", obstacle.remedy());
        parts.push(Section::new("").text(obstacle));
    } else if !determined.next.is_empty() {
        let csv = csv(&determined.next, &determined.setup.robot.convention);
        let section = Section::new("Best additional measurements, in this order");
        parts.push(section.texts(csv.lines()));
    }
    terminal::text(parts)
}
