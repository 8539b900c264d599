//! Planned measurements for people, for programs, and as a samples file to fill in.

use super::json::{SCHEMA_VERSION, common_radius};
use crate::accuracy::position_uncertainty::PositionSigma;
use crate::files::robot_file::RobotFile;
use crate::fit::options::Frame;
use crate::planning::measurements::{
    Kind, MeasurementPlan, MeasurementRequest, PLANE, Planned, Precision, Setup,
};
use crate::planning::poses::{RANDOM_SETS, Region};
use crate::render::section::Section;
use crate::render::table::Table;
use crate::render::{json, terminal};
use crate::text::joint;
use crate::text::numbers::{rounded, small, small_or};
use crate::text::tolerance::in_words;
use crate::text::units::degrees;
use crate::text::words::{count, list};
use delta_cal::Parameter;
use delta_cal::robot::Drive;
use serde_json::{Value, json};
use std::fmt::Write;

/// The whole report, without the measurements themselves.
pub fn text(request: &MeasurementRequest<'_>, plan: &MeasurementPlan) -> String {
    terminal::text([summary(request, plan), expected(request, plan)])
}

fn has(plan: &MeasurementPlan, kind: Kind) -> bool {
    plan.measurements.iter().any(|own| own.kind == kind)
}

fn summary(request: &MeasurementRequest<'_>, plan: &MeasurementPlan) -> Section {
    let kinds = Kind::ALL.into_iter().filter_map(|kind| {
        let number = plan
            .measurements
            .iter()
            .filter(|own| own.kind == kind)
            .count();
        (number > 0).then(|| format!("{number} {}", kind.title()))
    });
    let section = Section::new("").text(format!(
        "{} for {}: {}",
        count(plan.measurements.len(), "measurement"),
        request.robot.name,
        list(&kinds.collect::<Vec<_>>())
    ));
    let section = section
        .text(format!(
            "Noise: {}",
            noise_of(&plan.setup.robot, measured(plan), plan.setup.noise_stated)
        ))
        .text(format!("Tolerance: {}", tolerance_of(&plan.setup.robot)));
    let section = match &request.region {
        Some(region) => section.text(format!("Within: {region} mm")),
        None => section,
    };
    instruments(plan).into_iter().fold(section, Section::text)
}

/// Whether coordinates, heights and distances are measured.
fn measured(plan: &MeasurementPlan) -> [bool; 3] {
    [
        plan.measurements.iter().any(|own| own.kind.is_position()),
        has(plan, Kind::Plane),
        has(plan, Kind::Point) || has(plan, Kind::Distance),
    ]
}

/// "heights 0.02 mm, joint angles 0.002° (stated)".
pub(in crate::report) fn noise_of(robot: &RobotFile, measured: [bool; 3], stated: bool) -> String {
    let facts = &robot.instruments;
    let sigmas = [
        ("coordinates", robot.noise.map(|noise| noise.position())),
        ("heights", facts.height_noise),
        ("distances", facts.distance_noise),
    ];
    let kinds = sigmas.into_iter().zip(measured);
    let kinds = kinds.filter_map(|((kind, sigma), measured)| {
        let sigma = sigma.filter(|_| measured)?;
        Some(format!("{kind} {sigma} mm, "))
    });
    let kinds: String = kinds.collect();
    let drive = robot.robot.drive();
    let of_joint = robot
        .noise
        .map_or(0.0, |noise| joint::in_file(drive, noise.joint()));
    let origin = if stated {
        "stated"
    } else {
        "assumed where the robot file states none"
    };
    let (name, mark) = (joint::name(drive), joint::mark(drive));
    format!("{kinds}{name}s {}{mark} ({origin})", small(of_joint))
}

pub(in crate::report) fn tolerance_of(robot: &RobotFile) -> String {
    robot.tolerance.as_ref().map_or_else(
        || "none stated".to_owned(),
        |tolerance| format!("{} (stated)", in_words(robot.robot.drive(), tolerance)),
    )
}

/// Where everything has to stand.
fn instruments(plan: &MeasurementPlan) -> Vec<String> {
    let setup = &plan.setup;
    let mut sentences = Vec::new();
    if has(plan, Kind::Plane) {
        let blocks: Vec<_> = setup.blocks.iter().map(|block| rounded(*block)).collect();
        sentences.push(format!(
            "The plane is at z = {} mm in the robot's frame, within a centimetre or two, and reaches from {} to {} mm in \
             x and from {} to {} mm in y; it is measured on gauge blocks of {} mm (0 is the bare plane)",
            rounded(setup.plane),
            extent(plan, 0, f64::min),
            extent(plan, 0, f64::max),
            extent(plan, 1, f64::min),
            extent(plan, 1, f64::max),
            list(&blocks)
        ));
    }
    if has(plan, Kind::Point) {
        let places = setup
            .points
            .iter()
            .map(|(name, place)| format!("{name} at ({}, {}, {})", place.x, place.y, place.z));
        sentences.push(format!(
            "The points are, within a centimetre or two, in mm in the robot's frame: {}",
            list(&places.collect::<Vec<_>>())
        ));
    }
    if has(plan, Kind::Point) || has(plan, Kind::Distance) {
        let (shortest, longest) = setup.lengths;
        sentences.push(if shortest >= longest {
            format!(
                "Every distance is {} mm, the length of the bar",
                rounded(shortest)
            )
        } else if longest.is_finite() {
            format!(
                "Distances are {} to {} mm long",
                rounded(shortest),
                rounded(longest)
            )
        } else {
            format!("Distances are {} mm or longer", rounded(shortest))
        });
    }
    if setup.frame == Frame::Sensor {
        sentences.push("The frame of the coordinates is unknown (--frame sensor)".to_owned());
    }
    sentences
}

/// The smallest or largest coordinate on the plane.
fn extent(plan: &MeasurementPlan, axis: usize, of: fn(f64, f64) -> f64) -> String {
    let on_plane = plan
        .measurements
        .iter()
        .filter(|own| own.kind == Kind::Plane);
    let coordinates = on_plane.map(|own| own.pose.position[axis]);
    coordinates
        .reduce(of)
        .map_or_else(String::new, |end| format!("{end:.0}"))
}

/// Over which positions an error is stated.
pub(super) fn over(region: Option<&Region>) -> String {
    region.map_or_else(
        || "over the workspace".to_owned(),
        |region| format!("over the positions within {region} mm"),
    )
}

fn expected(request: &MeasurementRequest<'_>, plan: &MeasurementPlan) -> Section {
    let title = "Expected position error, one sigma, mm";
    let table = Table::new([title, "before", "planned", "random"]);
    // The worst place is looked for everywhere.
    let (worst_of, whole) = if request.region.is_some() {
        (
            "worst of the workspace",
            ", the worst over the whole workspace",
        )
    } else {
        ("worst", "")
    };
    let row = |table: Table, name: &str, of: fn(&Precision) -> f64| {
        let before = small_or("unknown", plan.before.as_ref().map(of));
        let random = small_or("unknown", plan.random.as_ref().map(of));
        table.row(name, [before, small(of(&plan.after)), random])
    };
    let worst = |table: Table, sigma: &PositionSigma| {
        let at = sigma.max_at.map(|coordinate| coordinate.round() + 0.0);
        let name = format!("  {worst_of} (at {}, {}, {})", at.x, at.y, at.z);
        table.row(name, [String::new(), small(sigma.max), String::new()])
    };
    let table = row(table, "In the robot's own frame, rms", |own| own.intrinsic);
    let table = worst(table, &plan.expected.intrinsic);
    let table = row(table, "In the frame of its base, rms", |own| own.absolute);
    let table = worst(table, &plan.expected.absolute);
    let section = Section::new("").table(table).note(format!(
        "The errors are {}{whole}; random: the median of {RANDOM_SETS} sets of as many random measurements",
        over(request.region.as_ref())
    ));
    section.note(
        "In the robot's own frame: after the best rigid motion. It counts where positions are taught; without x, y \
         and z in the robot's frame the place of the robot in space comes from the tolerance alone.",
    )
}

/// For programs: lengths in millimetres, angles in degrees; `null` where a figure is unknown.
pub fn json(request: &MeasurementRequest<'_>, plan: &MeasurementPlan) -> Value {
    let setup = &plan.setup;
    let facts = &setup.robot.instruments;
    let drive = setup.robot.robot.drive();
    let in_file = |joints: &[f64; 3]| joints.map(|q| joint::in_file(drive, q));
    let tolerance = |parameter| {
        let tolerance = setup.robot.tolerance.as_ref();
        tolerance.map(|tolerance| tolerance.of(parameter))
    };
    let point = |index: usize| setup.points.get(index).map(|(name, _)| name);
    let measurements = plan.measurements.iter().map(|own| {
        json!({
            "measure": own.kind.name(),
            joint::key("joints", drive): in_file(&own.pose.joints),
            // Where the nominal robot is then.
            "position_mm": own.pose.position.data.0[0],
            // Where a distance between poses begins.
            joint::key("to_joints", drive): own.other.map(|other| in_file(&other.joints)),
            "block_mm": own.block.and_then(|block| setup.blocks.get(block)),
            "point": own.point.and_then(point),
        })
    });
    let points = setup
        .points
        .iter()
        .map(|(name, place)| json!({ "name": name, "position_mm": place.data.0[0] }));
    let worst =
        |sigma: &PositionSigma| json!({ "max_mm": sigma.max, "at_mm": sigma.max_at.data.0[0] });
    let contents = json!({
        "robot_file": request.robot.name,
        "measure": request.kinds.to_string(),
        "seed": request.seed,
        "within": request.region.map(|region| region.to_string()),
        "assumptions": {
            "noise_position_mm": setup.robot.noise.map(|noise| noise.position()),
            joint::key("noise_joint", drive):
                setup.robot.noise.map(|noise| joint::in_file(drive, noise.joint())),
            "noise_height_mm": facts.height_noise,
            "noise_distance_mm": facts.distance_noise,
            "noise_stated": setup.noise_stated,
            "tolerance_length_mm": tolerance(Parameter::Lb),
            "tolerance_angle_deg": tolerance(Parameter::Theta).map(degrees),
            "tolerance_radius_mm": common_radius(setup.robot.tolerance.as_ref()),
        },
        // Where the instruments stand, in the robot's frame.
        "plane_mm": has(plan, Kind::Plane).then_some(setup.plane),
        "points": has(plan, Kind::Point).then(|| points.collect::<Vec<_>>()),
        // In their order.
        "measurements": measurements.collect::<Vec<_>>(),
        // Root of the mean square of the expected position error over the workspace, or what of it is within `within`, and over robots made
        // to the tolerance, one σ.
        "before": plan.before.as_ref().map(precision),
        "planned": precision(&plan.after),
        // The median over sets of random measurements.
        "random": plan.random.as_ref().map(precision),
        // Of the nominal robot.
        "worst": {
            "intrinsic": worst(&plan.expected.intrinsic),
            "absolute": worst(&plan.expected.absolute),
        },
    });
    json::report(SCHEMA_VERSION, contents)
}

/// Intrinsic: the best rigid motion removed.
pub(super) fn precision(precision: &Precision) -> Value {
    json!({
        "intrinsic_rms_mm": precision.intrinsic,
        "absolute_rms_mm": precision.absolute,
    })
}

/// The samples file to fill in: joint angles, empty cells for what is to be read, and in columns that are
/// ignored what the nominal robot would read.
pub fn csv(measurements: &[Planned], setup: &Setup) -> String {
    let kinds: Vec<_> = Kind::ALL
        .into_iter()
        .filter(|kind| measurements.iter().any(|own| own.kind == *kind))
        .collect();
    let read = |axis: usize| kinds.iter().any(|kind| kind.coordinates()[axis]);
    let plane = kinds.contains(&Kind::Plane);
    let (distance, point) = (
        kinds.contains(&Kind::Distance),
        kinds.contains(&Kind::Point),
    );
    let drive = setup.robot.robot.drive();
    let own_columns = joint::columns(drive);
    let own_columns: Vec<_> = own_columns.split(',').collect();
    let to_columns: Vec<_> = own_columns
        .iter()
        .map(|name| format!("to_{name}"))
        .collect();
    let mut columns: Vec<(&str, Cell)> = Vec::new();
    for (joint, name) in own_columns.iter().enumerate() {
        let cell = move |own: &Planned, _: &Setup| written(drive, own.pose.joints[joint]);
        columns.push((name, Box::new(cell)));
    }
    let empty = || -> Cell { Box::new(|_, _| String::new()) };
    for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
        if read(axis) {
            columns.push((name, empty()));
        }
    }
    if plane {
        columns.push(("height_mm", empty()));
    }
    if plane && kinds.len() > 1 {
        let name = |own: &Planned, _: &Setup| match own.kind {
            Kind::Plane => PLANE.to_owned(),
            _ => String::new(),
        };
        columns.push(("plane", Box::new(name)));
    }
    if distance || point {
        columns.push(("distance_mm", empty()));
    }
    if point {
        let name = |own: &Planned, setup: &Setup| {
            let point = own.point.and_then(|point| setup.points.get(point));
            point.map_or_else(String::new, |(name, _)| name.clone())
        };
        columns.push(("point", Box::new(name)));
    }
    if distance {
        for (joint, name) in to_columns.iter().enumerate() {
            let cell = move |own: &Planned, _: &Setup| {
                let other = own.other.as_ref();
                other.map_or_else(String::new, |other| written(drive, other.joints[joint]))
            };
            columns.push((name, Box::new(cell)));
        }
    }
    for (axis, name) in ["_nominal_x_mm", "_nominal_y_mm", "_nominal_z_mm"]
        .into_iter()
        .enumerate()
    {
        let cell = move |own: &Planned, _: &Setup| rounded(own.pose.position[axis]);
        columns.push((name, Box::new(cell)));
    }
    if plane {
        let cell = |own: &Planned, setup: &Setup| {
            let block = own.block.and_then(|block| setup.blocks.get(block));
            block.map_or_else(String::new, |block| rounded(*block))
        };
        columns.push(("_block_mm", Box::new(cell)));
    }
    if distance || point {
        columns.push(("_nominal_distance_mm", Box::new(nominal_distance)));
    }
    let names: Vec<_> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = names.join(",") + "\n";
    for own in measurements {
        let cells: Vec<_> = columns.iter().map(|(_, cell)| cell(own, setup)).collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

type Cell = Box<dyn Fn(&Planned, &Setup) -> String>;

fn written(drive: Drive, joint: f64) -> String {
    rounded(joint::in_file(drive, joint))
}

fn nominal_distance(own: &Planned, setup: &Setup) -> String {
    let place = own.point.and_then(|point| setup.points.get(point));
    let begin = place.map(|(_, place)| *place);
    let begin = begin.or(own.other.map(|other| other.position));
    begin.map_or_else(String::new, |begin| {
        format!("{:.3}", (own.pose.position - begin).norm())
    })
}
