//! A calibration from heights, distances and single coordinates, for people and for programs.

use super::comparison::{between, of_an_arm};
use super::expanded;
use super::json::{SCHEMA_VERSION, expected_error, parameters_of as parameters_json, transmission};
use super::sections::{doubts_of, parameters_of, sensor_frame_of};
use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::position_uncertainty::PositionSigma;
use crate::accuracy::sampled::{MANY, MANY_ON_A_PAGE, shown};
use crate::calibration::observations::{ObservationsReport, TransmissionFound};
use crate::files::samples_file::{ObservationsFile, Reading, ReadingFrom};
use crate::fit::options::Frame;
use crate::render::page::{self, tile};
use crate::render::section::{Part, Section};
use crate::render::table::Table;
use crate::render::{json, terminal};
use crate::report::document::{About, Document};
use crate::text::numbers::{small, small_or};
use crate::text::units::degrees;
use crate::text::words::{count, list};
use maud::html;
use serde_json::{Map, Value, json};

/// Rows that a terminal shows.
const SHOWN: usize = 10;

/// For people at a terminal.
pub fn text(report: &ObservationsReport, about: &About) -> String {
    let first = Section::new("").text(headline(report));
    let mut parts = vec![first];
    parts.extend(sections(report));
    let expanded = report.expanded();
    parts.push(
        Section::new("")
            .text(expanded::sentence(expanded.as_ref(), "relative positions"))
            .part(doubts_of(&report.warnings)),
    );
    parts.extend(expanded::limit(about.acceptance));
    terminal::text(parts)
}

/// One HTML file that opens from disk.
pub fn html(report: &ObservationsReport, about: &About) -> String {
    let title = format!("Calibration of {}", report.before.name);
    let mut parts = sections(report);
    let expanded = report.expanded();
    parts.push(expanded::section(
        expanded.as_ref(),
        "relative positions",
        &report.before.robot,
    ));
    parts.push(expanded::glossary());
    let value = |expected: Option<&ExpectedError>, of: fn(&ExpectedError) -> PositionSigma| {
        expected.map_or("unknown".to_owned(), |own| {
            format!("{} mm", small(of(own).rms))
        })
    };
    let (before, after) = (
        report.expected_before.as_ref(),
        report.expected_after.as_ref(),
    );
    let body = html! {
        h1 { (title) }
        p { (headline(report)) }
        @if let Some(document) = about.document { (document.page()) }
        div.tiles {
            (tile("Relative positions before", &value(before, |e| e.intrinsic), "expected, rms over the workspace"))
            (tile("Relative positions after", &value(after, |e| e.intrinsic), "expected, rms over the workspace"))
            (tile("Residuals", &format!("{:.2}", report.lack_of_fit), "of what the noise allows; 1 is right"))
        }
        (expanded::page_verdict(about.acceptance))
        (doubts_of(&report.warnings))
        @for part in &parts { (part) }
    };
    page::render(&title, &body)
}

fn sections(report: &ObservationsReport) -> Vec<Section> {
    let comparisons = between(&report.before.robot, &report.fit.outcome);
    let mut parts = vec![positions(report), known(report)];
    parts.push(parameters_of(
        comparisons,
        report.before.tolerance.is_some(),
    ));
    parts.extend(transmissions(report));
    parts.extend(planes(report));
    parts.extend(points(report));
    parts.extend(sensor_frame_of(&report.after).filter(|_| report.frame == Frame::Sensor));
    parts.push(rows(report));
    parts
}

/// "robot.toml from 45 rows of touches.csv: 45 heights".
fn headline(report: &ObservationsReport) -> String {
    let stated = match report.before.tolerance {
        Some(_) => "tolerance and noise stated",
        None => "noise stated, no tolerance",
    };
    format!(
        "{} from {} of {}: {}; {stated}",
        report.before.name,
        count(report.samples.rows.len(), "row"),
        report.samples.name,
        readings_in_words(&report.samples),
    )
}

/// "45 heights and 12 distances".
pub(in crate::report) fn readings_in_words(file: &ObservationsFile) -> String {
    let readings =
        |of: fn(&Reading) -> usize| -> usize { file.rows.iter().map(|row| of(&row.value)).sum() };
    let kinds = [
        (
            readings(|row| row.position.iter().flatten().count()),
            "coordinate",
        ),
        (readings(|row| usize::from(row.height.is_some())), "height"),
        (
            readings(|row| usize::from(row.distance.is_some())),
            "distance",
        ),
    ];
    let kinds: Vec<_> = kinds
        .into_iter()
        .filter(|(number, _)| *number > 0)
        .map(|(number, kind)| count(number, kind))
        .collect();
    list(&kinds)
}

fn positions(report: &ObservationsReport) -> Section {
    let figure = |expected: &Option<ExpectedError>, of: fn(&ExpectedError) -> PositionSigma| {
        let sigma = expected.as_ref().map(of);
        [
            small_or("unknown", sigma.map(|sigma| sigma.rms)),
            small_or("unknown", sigma.map(|sigma| sigma.max)),
        ]
    };
    let row = |of: fn(&ExpectedError) -> PositionSigma| {
        let [before, before_max] = figure(&report.expected_before, of);
        let [after, after_max] = figure(&report.expected_after, of);
        [before, after, before_max, after_max]
    };
    let table = Table::new([
        "mm, one sigma",
        "rms before",
        "rms after",
        "worst before",
        "worst after",
    ])
    .row("relative positions", row(|expected| expected.intrinsic))
    .row(
        "positions in the base frame",
        row(|expected| expected.absolute),
    );
    Section::new("Expected position error over the workspace")
        .table(table)
        .note(
            "Relative positions are those of the robot's poses to each other: what remains of the error \
             after the rigid motion that explains most of it. Before: what the tolerance allows.",
        )
}

fn known(report: &ObservationsReport) -> Section {
    let gaps = report.known.gaps(&report.samples);
    let section = Section::new("What the measurements determine");
    if gaps.is_empty() {
        return section.part(Part::Good(
            "The measurements determine all that relative positions depend on, and the robot's place in \
             space, better than the tolerance does."
                .to_owned(),
        ));
    }
    gaps.into_iter().fold(section, Section::text)
}

fn transmissions(report: &ObservationsReport) -> Option<Section> {
    let found = report.transmissions.as_ref()?;
    let with_sigma =
        |(value, sigma): (f64, f64)| format!("{:.4} ± {:.4}", degrees(value), degrees(sigma));
    let table = Table::of(found.iter().zip(1..))
        .column("joint", |(_, joint)| *joint)
        .column("gain, ‰", |(own, _)| {
            format!("{:.3} ± {:.3}", 1e3 * own.numbers[0], 1e3 * own.sigmas[0])
        })
        .column("once a turn, deg", |(own, _)| {
            with_sigma(own.first_harmonic)
        })
        .column("twice a turn, deg", |(own, _)| {
            with_sigma(own.second_harmonic)
        })
        .table();
    let section = Section::new("Gears and encoders").table(table).note(
        "By how much the angle of an arm is not that of its joint: a gear ratio that is not as stated, and the \
         amplitudes of an eccentric and of an oval gear or encoder. ±: one sigma. Over a part of a turn they and the \
         arm's dimensions can stand for each other: together they are known better than each alone.",
    );
    Some(section)
}

fn planes(report: &ObservationsReport) -> Option<Section> {
    let found = report.samples.planes.iter().zip(&report.fit.planes);
    let table = Table::of(found)
        .column("plane", |(name, _)| (*name).clone())
        .column("z at x = y = 0, mm", |(_, plane)| {
            format!("{:.4}", plane.offset / plane.normal.z)
        })
        .column("tilt, deg", |(_, plane)| {
            format!("{:.3}", degrees(plane.normal.z.acos()))
        })
        .column("down towards, deg", |(_, plane)| {
            format!("{:.0}", degrees(plane.normal.y.atan2(plane.normal.x)))
        })
        .table();
    (!report.fit.planes.is_empty()).then(|| {
        Section::new("Planes").table(table).note(
            "In the robot's frame. The azimuth towards which a plane falls is counted from x to y.",
        )
    })
}

fn points(report: &ObservationsReport) -> Option<Section> {
    let found = report.samples.points.iter().zip(&report.fit.points);
    let table = Table::of(found)
        .column("point", |(name, _)| (*name).clone())
        .column("x, mm", |(_, point)| format!("{:.4}", point.place.x))
        .column("y, mm", |(_, point)| format!("{:.4}", point.place.y))
        .column("z, mm", |(_, point)| format!("{:.4}", point.place.z))
        .column("reads too much, mm", |(_, point)| {
            format!("{:.4}", point.offset)
        })
        .table();
    (!report.fit.points.is_empty()).then(|| Section::new("Points").table(table))
}

fn rows(report: &ObservationsReport) -> Section {
    let mut indices: Vec<_> = (0..report.samples.rows.len()).collect();
    indices.sort_by(|a, b| report.row_residual(*b).total_cmp(&report.row_residual(*a)));
    indices.truncate(MANY_ON_A_PAGE);
    let reading = |row: &Reading| {
        let mut kinds: Vec<String> = ["x", "y", "z"]
            .into_iter()
            .zip(row.position)
            .filter_map(|(name, value)| value.map(|_| name.to_owned()))
            .collect();
        if let Some((plane, _)) = row.height {
            let name = report.samples.planes.get(plane);
            kinds.push(format!("height above {}", name.map_or("", String::as_str)));
        }
        match row.distance {
            Some((ReadingFrom::Point(point), _)) => {
                let name = report.samples.points.get(point);
                kinds.push(format!("distance from {}", name.map_or("", String::as_str)));
            }
            Some((ReadingFrom::Pose(_), _)) => kinds.push("distance between poses".to_owned()),
            None => {}
        }
        list(&kinds)
    };
    let row = |index: &usize| &report.samples.rows[*index];
    let table = Table::of(indices)
        .column("line", |index| row(index).line)
        .column("measured", |index| reading(&row(index).value))
        .column("residual, sigma", |index| {
            format!("{:.2}", report.row_residual(*index))
        })
        .column("", |index| {
            if report.fit.suspected.contains(index) {
                "left out"
            } else {
                ""
            }
        })
        .table()
        .at_most(SHOWN, "--json and --report show all rows");
    Section::new("Rows, the farthest off first")
        .table(table)
        .note(format!(
            "All residuals together are {:.2} times what noise and tolerance allow; 1 is right.",
            report.lack_of_fit
        ))
}

/// The numbers, and one σ of each.
fn transmission_json(found: &TransmissionFound) -> Value {
    json!({ "found": transmission(found.numbers), "sigma": transmission(found.sigmas) })
}

/// For programs. Lengths in millimetres, angles in degrees; `null` where a figure is unknown.
pub fn json(report: &ObservationsReport, about: &About) -> Value {
    let comparisons = between(&report.before.robot, &report.fit.outcome);
    let rows = report.samples.rows.len();
    let some = shown(rows, MANY, |index| report.row_residual(index));
    let sampled = some
        .as_ref()
        .map(|some| json!({ "shown": some.len(), "of": rows }));
    let samples = some.unwrap_or_else(|| (0..rows).collect());
    let samples = samples.into_iter().map(|index| {
        json!({
            "line": report.samples.rows[index].line,
            // rms over the readings of the row: 1 is expected.
            "residual_sigma": report.row_residual(index),
            // By what its squared residuals are multiplied in the fit: 1 without `--loss`.
            "weight": report.fit.weights[index],
            // Whether `--loss` leaves it out.
            "suspected": report.fit.suspected.contains(&index),
        })
    });
    let planes: Map<_, _> = report
        .samples
        .planes
        .iter()
        .zip(&report.fit.planes)
        .map(|(name, plane)| {
            // height = normal · X − offset_mm.
            let value = json!({ "normal": plane.normal.data.0[0], "offset_mm": plane.offset });
            (name.clone(), value)
        })
        .collect();
    let points: Map<_, _> = report
        .samples
        .points
        .iter()
        .zip(&report.fit.points)
        .map(|(name, point)| {
            // distance = |X − position_mm| + offset_mm.
            let place = point.place.data.0[0];
            (
                name.clone(),
                json!({ "position_mm": place, "offset_mm": point.offset }),
            )
        })
        .collect();
    let arms = comparisons
        .chunks(of_an_arm(&comparisons))
        .zip(1_usize..)
        .map(|(parameters, arm)| {
            json!({
                // 1, 2 or 3.
                "arm": arm,
                "parameters": parameters_json(parameters),
                // What its gear and encoder do beside turning it; `null` if that was not to be found.
                "transmission": report.transmissions.as_ref().map(|all| transmission_json(&all[arm - 1])),
            })
        });
    let contents = json!({
        "robot_file": report.before.name,
        "samples_file": report.samples.name,
        "frame": match report.frame {
            Frame::Base => "base",
            Frame::Sensor => "sensor",
        },
        "row_count": report.samples.rows.len(),
        "reading_count": report.samples.readings(),
        "arms": arms.collect::<Vec<_>>(),
        // The position error that the robot is expected to have before and after; `null` if unknown.
        "expected_error_before": report.expected_before.as_ref().map(expected_error),
        "expected_error": report.expected_after.as_ref().map(expected_error),
        // `expected_error` as an expanded uncertainty of relative positions; `null` if unknown.
        "expanded_uncertainty": expanded::json(report.expanded().as_ref(), true),
        // Whether that is within `--limit`; `null` without.
        "acceptance": expanded::acceptance_json(about.acceptance),
        // The probability that the positions relative to each other are worse after the calibration than before; `null` if
        // unknown.
        "chance_of_harm": report.workspace.and_then(|own| own.chance_of_harm),
        // What the measurements determine.
        "known": {
            // How many combinations of the 24 parameters, better than the tolerance does.
            "combinations": report.known.combinations,
            // Whether they say where the robot stands in space, and how large it is.
            "place": report.known.place,
            "scale": report.known.scale,
        },
        "planes": planes,
        "points": points,
        // X_sensor = rotation · X_robot + translation_mm; `null` with `--frame base`.
        "sensor_frame": report.fit.frame.map(|frame| json!({
            "rotation": frame.rotation.transpose().data.0,
            "translation_mm": frame.translation.data.0[0],
        })),
        // √ of χ² over the degrees of freedom: 1 is expected.
        "lack_of_fit": report.lack_of_fit,
        // By what every σ is multiplied.
        "sigma_widened_by": report.widening,
        // In the file's order; of more than 10,000 those that are farthest off, and others spread evenly.
        "samples": samples.collect::<Vec<_>>(),
        // How many of how many rows `samples` holds; `null` if all.
        "sampled": sampled,
        "warnings": report.warnings,
        // Robot, measurement, files and date.
        "document": about.document.map(Document::json),
    });
    json::report(SCHEMA_VERSION, contents)
}
