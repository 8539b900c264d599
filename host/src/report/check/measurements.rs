//! The check of heights, distances and single coordinates, for people and for programs.

use super::json::{SCHEMA_VERSION, leverages as leverages_json};
use super::table::{leverages, not_measured};
use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::position_uncertainty::PositionSigma;
use crate::planning::measurements::MeasurementCheck;
use crate::render::section::Section;
use crate::render::table::Table;
use crate::render::{json, terminal};
use crate::report::calibration::json::expected_error;
use crate::report::calibration::observations::readings_in_words;
use crate::report::plan::measurements::{csv, noise_of, tolerance_of};
use crate::text::joint;
use crate::text::numbers::{small, small_or};
use crate::text::words::{count, in_file_units, in_lines};
use serde_json::{Value, json};

/// For people at a terminal.
pub fn text(check: &MeasurementCheck, unmeasured: &[u64]) -> String {
    let mut parts = vec![
        summary(check),
        not_measured(
            Section::new("").text(verdict(check, unmeasured)),
            unmeasured,
        ),
        positions(check),
    ];
    let mut gaps = check.known.gaps(&check.file);
    if check.unknown.is_none() && check.known.combinations < check.known.of {
        // The verdict says so.
        gaps.pop();
    }
    if !gaps.is_empty() {
        let section = Section::new("What stays unknown");
        parts.push(gaps.into_iter().fold(section, Section::text));
    }
    parts.push(leverages(
        check.robot.robot.drive(),
        &check.leverages,
        "parameters, those of planes, points and the sensor's frame too, a row decides",
    ));
    parts.extend(additions(check));
    terminal::text(parts)
}

fn summary(check: &MeasurementCheck) -> Section {
    let file = &check.file;
    let section = Section::new("").text(format!(
        "{} of {} for {}: {}",
        count(file.rows.len(), "row"),
        file.name,
        check.robot.name,
        readings_in_words(file),
    ));
    let rows = || file.rows.iter().map(|row| &row.value);
    let measured = [
        file.coordinates(),
        rows().any(|row| row.height.is_some()),
        rows().any(|row| row.distance.is_some()),
    ];
    let noise = noise_of(&check.robot, measured, check.noise_stated);
    let section = section
        .text(format!("Noise: {noise}"))
        .text(format!("Tolerance: {}", tolerance_of(&check.robot)));
    if check.not_reached.is_empty() {
        return section;
    }
    section.text(format!(
        "Not counted, because the robot of the file does not reach the joint angles: {}",
        in_lines(&check.not_reached)
    ))
}

/// In one sentence.
pub fn verdict(check: &MeasurementCheck, unmeasured: &[u64]) -> String {
    let what = match unmeasured.len() {
        0 => "These measurements",
        lines if lines == check.file.rows.len() => "Once taken, these measurements",
        _ => "Once all are taken, these measurements",
    };
    if let Some((arm, parameter, sigma)) = check.unknown {
        return format!(
            "{what} do not determine the robot: {parameter} of {arm} is known only to {} (one sigma).",
            in_file_units(parameter, sigma)
        );
    }
    if check.robot.tolerance.is_none() {
        return format!("{what} determine every parameter.");
    }
    let (known, of) = (check.known.combinations, check.known.of);
    if check.determined() {
        return format!(
            "{what} determine all {of} combinations of parameters that relative positions depend \
             on, better than the tolerance does."
        );
    }
    if known >= of {
        return format!("{what} do not determine the scale of the robot.");
    }
    format!(
        "{what} determine {known} of the {of} combinations of parameters that relative positions \
         depend on better than the tolerance does."
    )
}

/// Why these measurements are not worth a calibration.
pub fn obstacle(check: &MeasurementCheck, unmeasured: &[u64]) -> String {
    let rms = |own: &Option<ExpectedError>| own.as_ref().map(|own| small(own.intrinsic.rms));
    match (check.unknown, rms(&check.before), rms(&check.now)) {
        (None, Some(before), Some(now)) => format!(
            "a calibration is expected to leave {now} mm of the {before} mm by which relative positions are \
             off, rms, as the robot was made"
        ),
        _ => verdict(check, unmeasured),
    }
}

fn positions(check: &MeasurementCheck) -> Section {
    let mut columns = vec!["mm, one sigma", "by tolerance", "with them", "worst place"];
    let with_next = check.with_next.as_ref();
    if with_next.is_some() {
        columns.push("with additions");
    }
    let row = |of: fn(&ExpectedError) -> PositionSigma| {
        let rms =
            |own: &Option<ExpectedError>| small_or("unknown", own.as_ref().map(|own| of(own).rms));
        let worst = small_or("unknown", check.now.as_ref().map(|own| of(own).max));
        let mut cells = vec![rms(&check.before), rms(&check.now), worst];
        if with_next.is_some() {
            cells.push(rms(&check.with_next));
        }
        cells
    };
    let table = Table::new(columns)
        .row("relative positions", row(|own| own.intrinsic))
        .row("positions in the base frame", row(|own| own.absolute));
    Section::new("Expected position error over the workspace, rms")
        .table(table)
        .note(
            "Relative positions are those of the robot's poses to each other: what remains of the error \
             after the best rigid motion. This is what a calibration from these rows is expected to leave \
             of what the tolerance allows, if nothing is wrong in them.",
        )
}

fn additions(check: &MeasurementCheck) -> Option<Section> {
    if let Some(obstacle) = &check.no_next {
        return Some(Section::new("").text(format!(
            "No measurement can be proposed in addition: {obstacle}. To have some proposed, {}.",
            obstacle.remedy()
        )));
    }
    let setup = check.setup.as_ref().filter(|_| !check.next.is_empty())?;
    let section = Section::new("Measurements that would help most, in this order");
    let csv = csv(&check.next, setup);
    Some(csv.lines().fold(section, Section::text).note(
        "With the instruments of the file, where they are. delta-cal plan --measure plans other kinds, and \
         --compare shows what each would bring.",
    ))
}

/// For programs. Lengths in millimetres, angles in degrees; `null` where a figure is unknown.
pub fn json(check: &MeasurementCheck, unmeasured: &[u64]) -> Value {
    let drive = check.robot.robot.drive();
    let in_file = |joints: &[f64; 3]| joints.map(|q| joint::in_file(drive, q));
    let (leverages, sampled) = leverages_json(drive, &check.leverages);
    let point = |index: usize| check.file.points.get(index);
    let next = check.next.iter().map(|own| {
        json!({
            "measure": own.kind.name(),
            joint::key("joints", drive): in_file(&own.pose.joints),
            "position_mm": own.pose.position.data.0[0],
            // Where a distance between poses begins.
            joint::key("to_joints", drive): own.other.map(|other| in_file(&other.joints)),
            "block_mm": own.block.and_then(|block| check.setup.as_ref()?.blocks.get(block)),
            "point": own.point.and_then(point),
        })
    });
    let contents = json!({
        "robot_file": check.robot.name,
        "samples_file": check.file.name,
        // Whether relative positions depend on nothing that is left to the tolerance; without a tolerance whether
        // every parameter is determined.
        "determined": check.determined(),
        // Whether a calibration is expected to halve the error of relative positions; without a tolerance whether it
        // would be accepted.
        "worthwhile": check.worthwhile(),
        // In one sentence.
        "verdict": verdict(check, unmeasured),
        // The lines of the rows that hold no reading.
        "unmeasured_lines": unmeasured,
        // The lines whose joint angles the robot does not reach.
        "not_reached_lines": check.not_reached,
        "known": {
            // How many combinations of the 24 parameters, better than the tolerance does.
            "combinations": check.known.combinations,
            // Whether they say where the robot stands in space, and how large it is.
            "place": check.known.place,
            "scale": check.known.scale,
        },
        // In sentences: what stays unknown, and the remedy.
        "gaps": check.known.gaps(&check.file),
        // The position error that the robot is expected to have: by its tolerance, with these measurements, and
        // with those of `next`.
        "expected_error_before": check.before.as_ref().map(expected_error),
        "expected_error": check.now.as_ref().map(expected_error),
        "expected_error_with_next": check.with_next.as_ref().map(expected_error),
        // Each row's, in the file's order; of more than 10,000 the largest, and others spread evenly.
        "leverages": leverages,
        // How many of how many rows `leverages` holds; `null` if all.
        "sampled": sampled,
        // What is best added, one after the other.
        "next": next.collect::<Vec<_>>(),
        // Why there is none; `null` where some are proposed or none was asked for.
        "no_next": check.no_next.map(|obstacle| obstacle.to_string()),
    });
    json::report(SCHEMA_VERSION, contents)
}
