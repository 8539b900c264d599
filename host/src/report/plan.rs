//! Reports of planned measurements and of what the rows of a file determine, for terminals, programs, and as a samples
//! file to fill in.

use super::Versioned;
use super::calibration::{ExpectedReport, expected_report};
use crate::accuracy::uncertainty::{ExpectedError, PositionSigma};
use crate::files::columns::Quantity;
use crate::fit::Frame;
use crate::geometry::range;
use crate::planning::{
    Determined, Kind, Order, PLANE, Plan, PlanRequest, Planned, Precision, Setup,
};
use crate::render::{Section, Table, terminal};
use crate::text::{
    count, in_file_units, in_lines, in_words, joint, list, rounded, small, small_or,
};
use nalgebra::Vector3;
use serde::Serialize;

/// Incremented whenever a field is renamed, removed or changes its meaning.
const SCHEMA_VERSION: u32 = 2;

/// A measurement to take.
#[derive(Debug, Serialize)]
struct Measurement<'a> {
    measure: String,
    /// Degrees, or millimetres of travel.
    joints: [f64; 3],
    /// Position of the nominal robot.
    position_mm: [f64; 3],
    /// Joints of the pose from which a distance between poses is measured.
    to_joints: Option<[f64; 3]>,
    plane: Option<&'a str>,
    block_mm: Option<f64>,
    point: Option<&'a str>,
}

fn measurements<'a>(planned: &[Planned], setup: &'a Setup) -> Vec<Measurement<'a>> {
    let convention = &setup.robot.convention;
    let all = planned.iter().map(|own| Measurement {
        measure: own.kind.name(),
        joints: convention.joints(&own.pose.joints),
        position_mm: convention.vector(&own.pose.position).into(),
        to_joints: own.other.map(|other| convention.joints(&other.joints)),
        plane: plane_of(own, setup).map(|(name, _)| name),
        block_mm: plane_of(own, setup).map(|(_, block)| block),
        point: point_of(own, setup).map(|(name, _)| name),
    });
    all.collect()
}

/// Name of the plane, and gauge block.
fn plane_of<'a>(own: &Planned, setup: &'a Setup) -> Option<(&'a str, f64)> {
    let (plane, block) = own.plane?;
    let plane = setup.planes.get(plane)?;
    Some((&plane.name, *plane.blocks.get(block)?))
}

/// Name and position of the point.
fn point_of<'a>(own: &Planned, setup: &'a Setup) -> Option<(&'a str, Vector3<f64>)> {
    let index = own.point?;
    let place = setup.places.points.get(index)?.place;
    Some((&setup.points.get(index)?.name, place))
}

/// A plan as JSON: lengths in millimetres, angles in degrees; `null` if unknown.
pub fn json(request: &PlanRequest<'_>, plan: &Plan) -> String {
    #[derive(Serialize)]
    struct Contents<'a> {
        robot_file: &'a str,
        measure: String,
        /// Number of different measurements; repetitions are in the list as well.
        count: usize,
        order: Order,
        seed: u64,
        absolute: bool,
        within: Option<String>,
        /// Noise and tolerance, in words.
        assumptions: String,
        planes: Vec<(&'a str, f64)>,
        points: Vec<(&'a str, [f64; 3])>,
        measurements: Vec<Measurement<'a>>,
        /// Over the workspace, or the part of it within `within`, and over robots drawn from the tolerance.
        before: Option<Precision>,
        planned: Precision,
        /// For the nominal robot, over its whole workspace.
        expected_error: ExpectedReport,
    }
    let setup = &plan.setup;
    let convention = &setup.robot.convention;
    let planes = setup.planes.iter().zip(&setup.places.planes);
    let points = setup.points.iter().zip(&setup.places.points);
    let contents = Contents {
        robot_file: &request.robot.name,
        measure: request.kinds.to_string(),
        count: plan.count,
        order: request.order,
        seed: request.seed,
        absolute: request.absolute,
        within: request.region.map(|own| own.to_string()),
        assumptions: noise_and_tolerance(setup, &plan.measurements),
        planes: planes
            .map(|(own, at)| {
                (
                    own.name.as_str(),
                    convention.vector(&(Vector3::z() * at.offset)).z,
                )
            })
            .collect(),
        points: points
            .map(|(own, at)| {
                let place = convention.vector(&at.place);
                (own.name.as_str(), place.into())
            })
            .collect(),
        measurements: measurements(&plan.measurements, setup),
        before: plan.before,
        planned: plan.after,
        expected_error: expected_report(&plan.expected, &setup.robot.convention),
    };
    super::json(&Versioned::new(SCHEMA_VERSION, contents))
}

/// A plan for the terminal, without the measurements.
pub fn text(request: &PlanRequest<'_>, plan: &Plan) -> String {
    let setup = &plan.setup;
    let section = Section::new("")
        .text(format!(
            "Plan for {}: {}",
            request.robot.name,
            number_of_kinds(plan)
        ))
        .text(noise_and_tolerance(setup, &plan.measurements));
    let section = match &request.region {
        Some(region) => section.text(format!("Within: {region} mm")),
        None => section,
    };
    let section = section.text(match request.order {
        Order::Random => format!(
            "Order: random (seed {}). Measure in this order: the last row repeats the first, to show drift.",
            request.seed
        ),
        Order::Shortest => "Order: shortest path of the joints. A drift during the measurement would go unnoticed.".to_owned(),
    });
    let section = places(plan).into_iter().fold(section, Section::text);
    terminal::text([section, expected(request, plan)])
}

/// "20 measurements, 1 of them repeated: 13 heights above a plane and 8 distances between two poses".
fn number_of_kinds(plan: &Plan) -> String {
    let kinds = Kind::ALL.into_iter().filter_map(|kind| {
        let own = plan.measurements.iter().filter(|own| own.kind == kind);
        let number = own.count();
        (number > 0).then(|| format!("{number} {}", kind.title()))
    });
    let kinds: Vec<_> = kinds.collect();
    let repeated = plan.measurements.len() - plan.count;
    let repeated = match repeated {
        0 => String::new(),
        repeated => format!(", {repeated} of them repeated"),
    };
    let measured = count(plan.count, "measurement");
    format!("{measured}{repeated}: {}", list(&kinds))
}

fn noise_and_tolerance(setup: &Setup, planned: &[Planned]) -> String {
    let facts = &setup.robot.instruments;
    let noise = setup.robot.noise;
    let mut kinds = Vec::new();
    let mut add = |kind: &str, sigma: Option<f64>, is_of: fn(Kind) -> bool| {
        let sigma = sigma.filter(|_| planned.iter().any(|own| is_of(own.kind)));
        kinds.extend(sigma.map(|sigma| format!("{kind} {sigma} mm")));
    };
    let position = noise.map(|own| own.position());
    add("coordinates", position, Kind::is_position);
    add("heights", facts.height_noise, |kind| kind == Kind::Plane);
    add("distances", facts.distance_noise, |kind| {
        matches!(kind, Kind::Point | Kind::Distance)
    });
    let drive = setup.robot.robot.drive();
    let joint = noise.map_or(0.0, |own| joint::in_file(drive, own.joint()));
    let (name, mark) = (joint::name(drive), joint::mark(drive));
    kinds.push(format!("{name}s {}{mark}", rounded(joint)));
    let stated = if setup.noise_stated {
        ""
    } else {
        " (assumed where not stated)"
    };
    let tolerance = setup.robot.tolerance.as_ref();
    let tolerance = tolerance.map_or_else(|| "none stated".to_owned(), |own| in_words(drive, own));
    format!(
        "Noise: {}{stated}. Tolerance: {tolerance}.",
        kinds.join(", ")
    )
}

/// Where to put planes and points.
fn places(plan: &Plan) -> Vec<String> {
    let setup = &plan.setup;
    let convention = &setup.robot.convention;
    let mut sentences = Vec::new();
    let planes = setup.planes.iter().zip(&setup.places.planes);
    for (index, (plane, found)) in planes.enumerate() {
        let own = plan.measurements.iter();
        let own = own.filter(|own| own.plane.is_some_and(|own| own.0 == index));
        let at: Vec<_> = own
            .map(|own| convention.vector(&own.pose.position))
            .collect();
        let range = |axis: usize| {
            let (least, most) = range(at.iter().map(|place| place[axis]));
            format!("{:.0} to {:.0}", least + 0.0, most + 0.0)
        };
        let blocks: Vec<_> = plane.blocks.iter().map(|block| rounded(*block)).collect();
        if !at.is_empty() {
            sentences.push(format!(
                "Put {} at z = {} mm, to a centimetre; it is touched at x {} and y {} mm, on blocks of {} mm.",
                plane.name,
                rounded(convention.vector(&(Vector3::z() * found.offset)).z),
                range(0),
                range(1),
                list(&blocks)
            ));
        }
    }
    if !setup.points.is_empty() {
        let each = setup.points.iter().zip(&setup.places.points);
        let each = each.map(|(own, found)| {
            let at = convention.vector(&found.place).map(|c| c + 0.0);
            format!(
                "{} at ({}, {}, {}), {}",
                own.name,
                at.x,
                at.y,
                at.z,
                lengths(own.lengths)
            )
        });
        let each = each.collect::<Vec<_>>().join("; ");
        sentences.push(format!("Put the points, to a centimetre or two: {each}."));
    }
    let mut kinds = plan.measurements.iter().map(|own| own.kind);
    if kinds.any(|kind| kind == Kind::Distance) {
        let lengths = lengths(setup.lengths);
        sentences.push(format!("Distances between poses are {lengths}."));
    }
    if setup.frame == Frame::Sensor {
        sentences.push("The frame of the coordinates is unknown (--frame sensor).".to_owned());
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

fn expected(request: &PlanRequest<'_>, plan: &Plan) -> Section {
    let place = match &request.region {
        Some(_) => "the region",
        None => "the workspace",
    };
    let row = |table: Table, name: &str, of: fn(&Precision) -> f64, worst: &PositionSigma| {
        let before = small_or("unknown", plan.before.as_ref().map(of));
        let at = request.robot.convention.vector(&worst.max_at);
        let at = at.map(|coordinate| coordinate.round() + 0.0);
        let worst_name = format!("  worst (at {}, {}, {})", at.x, at.y, at.z);
        let table = table.row(
            format!("{name}, rms over {place}"),
            [before, small(of(&plan.after))],
        );
        table.row(worst_name, [String::new(), small(worst.max)])
    };
    let table = Table::new(["Expected position error, mm (σ)", "before", "calibrated"]);
    let table = row(
        table,
        "Relative",
        |own| own.relative,
        &plan.expected.intrinsic,
    );
    let table = row(
        table,
        "Absolute",
        |own| own.absolute,
        &plan.expected.absolute,
    );
    let criterion = if request.absolute {
        "absolute"
    } else {
        "relative"
    };
    Section::new("").table(table).note(format!(
        "Relative: after the best rigid motion. Absolute: in the frame of the robot's base. The poses minimise the \
         {criterion} error."
    ))
}

/// The samples file to fill in: joint angles, empty cells for the readings, and ignored columns with the nominal
/// robot's readings.
pub fn csv(planned: &[Planned], setup: &Setup) -> String {
    let has = |of: &dyn Fn(&Planned) -> bool| planned.iter().any(of);
    let convention = &setup.robot.convention;
    let joints = convention.joint_columns();
    let positions = convention.position_columns();
    let heights = has(&|own| own.kind == Kind::Plane);
    let unnamed = matches!(&setup.planes[..], [plane] if plane.name == PLANE);
    let named = heights && (has(&|own| own.kind != Kind::Plane) || !unnamed);
    let points = has(&|own| own.point.is_some());
    let poses = has(&|own| own.other.is_some());
    let mut lines = vec![Vec::new(); planned.len() + 1];
    let mut column = |name: &str, cell: &dyn Fn(&Planned) -> Option<String>| {
        let cells = planned.iter().map(|own| cell(own).unwrap_or_default());
        for (line, cell) in lines
            .iter_mut()
            .zip([name.to_owned()].into_iter().chain(cells))
        {
            line.push(cell);
        }
    };
    let empty = |_: &Planned| None;
    for (joint, name) in joints.iter().enumerate() {
        column(name, &|own| {
            Some(rounded(convention.joints(&own.pose.joints)[joint]))
        });
    }
    for (axis, name) in positions.iter().enumerate() {
        if has(&|own| own.kind.coordinates()[axis]) {
            column(name, &empty);
        }
    }
    if heights {
        column(&convention.column(Quantity::Height), &empty);
    }
    if named {
        column("plane", &|own| Some(plane_of(own, setup)?.0.to_owned()));
    }
    if points || poses {
        column(&convention.column(Quantity::Distance), &empty);
    }
    if points {
        column("point", &|own| Some(point_of(own, setup)?.0.to_owned()));
    }
    for (joint, name) in joints.iter().enumerate().filter(|_| poses) {
        column(&format!("to_{name}"), &|own| {
            Some(rounded(convention.joints(&own.other?.joints)[joint]))
        });
    }
    for (axis, name) in positions.iter().enumerate() {
        column(&format!("_nominal_{name}"), &|own| {
            Some(rounded(convention.position(&own.pose.position)[axis]))
        });
    }
    if heights {
        column("_block_mm", &|own| Some(rounded(plane_of(own, setup)?.1)));
    }
    if points || poses {
        column("_nominal_distance_mm", &|own| {
            let other = own.other.map(|other| other.position);
            let begin = other.or(point_of(own, setup).map(|(_, place)| place))?;
            Some(format!("{:.3}", (own.pose.position - begin).norm()))
        });
    }
    let lines = lines.iter().map(|cells| cells.join(",") + "\n");
    lines.collect()
}

/// What the rows of a file determine, for the terminal.
pub fn samples_text(
    name: &str,
    determined: &Determined,
    rows: usize,
    unmeasured: &[u64],
) -> String {
    let mut summary = Section::new("").text(format!(
        "{} of {name} for {}",
        count(rows, "row"),
        determined.setup.robot.name
    ));
    let lines = [
        ("Not measured yet", unmeasured),
        (
            "Not counted: the nominal robot does not reach them",
            &determined.not_reached,
        ),
        ("Hardly checked by any other row", &determined.unchecked),
    ];
    for (what, lines) in lines.into_iter().filter(|(_, lines)| !lines.is_empty()) {
        summary = summary.text(format!("{what}: {}.", in_lines(lines)));
    }
    let with_next = determined.with_next.as_ref();
    let row = |of: fn(&ExpectedError) -> PositionSigma| {
        let rms =
            |own: &Option<ExpectedError>| small_or("unknown", own.as_ref().map(|own| of(own).rms));
        let worst = small_or("unknown", determined.now.as_ref().map(|own| of(own).max));
        let next = with_next.map(|own| small(of(own).rms));
        let mut cells = vec![rms(&determined.before), rms(&determined.now), worst];
        cells.extend(next);
        cells
    };
    let mut headings = vec![
        "Expected position error, mm (σ)",
        "before",
        "calibrated",
        "worst place",
    ];
    if with_next.is_some() {
        headings.push("with additions");
    }
    let table = Table::new(headings)
        .row("Relative, rms over the workspace", row(|own| own.intrinsic))
        .row("Absolute, rms over the workspace", row(|own| own.absolute));
    let mut parts = vec![
        summary.text(verdict(determined)),
        Section::new("").table(table),
    ];
    if let Some(obstacle) = &determined.no_next {
        parts.push(
            Section::new("").text(format!("No addition: {obstacle}; {}.", obstacle.remedy())),
        );
    } else if !determined.next.is_empty() {
        let csv = csv(&determined.next, &determined.setup);
        let section = Section::new("Best additional measurements, in this order");
        parts.push(csv.lines().fold(section, Section::text));
    }
    terminal::text(parts)
}

/// What the rows determine, in one sentence.
pub fn verdict(determined: &Determined) -> String {
    if let Some((arm, parameter, sigma)) = determined.unknown {
        let known = in_file_units(parameter, sigma);
        return format!(
            "These rows do not determine the robot: {parameter} of {arm} is known only to {known} (σ)."
        );
    }
    if determined.before.is_none() {
        return "These rows determine every parameter.".to_owned();
    }
    let known = &determined.known;
    if determined.complete() {
        return "These rows determine all that relative positions depend on better than the tolerance does."
            .to_owned();
    }
    let scale = if known.scale {
        ""
    } else {
        ", and not the scale of the robot"
    };
    format!(
        "These rows determine {} of the {} parameter combinations that relative positions depend on better than the \
         tolerance does{scale}.",
        known.combinations.min(known.of),
        known.of
    )
}

/// What the rows of a file determine, as JSON: lengths in millimetres, angles in degrees; `null` if unknown.
pub fn samples_json(name: &str, determined: &Determined, unmeasured: &[u64]) -> String {
    #[derive(Serialize)]
    struct Contents<'a> {
        robot_file: &'a str,
        samples_file: &'a str,
        /// Whether no relative position depends on the tolerance; without a tolerance, whether every parameter is
        /// determined.
        determined: bool,
        /// Whether a calibration is expected to halve the relative error, or without a tolerance, to be accepted.
        worthwhile: bool,
        verdict: String,
        unmeasured_lines: &'a [u64],
        not_reached_lines: &'a [u64],
        unchecked_lines: &'a [u64],
        /// Noise and tolerance, in words.
        assumptions: String,
        expected_error_before: Option<ExpectedReport>,
        expected_error: Option<ExpectedReport>,
        expected_error_with_next: Option<ExpectedReport>,
        /// Best additional measurements, in order.
        next: Vec<Measurement<'a>>,
        /// Why there is none; `null` if there are some or none was requested.
        no_next: Option<String>,
    }
    let setup = &determined.setup;
    let expected = |own| expected_report(own, &setup.robot.convention);
    let contents = Contents {
        robot_file: &setup.robot.name,
        samples_file: name,
        determined: determined.complete(),
        worthwhile: determined.worthwhile(),
        verdict: verdict(determined),
        unmeasured_lines: unmeasured,
        not_reached_lines: &determined.not_reached,
        unchecked_lines: &determined.unchecked,
        assumptions: noise_and_tolerance(setup, &determined.next),
        expected_error_before: determined.before.as_ref().map(expected),
        expected_error: determined.now.as_ref().map(expected),
        expected_error_with_next: determined.with_next.as_ref().map(expected),
        next: measurements(&determined.next, setup),
        no_next: determined.no_next.map(|obstacle| obstacle.to_string()),
    };
    super::json(&Versioned::new(SCHEMA_VERSION, contents))
}
