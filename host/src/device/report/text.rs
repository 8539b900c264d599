//! The reports for people.

use super::json::hexadecimal;
use super::{firmware, microseconds, origin, phase, processor, result_in_use, scalar};
use crate::device::{Comparison, Number, Pace};
use anstyle::{AnsiColor, Style};
use delta_cal_protocol::{ControlLoop, Counters, Identity, Origin, Parameters, Status};
use std::fmt::Write;

const HEADING: Style = Style::new().bold();
const GOOD: Style = AnsiColor::Green.on_default();
const DOUBTFUL: Style = AnsiColor::Yellow.on_default().bold();

/// Differences that are shown one by one.
const SHOWN: usize = 10;

/// What the instructions of an emulated controller mean.
const NOT_CYCLES: &str = "  (emulated: instructions, not the cycles of a real core)\n";

/// One line: who is there.
pub fn identity(port: &str, identity: &Identity) -> String {
    format!(
        "Controller on {port}: {}, firmware {}, computes in {}\n",
        processor(identity.processor),
        firmware(identity),
        scalar(identity)
    )
}

fn line(text: &mut String, label: &str, value: &str) {
    let _ = writeln!(text, "  {label:<42}{value:>14}");
}

fn heading(text: &mut String, title: &str) {
    let _ = writeln!(text, "{HEADING}{title}{HEADING:#}");
}

/// A turn of the loop: in instructions if it is emulated, otherwise in time.
fn turn(text: &mut String, label: &str, ticks: u32, ticks_a_second: u32, pace: Option<Pace>) {
    let (unit, value) = if let Some(pace) = pace {
        let instructions = pace.instructions(ticks, ticks_a_second);
        ("instructions", instructions.map(|count| count.to_string()))
    } else {
        let time = microseconds(ticks, ticks_a_second);
        ("µs", time.map(|time| format!("{time:.2}")))
    };
    let value = value.unwrap_or_else(|| "unknown".to_owned());
    line(text, &format!("{label}, {unit}"), &value);
}

/// The control loop while it was calibrated.
pub fn while_calibrating<T: Number>(
    before: &ControlLoop<T>,
    after: &ControlLoop<T>,
    pace: Option<Pace>,
) -> String {
    let mut text = String::new();
    heading(
        &mut text,
        "The control loop while the controller calibrated",
    );
    let turns = after.turns.wrapping_sub(before.turns);
    line(&mut text, "turns", &turns.to_string());
    let late = after.late.wrapping_sub(before.late);
    line(&mut text, "of them late or left out", &late.to_string());
    let ticks = after.longest_ticks_calibrating;
    turn(&mut text, "longest turn", ticks, after.ticks_a_second, pace);
    if pace.is_some() {
        text.push_str(NOT_CYCLES);
    }
    text
}

/// What the controller is doing.
pub fn status<T: Number>(
    status: &Status<T>,
    parameters: &Parameters<T>,
    counters: &Counters,
    pace: Option<Pace>,
) -> String {
    let control = &status.control;
    let mut text = String::new();
    let style = match parameters.origin {
        Origin::NominalStoreDamaged | Origin::CalibrationStoreDamaged => DOUBTFUL,
        _ => Style::new(),
    };
    let _ = writeln!(
        text,
        "Parameters in use: {style}{}{style:#} (fingerprint {})",
        origin(parameters.origin),
        hexadecimal(control.fingerprint)
    );
    let result = match result_in_use(&status.phase, parameters) {
        None => "",
        Some(true) => "; the result is in use",
        Some(false) => "; the result is not in use",
    };
    let _ = writeln!(text, "Calibration: {}{result}\n", phase(&status.phase));
    heading(&mut text, "The control loop since the controller started");
    line(&mut text, "turns", &control.turns.to_string());
    line(&mut text, "late or left out", &control.late.to_string());
    line(
        &mut text,
        "point out of reach",
        &control.unreachable.to_string(),
    );
    line(
        &mut text,
        "switches to other parameters",
        &control.switches.to_string(),
    );
    for (label, ticks) in [
        ("longest turn", control.longest_ticks),
        ("during a calibration", control.longest_ticks_calibrating),
    ] {
        turn(&mut text, label, ticks, control.ticks_a_second, pace);
    }
    if pace.is_some() {
        text.push_str(NOT_CYCLES);
    }
    let [x, y, z] = control.point.map(delta_cal::Real::to_f64);
    let _ = writeln!(text, "  platform at {x:.3}, {y:.3}, {z:.3} mm");
    let [q1, q2, q3] = control.joints.map(|q| q.to_f64().to_degrees());
    let _ = writeln!(text, "  joints at {q1:.3}, {q2:.3}, {q3:.3} deg\n");
    heading(&mut text, "The link since the controller started");
    for (label, count) in [
        ("frames received whole", counters.received),
        ("damaged", counters.damaged),
        ("repeated", counters.repeated),
        ("lost before they arrived", counters.lost),
        ("of an unknown version", counters.unknown_version),
        ("whole, and no request", counters.unknown_request),
        ("requests refused", counters.refused),
        ("bytes lost because they came too fast", counters.overrun),
    ] {
        line(&mut text, label, &count.to_string());
    }
    text
}

/// A comparison of bits.
pub fn comparison(calibrated: bool, samples: usize, comparison: &Comparison) -> String {
    let mut text = String::new();
    let what = if calibrated {
        "calibrated the robot"
    } else {
        "refused the calibration"
    };
    let equal = comparison.figures - comparison.differences.len();
    let _ = writeln!(
        text,
        "From {samples} samples both {what}; {equal} of {} figures are equal to the bit.",
        comparison.figures
    );
    if comparison.differences.is_empty() {
        let _ = writeln!(
            text,
            "{GOOD}Controller and host agree.{GOOD:#} Nothing was applied."
        );
        return text;
    }
    heading(
        &mut text,
        &format!("{:<34}{:>22}{:>22}", "Different", "controller", "host"),
    );
    for difference in comparison.differences.iter().take(SHOWN) {
        let _ = writeln!(
            text,
            "  {:<32}{:>22}{:>22}",
            difference.figure, difference.device, difference.here
        );
    }
    if let Some(more) = comparison.differences.len().checked_sub(SHOWN)
        && more > 0
    {
        let _ = writeln!(text, "  and {more} more");
    }
    text
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

/// What a revert did.
pub fn reverted<T: Number>(before: &Parameters<T>, after: &Parameters<T>) -> String {
    let [from, to] = [before, after].map(|parameters| {
        let fingerprint = delta_cal_protocol::fingerprint(&parameters.arms);
        format!(
            "{} (fingerprint {})",
            origin(parameters.origin),
            hexadecimal(fingerprint)
        )
    });
    if from == to {
        return format!("Parameters in use: {to}, as before: these are the ones to go back to\n");
    }
    format!("Parameters before: {from}\nParameters in use: {GOOD}{to}{GOOD:#}\n")
}
