//! What the residuals show that the model does not hold.

use crate::calibration::causes::{Cause, CauseKind, Causes};
use crate::calibration::report::CalibrationReport;
use crate::render::section::Section;
use crate::render::table::Table;
use crate::text::numbers::{probability, significant};
use crate::text::words::list_or;
use serde_json::{Value, json};

const TITLE: &str = "Errors that the model does not hold";

/// Causes that were found, or why none was looked for; `None` if none was found.
pub(super) fn section(report: &CalibrationReport) -> Option<Section> {
    let causes = &report.causes;
    if let Some(why) = causes.not_tested {
        return Some(Section::new("").text(format!("{TITLE} were not looked for: {why}.")));
    }
    if causes.found.is_empty() {
        return None;
    }
    let table = Table::of(&causes.found)
        .column("cause", |cause| cause.kind.name().replace('_', " "))
        .column("arm", |cause| {
            cause
                .arm
                .map_or_else(String::new, |arm| (arm.index() + 1).to_string())
        })
        .column("size", |cause| significant(cause.size, 3))
        .column("sigma", |cause| significant(cause.sigma, 2))
        .column("unit", |cause| cause.kind.unit(cause.drive))
        .column("by chance", |cause| probability(cause.probability))
        .table();
    Some(Section::new(TITLE).table(table).text(format!(
        "Together they explain {:.0} % of the residuals' squares and put the calibrated robot off by \
         {} mm (rms over the workspace).{}",
        100.0 * causes.explained,
        significant(causes.position_error, 2),
        widened(report).map_or_else(String::new, |text| format!(" {text}"))
    )))
}

/// That every σ is larger than the stated noise alone makes it, if it is.
fn widened(report: &CalibrationReport) -> Option<String> {
    (report.widening > 1.0).then(|| {
        let of_joints = if report.causes.uneven_noise > 1.0 {
            ", and what noise of the joints adds that is not stated"
        } else {
            ""
        };
        format!(
            "Every sigma of this report is {:.2} times what the noise alone makes it: so that it holds \
             what the model does not{of_joints}.",
            report.widening
        )
    })
}

/// The same for a page: also that nothing was found.
pub(super) fn page_section(report: &CalibrationReport) -> Section {
    let causes = &report.causes;
    match section(report) {
        Some(section) if causes.not_tested.is_none() => section,
        Some(_) => Section::new(TITLE).text(format!(
            "They were not looked for: {}.",
            causes.not_tested.unwrap_or_default()
        )),
        None => {
            let drive = report.before.robot.drive();
            let kinds = CauseKind::all(drive).map(|kind| kind.name().replace('_', " "));
            let kinds = list_or(&kinds.collect::<Vec<_>>());
            let section =
                Section::new(TITLE).text(format!("No {kinds} was found in the residuals."));
            match widened(report) {
                Some(text) => section.text(text),
                None => section,
            }
        }
    }
}

/// `null` if nothing was looked for.
pub(super) fn json(causes: &Causes) -> Value {
    if causes.not_tested.is_some() {
        return Value::Null;
    }
    causes.found.iter().map(cause).collect()
}

fn cause(cause: &Cause) -> Value {
    json!({
        // `gear_ratio`, `eccentricity`, `second_harmonic`, `uneven_travel`, `backlash`, `sag` or `drift`.
        "kind": cause.kind.name(),
        // 1, 2 or 3; `null` of a cause that is not an arm's.
        "arm": cause.arm.map(|arm| arm.index() + 1),
        // The amplitude of what is periodic, the travel at the ends over that in the middle, half of a backlash, the sag at the largest distance from
        // the robot's axis, the drift from the first row to the last.
        "size": cause.size,
        // `ratio`, `deg` or `mm`.
        "unit": cause.kind.unit(cause.drive),
        // One σ of the size.
        "sigma": cause.sigma,
        // The probability that chance shows as much in this test alone.
        "p": cause.probability,
        // What explains the residuals about as well in its place.
        "alternatives": cause.alternatives.iter().map(|other| json!({
            "kind": other.kind.name(),
            "arm": other.arm.map(|arm| arm.index() + 1),
        })).collect::<Vec<_>>(),
        // In one sentence.
        "text": cause.to_string(),
        // What to do about it.
        "remedy": cause.remedy(),
    })
}
