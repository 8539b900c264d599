//! For programs. Lengths in millimetres; `null` where a figure is unknown.

use crate::accuracy::sampled::{MANY, shown};
use crate::fit::options::Frame;
use crate::render::json;
use crate::report::document::Document;
use crate::validation::{Bounded, Deviation, Validation, Verdict};
use serde_json::{Value, json};

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The report of a validation.
pub fn report(found: &Validation, document: &Document) -> Value {
    let rows = found.rows.len();
    let some = shown(rows, MANY, |index| found.rows[index].distance);
    let sampled = some
        .as_ref()
        .map(|some| json!({ "shown": some.len(), "of": rows }));
    let indices = some.unwrap_or_else(|| (0..rows).collect());
    let row = |row: &Deviation| {
        json!({
            "line": row.line,
            // Between measured and computed position, with the instrument's noise in it.
            "deviation_mm": row.distance,
        })
    };
    let contents = json!({
        "robot_file": found.robot.name,
        "samples_file": found.samples_file,
        "frame": match found.request.frame {
            Frame::Base => "base",
            Frame::Sensor => "sensor",
        },
        // `pass`, `undecided` or `fail`, of all limits together.
        "verdict": found.verdict.name(),
        "passed": found.verdict == Verdict::Pass,
        // In one sentence.
        "text": super::words::verdict(found),
        // The rms position error over the region that was measured, without the noise.
        "rms_error": {
            "estimate_mm": found.rms.value,
            // With 95 % confidence.
            "interval_mm": interval(&found.rms),
            // Effective ones, of the interval.
            "degrees_of_freedom": found.error.degrees_of_freedom(),
            "limit_mm": found.request.limit,
            "verdict": found.rms_verdict.name(),
            // That the error is below the limit.
            "confidence_below_limit": found.confidence(),
            // How many poses in all would decide it, if it is undecided; `null` if none or too many.
            "poses_to_decide": found.poses_to_decide,
        },
        // The largest position error at the measured poses, without the noise.
        "largest_error": {
            "estimate_mm": found.largest.value,
            "interval_mm": interval(&found.largest),
            // `null` without `--limit-largest`.
            "limit_mm": found.request.largest_limit,
            "verdict": found.largest_verdict.map(Verdict::name),
        },
        // What was measured, with the noise in it.
        "deviation_mm": {
            "rms": found.deviation.rms,
            "max": found.deviation.max,
            "max_at_line": found.deviation.max_at_line,
        },
        // rms of the noise that was removed; `null` if none was.
        "noise_mm": found.noise,
        "row_count": rows,
        // Different joint angles.
        "pose_count": found.poses,
        // From and to, of x, y and z in the robot's frame.
        "region_mm": found.region,
        // X_sensor = rotation · X_robot + translation_mm; `null` with `--frame base`.
        "sensor_frame": found.sensor_frame.map(|frame| json!({
            "rotation": frame.rotation.transpose().data.0,
            "translation_mm": frame.translation.data.0[0],
        })),
        // In the file's order; of more than 10,000 those farthest off, and others spread evenly.
        "rows": indices.into_iter().map(|index| row(&found.rows[index])).collect::<Vec<_>>(),
        // How many of how many `rows` holds; `null` if all.
        "sampled": sampled,
        // Anything doubtful, in plain words.
        "warnings": found.warnings,
        // Robot, measurement, files and date.
        "document": document.json(),
    });
    json::report(SCHEMA_VERSION, contents)
}

/// From and to.
fn interval(figure: &Bounded) -> Value {
    json!([figure.lower, figure.upper])
}
