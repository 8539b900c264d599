//! Reports of a controller, as text and JSON. Lengths in millimetres, angles in degrees.

use super::Number;
use crate::calibration::Report as Calibrated;
use crate::files::Convention;
use crate::render::{Section, Table, terminal};
use crate::report::Versioned;
use crate::text::{in_unit, small};
use delta_cal::Parameter;
use delta_cal_protocol::{
    ControlLoop, Counters, Geometry, Identity, Motion, Origin, Parameters, Phase, Scalar, Status,
};
use serde_json::{Map, Value, json};
use std::fmt::Display;

const SCHEMA_VERSION: u32 = 2;
const ARM_LIMITED: u32 = 0x41;

/// What is reported of a controller.
#[derive(Debug, Default)]
pub(crate) struct Report {
    /// Of the JSON report.
    pub(crate) keys: Value,
    pub(crate) text: String,
    /// The geometry as a robot file, if it was asked for.
    pub(crate) robot_file: String,
}

impl Report {
    /// With the header that all reports have in common.
    pub(crate) fn of(mut self, port: &impl Display, identity: &Identity) -> Self {
        let [major, minor, patch] = identity.firmware;
        let firmware = format!("{major}.{minor}.{patch}");
        let processor = processor(identity.processor);
        let scalar = match identity.scalar {
            Scalar::Single => "f32",
            Scalar::Double => "f64",
        };
        let text = format!(
            "Controller on {port}: {processor}, firmware {firmware}, computes in {scalar}\n{}",
            self.text
        );
        let mut keys = json!({
            "port": port.to_string(),
            "device": {
                "firmware": firmware,
                "scalar": scalar,
                "processor": processor,
                "nominal_fingerprint": hexadecimal(identity.nominal),
            },
        });
        if let (Some(keys), Value::Object(own)) = (keys.as_object_mut(), self.keys.take()) {
            keys.extend(own);
        }
        Self { keys, text, ..self }
    }

    pub(crate) fn json(&self) -> String {
        crate::report::json(&Versioned::new(SCHEMA_VERSION, &self.keys))
    }
}

/// The name of a processor with this CPUID: "Cortex-M4 r0p1".
fn processor(cpuid: u32) -> String {
    let core = match (cpuid >> 24, (cpuid >> 4) & 0xfff) {
        (ARM_LIMITED, 0xc20) => "Cortex-M0",
        (ARM_LIMITED, 0xc60) => "Cortex-M0+",
        (ARM_LIMITED, 0xc23) => "Cortex-M3",
        (ARM_LIMITED, 0xc24) => "Cortex-M4",
        (ARM_LIMITED, 0xc27) => "Cortex-M7",
        (ARM_LIMITED, 0xd21) => "Cortex-M33",
        (ARM_LIMITED, 0xd22) => "Cortex-M55",
        (ARM_LIMITED, 0xd23) => "Cortex-M85",
        _ => return format!("processor {cpuid:#010x}"),
    };
    format!("{core} r{}p{}", (cpuid >> 20) & 0xf, cpuid & 0xf)
}

pub(crate) fn hexadecimal(fingerprint: u32) -> String {
    format!("{fingerprint:08x}")
}

pub(crate) const fn origin(origin: Origin) -> &'static str {
    match origin {
        Origin::Nominal => "nominal",
        Origin::NominalStoreDamaged => "nominal: the stored parameters are damaged",
        Origin::Calibration => "calibrated",
        Origin::CalibrationStoreDamaged => {
            "calibrated: part of the store is damaged, it may be the calibration before the last"
        }
        Origin::NominalStoreOther => {
            "nominal: the stored parameters are those of another firmware version or robot"
        }
        _ => "unknown",
    }
}

fn phase(phase: &Phase) -> String {
    match phase {
        Phase::Idle => "none since the start".to_owned(),
        Phase::Collecting { samples } => format!("taking samples, {samples} so far"),
        Phase::Solving => "solving".to_owned(),
        Phase::Solved { samples, .. } => format!("solved from {samples} samples"),
        Phase::CalibrationRefused { samples, refusal } => {
            format!("refused after {samples} samples: {refusal}")
        }
        _ => "unknown".to_owned(),
    }
}

/// A title and rows of names and figures.
fn rows<const N: usize>(title: &str, rows: [(&str, &dyn Display); N]) -> Section {
    let facts = rows.map(|(name, figure)| (name, figure.to_string()));
    Section::new(title).table(Table::facts(facts))
}

/// The duration of a turn, µs; `None` if the controller does not know how fast its timer is.
fn duration<T>(control: &ControlLoop<T>, ticks: u32) -> Option<f64> {
    let ticks_a_second = control.ticks_a_second;
    (ticks_a_second > 0).then(|| f64::from(ticks) * 1e6 / f64::from(ticks_a_second))
}

fn microseconds(time: Option<f64>) -> String {
    time.map_or_else(|| "unknown".to_owned(), |time| format!("{time:.1} µs"))
}

/// What the joints do.
pub(crate) const fn motion<T>(control: &ControlLoop<T>) -> &'static str {
    match control.motion {
        Motion::Approaching => "approaches the path",
        Motion::Following => "follows the path",
        Motion::Unreachable => "stopped: a point is out of reach (go on: delta-cal device resume)",
        Motion::TooFast => {
            "stopped: the path is faster than the drives (go on: delta-cal device resume)"
        }
        _ => "unknown",
    }
}

/// The last point of the path, mm, and its joint angles, degrees.
fn pose<T: Number>(control: &ControlLoop<T>) -> [[f64; 3]; 2] {
    let joints = control.joints.map(|q| q.to_f64().to_degrees());
    [control.point.map(T::to_f64), joints]
}

/// The control loop since the controller started; in a calibration's report, the first three count from its start.
fn control_loop<T: Number>(control: &ControlLoop<T>) -> Value {
    let [point, joints] = pose(control);
    json!({
        "turns": control.turns,
        "late": control.late,
        "stops": control.stops,
        "motion": motion(control),
        "turns_a_second": control.turns_a_second,
        "longest_turn_us": duration(control, control.longest_ticks),
        "longest_turn_calibrating_us": duration(control, control.longest_ticks_calibrating),
        "switches": control.switches,
        "fingerprint": hexadecimal(control.fingerprint),
        "point_mm": point,
        "joints_deg": joints,
    })
}

/// The controller's status. `result_in_use` is null without a result, `gate` without a gate.
pub(crate) fn status<T: Number>(
    status: &Status<T>,
    parameters: &Parameters<T>,
    link: &Counters,
) -> Report {
    let control = &status.control;
    let (phase, origin) = (phase(&status.phase), origin(parameters.origin));
    let in_use = match &status.phase {
        Phase::Solved { fingerprint, .. } => {
            Some(*fingerprint == parameters.geometry.fingerprint())
        }
        _ => None,
    };
    let result = match in_use {
        None => "",
        Some(true) => "; the result is in use",
        Some(false) => "; the result is not in use",
    };
    let fingerprint = hexadecimal(control.fingerprint);
    let mut state = Section::new("")
        .text(format!(
            "Parameters in use: {origin} (fingerprint {fingerprint})"
        ))
        .text(format!("Calibration: {phase}{result}"));
    let mut counts = Value::Null;
    if let Some(gate) = status.gate {
        let alarm = gate.alarm.map(|own| own.to_string());
        state = state.text(format!(
            "Gate: {} samples taken ({} untested), {} rejected",
            gate.taken, gate.untested, gate.rejected
        ));
        if let Some(alarm) = &alarm {
            state = state.text(format!("Alarm: {alarm}"));
        }
        counts = json!({
            "taken": gate.taken,
            "untested": gate.untested,
            "rejected": gate.rejected,
            "alarm": alarm,
        });
    }
    let longest = [control.longest_ticks, control.longest_ticks_calibrating];
    let [longest, calibrating] = longest.map(|own| microseconds(duration(control, own)));
    let [[x, y, z], [q1, q2, q3]] = pose(control);
    let turns = rows(
        "Control loop since the start",
        [
            ("motion", &motion(control)),
            ("turns per second", &control.turns_a_second),
            ("turns", &control.turns),
            ("late or left out", &control.late),
            ("stops", &control.stops),
            ("longest turn", &longest),
            ("longest turn while calibrating", &calibrating),
            ("switches to other parameters", &control.switches),
        ],
    )
    .text(format!("platform at {x:.3}, {y:.3}, {z:.3} mm"))
    .text(format!("joints at {q1:.3}, {q2:.3}, {q3:.3} deg"));
    let frames = [
        ("received", "frames received", link.received),
        ("damaged", "damaged", link.damaged),
        (
            "unknown_version",
            "of an unknown version",
            link.unknown_version,
        ),
        ("unknown_request", "unknown requests", link.unknown_request),
        ("repeated", "repeated", link.repeated),
        ("lost", "lost", link.lost),
        ("refused", "refused requests", link.refused),
        ("overrun", "bytes lost in the UART", link.overrun),
    ];
    let link = frames.map(|(key, _, count)| (key.to_owned(), Value::from(count)));
    let frames = frames.map(|(_, name, count)| (name, count.to_string()));
    let frames = Section::new("Link since the start").table(Table::facts(frames));
    Report {
        keys: json!({
            "session": status.session,
            "phase": phase,
            "origin": origin,
            "result_in_use": in_use,
            "gate": counts,
            "control_loop": control_loop(control),
            "link": Map::from_iter(link),
        }),
        text: terminal::text([state, turns, frames]),
        ..Report::default()
    }
}

/// A calibration done by the controller. `here` is the report of `delta-cal calibrate` on the same files, `difference_mm`
/// the rms difference between the positions of both results at the samples.
pub(crate) fn calibration<T: Number>(
    here: &Calibrated,
    difference_mm: f64,
    (result, control): (&Geometry<T>, &ControlLoop<T>),
    applied: bool,
    repeated_requests: u32,
) -> Report {
    let longest = duration(control, control.longest_ticks_calibrating);
    let turns = rows(
        "Control loop while the controller calibrated",
        [
            ("turns", &control.turns),
            ("late or left out", &control.late),
            ("longest turn", &microseconds(longest)),
            ("requests lost and repeated", &repeated_requests),
        ],
    );
    let fingerprint = hexadecimal(result.fingerprint());
    let next = if applied {
        format!(
            "Applied: the control loop uses the new parameters (fingerprint {fingerprint}).\n\
             Undo: delta-cal device --port PORT revert\n"
        )
    } else {
        format!("Not applied (fingerprint {fingerprint}). Apply: the same command with --apply\n")
    };
    Report {
        text: format!(
            "\n{}\n{turns}\nThe controller's positions differ by {} mm rms from those of the report above.\n{next}",
            here.to_text(),
            small(difference_mm)
        ),
        keys: json!({
            "calibration": here,
            "difference_mm": difference_mm,
            "fingerprint": fingerprint,
            "applied": applied,
            "control_loop": control_loop(control),
            "repeated_requests": repeated_requests,
        }),
        ..Report::default()
    }
}

/// A geometry of the controller, `current` or `nominal`, in the axes and signs of a convention. `transmissions`, the errors
/// of each joint's gear and encoder, is null if there are none.
pub(crate) fn parameters<T: Number>(
    set: &str,
    parameters: &Parameters<T>,
    convention: &Convention,
) -> Report {
    let arm = |values: [T; 8]| -> Map<String, Value> {
        let named = Parameter::ROTARY.into_iter().zip(values);
        let named = named.map(|(own, value)| {
            let value = in_unit(own, convention.parameter(own, value.to_f64()));
            (own.symbol().to_owned(), value.into())
        });
        named.collect()
    };
    let transmission = |own: [T; 5]| {
        let [gain, harmonics @ ..] = convention.transmission(own.map(T::to_f64));
        let [cos, sin, cos2, sin2] = harmonics.map(f64::to_degrees);
        json!({
            "gain": gain,
            "cos_deg": cos,
            "sin_deg": sin,
            "cos2_deg": cos2,
            "sin2_deg": sin2,
        })
    };
    let geometry = &parameters.geometry;
    Report {
        keys: json!({
            "set": set,
            "convention": convention.to_string(),
            "origin": origin(parameters.origin),
            "fingerprint": hexadecimal(geometry.fingerprint()),
            "arms": geometry.arms.map(arm),
            "transmissions": geometry.transmissions.map(|all| all.map(transmission)),
        }),
        ..Report::default()
    }
}

/// The parameters in use, compared with those before.
pub(crate) fn changed<T: Number>(
    before: &Parameters<T>,
    after: &Parameters<T>,
    convention: &Convention,
) -> Report {
    let [from, to] = [before, after].map(|own| {
        let fingerprint = hexadecimal(own.geometry.fingerprint());
        format!("{} (fingerprint {fingerprint})", origin(own.origin))
    });
    let text = if from == to {
        format!("Parameters in use: {to}, unchanged\n")
    } else {
        format!("Parameters before: {from}\nParameters in use: {to}\n")
    };
    Report {
        text,
        ..parameters("current", after, convention)
    }
}
