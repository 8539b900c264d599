//! The reports for people.

use super::json::hexadecimal;
use super::{firmware, microseconds, origin, phase, processor, result_in_use, scalar};
use crate::device::{Comparison, Number, Pace};
use crate::render::section::{Part, Section};
use crate::render::table::Table;
use crate::render::terminal::{self, DOUBTFUL, GOOD};
use crate::text::numbers::small;
use anstyle::Style;
use delta_cal_protocol::{ControlLoop, Counters, GateStatus, Identity, Origin, Parameters, Status};
use std::fmt::Write;

/// Differences that are shown one by one.
const SHOWN: usize = 10;

/// One line: who is there.
pub fn identity(port: &str, identity: &Identity) -> String {
    format!(
        "Controller on {port}: {}, firmware {}, computes in {}\n",
        processor(identity.processor),
        firmware(identity),
        scalar(identity)
    )
}

/// A turn of the loop: in instructions if it is emulated, otherwise in time.
fn turn(name: &str, ticks: u32, ticks_a_second: u32, pace: Option<Pace>) -> (String, String) {
    let (unit, value) = if let Some(pace) = pace {
        let instructions = pace.instructions(ticks, ticks_a_second);
        ("instructions", instructions.map(|count| count.to_string()))
    } else {
        let time = microseconds(ticks, ticks_a_second);
        ("µs", time.map(|time| format!("{time:.2}")))
    };
    let value = value.unwrap_or_else(|| "unknown".to_owned());
    (format!("{name}, {unit}"), value)
}

/// Counts and turns of the loop, and what the instructions of an emulated controller mean.
fn control_loop(
    title: &str,
    counts: &[(&str, u32)],
    turns: impl IntoIterator<Item = (String, String)>,
    pace: Option<Pace>,
) -> Section {
    let counts = counts
        .iter()
        .map(|&(name, count)| (name.to_owned(), count.to_string()));
    let section = Section::new(title).table(Table::facts(counts.chain(turns)));
    match pace {
        Some(_) => section.note("(emulated: instructions, not the cycles of a real core)"),
        None => section,
    }
}

/// The control loop while it was calibrated.
pub fn while_calibrating<T: Number>(
    before: &ControlLoop<T>,
    after: &ControlLoop<T>,
    pace: Option<Pace>,
) -> String {
    let counts = [
        ("turns", after.turns.wrapping_sub(before.turns)),
        (
            "of them late or left out",
            after.late.wrapping_sub(before.late),
        ),
    ];
    let ticks = after.longest_ticks_calibrating;
    let longest = turn("longest turn", ticks, after.ticks_a_second, pace);
    let title = "The control loop while the controller calibrated";
    control_loop(title, &counts, [longest], pace).to_string()
}

/// What the controller is doing.
pub fn status<T: Number>(
    status: &Status<T>,
    parameters: &Parameters<T>,
    counters: &Counters,
    pace: Option<Pace>,
) -> String {
    let control = &status.control;
    let style = match parameters.origin {
        Origin::NominalStoreDamaged | Origin::CalibrationStoreDamaged => DOUBTFUL,
        _ => Style::new(),
    };
    let counts = [
        ("turns", control.turns),
        ("late or left out", control.late),
        ("point out of reach", control.unreachable),
        ("switches to other parameters", control.switches),
    ];
    let turns = [
        ("longest turn", control.longest_ticks),
        ("during a calibration", control.longest_ticks_calibrating),
    ]
    .map(|(name, ticks)| turn(name, ticks, control.ticks_a_second, pace));
    let [x, y, z] = control.point.map(delta_cal::Real::to_f64);
    let [q1, q2, q3] = control.joints.map(|q| q.to_f64().to_degrees());
    let title = "The control loop since the controller started";
    let control_loop = control_loop(title, &counts, turns, pace)
        .text(format!("platform at {x:.3}, {y:.3}, {z:.3} mm"))
        .text(format!("joints at {q1:.3}, {q2:.3}, {q3:.3} deg"));
    let link = [
        ("frames received whole", counters.received),
        ("damaged", counters.damaged),
        ("repeated", counters.repeated),
        ("lost before they arrived", counters.lost),
        ("of an unknown version", counters.unknown_version),
        ("whole, and no request", counters.unknown_request),
        ("requests refused", counters.refused),
        ("bytes lost because they came too fast", counters.overrun),
    ];
    let link = link.map(|(name, count)| (name, count.to_string()));
    let result = match result_in_use(&status.phase, parameters) {
        None => "",
        Some(true) => "; the result is in use",
        Some(false) => "; the result is not in use",
    };
    format!(
        "Parameters in use: {style}{}{style:#} (fingerprint {})\nCalibration: {}{result}\n{}\n{}",
        origin(parameters.origin),
        hexadecimal(control.fingerprint),
        phase(&status.phase),
        status.gate.as_ref().map(gate).unwrap_or_default(),
        terminal::text([
            control_loop,
            Section::new("The link since the controller started").table(Table::facts(link)),
        ])
    )
}

/// A line, or two with an alarm.
fn gate(gate: &GateStatus) -> String {
    let counts = &gate.counts;
    let mut text = format!(
        "Gate: {} accepted, of them {} not tested; {} rejected\n",
        counts.taken, counts.untested, counts.rejected
    );
    if let Some(alarm) = &gate.alarm {
        let _ = writeln!(text, "{DOUBTFUL}Alarm: {alarm}{DOUBTFUL:#}");
    }
    text
}

/// A comparison of bits.
pub fn comparison(calibrated: bool, samples: usize, comparison: &Comparison) -> String {
    let what = if calibrated {
        "calibrated the robot"
    } else {
        "refused the calibration"
    };
    let equal = comparison.figures - comparison.differences.len();
    let section = Section::new("").text(format!(
        "From {samples} samples both {what}; {equal} of {} figures are equal to the bit.",
        comparison.figures
    ));
    if comparison.differences.is_empty() {
        return section
            .part(Part::Good("Controller and host agree.".to_owned()))
            .text("Nothing was applied.")
            .to_string();
    }
    let table = Table::of(&comparison.differences)
        .column("Different", |difference| difference.figure.clone())
        .column("controller", |difference| difference.device.clone())
        .column("host", |difference| difference.here.clone())
        .table()
        .at_most(SHOWN, "--json has all");
    section.table(table).to_string()
}

/// What became of a calibration. `kept`: the controller outlives the command.
pub fn applied(applied: bool, fingerprint: u32, kept: bool) -> String {
    let fingerprint = hexadecimal(fingerprint);
    let again = if kept {
        "To go back: delta-cal device --port PORT revert"
    } else {
        "The emulated controller and its flash are gone now; --flash FILE keeps the flash."
    };
    if applied {
        format!(
            "\n{GOOD}Applied{GOOD:#} and stored: the control loop uses the new parameters \
             (fingerprint {fingerprint}).\n{again}\n"
        )
    } else {
        format!(
            "\nNot applied: the controller keeps its parameters. To let it use the new ones \
             (fingerprint {fingerprint}),\ngive the same command with --apply.\n"
        )
    }
}

/// Where the parameters come from.
pub const fn origin_in_words(from: Origin) -> &'static str {
    origin(from)
}

/// Where parameters come from, and what names them.
fn named<T: Number>(parameters: &Parameters<T>) -> String {
    let fingerprint = hexadecimal(parameters.geometry.fingerprint());
    format!("{} (fingerprint {fingerprint})", origin(parameters.origin))
}

/// What was done with a robot that was calibrated elsewhere. `moved`: by how much its positions differ from those of
/// the nominal robot, rms, mm.
pub fn adopted<T: Number>(
    before: &Parameters<T>,
    after: &Parameters<T>,
    file: &str,
    moved: f64,
) -> String {
    let [from, to] = [before, after].map(named);
    let moved = small(moved);
    format!(
        "Parameters before: {from}\nParameters in use: {GOOD}{to}{GOOD:#}\nApplied and stored: the control loop uses \
         {file}, whose positions differ by {moved} mm (rms) from\nthose of the nominal robot.\n"
    )
}

/// What a revert did.
pub fn reverted<T: Number>(before: &Parameters<T>, after: &Parameters<T>) -> String {
    let [from, to] = [before, after].map(named);
    if from == to {
        return format!("Parameters in use: {to}, as before: these are the ones to go back to\n");
    }
    format!("Parameters before: {from}\nParameters in use: {GOOD}{to}{GOOD:#}\n")
}
