//! Reports of a controller, as text and JSON. Lengths in millimetres, angles in degrees.

use super::Number;
use crate::calibration::Report as Calibrated;
use crate::render::{Section, Table, terminal};
use crate::report::Versioned;
use crate::text::{in_unit, small};
use delta_cal::{Parameter, Real};
use delta_cal_protocol as protocol;
use delta_cal_protocol::{Identity, Origin, Phase, Scalar};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Version of the JSON schema.
const SCHEMA_VERSION: u32 = 2;
const ARM_LIMITED: u32 = 0x41;

/// A report on the controller at a port: the header common to all reports, then `contents`.
#[derive(Debug, Serialize)]
pub(crate) struct Report<C> {
    pub(crate) port: String,
    pub(crate) device: Device,
    #[serde(flatten)]
    pub(crate) contents: C,
}

/// The controller's identity.
#[derive(Debug, Serialize)]
pub(crate) struct Device {
    firmware: String,
    scalar: &'static str,
    /// Its name, or its CPUID.
    processor: String,
    nominal_fingerprint: String,
}

impl Device {
    pub(crate) fn new(identity: &Identity) -> Self {
        let [major, minor, patch] = identity.firmware;
        Self {
            firmware: format!("{major}.{minor}.{patch}"),
            scalar: match identity.scalar {
                Scalar::Single => "f32",
                Scalar::Double => "f64",
            },
            processor: processor(identity.processor),
            nominal_fingerprint: hexadecimal(identity.nominal),
        }
    }
}

impl<C: Serialize> Report<C> {
    /// The report as JSON.
    pub(crate) fn json(&self) -> String {
        crate::report::json(&Versioned::new(SCHEMA_VERSION, self))
    }

    /// The first line of every report.
    pub(crate) fn heading(&self) -> String {
        let own = &self.device;
        format!(
            "Controller on {}: {}, firmware {}, computes in {}\n",
            self.port, own.processor, own.firmware, own.scalar
        )
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

/// A fingerprint in hexadecimal.
pub(crate) fn hexadecimal(fingerprint: u32) -> String {
    format!("{fingerprint:08x}")
}

/// The origin of parameters, in words.
pub(crate) const fn origin(origin: Origin) -> &'static str {
    match origin {
        Origin::Nominal => "nominal",
        Origin::NominalStoreDamaged => "nominal: the stored parameters are damaged",
        Origin::Calibration => "calibrated",
        Origin::CalibrationStoreDamaged => {
            "calibrated: part of the store is damaged, it may be the calibration before the last"
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

/// The control loop since the controller started; in a calibration's report, the first three count from its start.
#[derive(Debug, Serialize)]
pub(crate) struct ControlLoop {
    turns: u32,
    late: u32,
    unreachable: u32,
    longest_turn_us: Option<f64>,
    longest_turn_calibrating_us: Option<f64>,
    switches: u32,
    fingerprint: String,
    /// The last point of the path, and its joint angles.
    point_mm: [f64; 3],
    joints_deg: [f64; 3],
}

impl ControlLoop {
    pub(crate) fn new<T: Number>(control: &protocol::ControlLoop<T>) -> Self {
        let ticks_a_second = control.ticks_a_second;
        let known = ticks_a_second > 0;
        let time = |ticks| known.then(|| f64::from(ticks) * 1e6 / f64::from(ticks_a_second));
        Self {
            turns: control.turns,
            late: control.late,
            unreachable: control.unreachable,
            longest_turn_us: time(control.longest_ticks),
            longest_turn_calibrating_us: time(control.longest_ticks_calibrating),
            switches: control.switches,
            fingerprint: hexadecimal(control.fingerprint),
            point_mm: control.point.map(Real::to_f64),
            joints_deg: control.joints.map(|q| q.to_f64().to_degrees()),
        }
    }
}

fn microseconds(time: Option<f64>) -> String {
    time.map_or_else(|| "unknown".to_owned(), |time| format!("{time:.1} µs"))
}

/// The controller's status.
#[derive(Debug, Serialize)]
pub(crate) struct Status {
    session: u32,
    /// Phase and origin, in words.
    phase: String,
    origin: &'static str,
    /// Whether the result of the last calibration is in use; `null` without a result.
    result_in_use: Option<bool>,
    /// The gate's statistics; `null` without a gate.
    gate: Option<Gate>,
    control_loop: ControlLoop,
    #[serde(with = "Counters")]
    link: protocol::Counters,
}

#[derive(Debug, Serialize)]
struct Gate {
    taken: u64,
    /// Those of the taken samples that could not be tested.
    untested: u64,
    rejected: u64,
    /// The alarm in words, or `null`.
    alarm: Option<String>,
}

/// Counters of what the controller has received since it started.
#[derive(Serialize)]
#[serde(remote = "protocol::Counters")]
struct Counters {
    received: u32,
    damaged: u32,
    unknown_version: u32,
    unknown_request: u32,
    repeated: u32,
    lost: u32,
    refused: u32,
    overrun: u32,
}

impl Status {
    /// The status as received from the controller.
    pub(crate) fn new<T: Number>(
        status: &protocol::Status<T>,
        parameters: &protocol::Parameters<T>,
        counters: &protocol::Counters,
    ) -> Self {
        Self {
            session: status.session,
            phase: phase(&status.phase),
            origin: origin(parameters.origin),
            result_in_use: match &status.phase {
                Phase::Solved { fingerprint, .. } => {
                    Some(*fingerprint == parameters.geometry.fingerprint())
                }
                _ => None,
            },
            gate: status.gate.map(|gate| Gate {
                taken: gate.taken,
                untested: gate.untested,
                rejected: gate.rejected,
                alarm: gate.alarm.as_ref().map(ToString::to_string),
            }),
            control_loop: ControlLoop::new(&status.control),
            link: *counters,
        }
    }

    pub(crate) fn text(&self) -> String {
        let (control, link) = (&self.control_loop, &self.link);
        let result = match self.result_in_use {
            None => "",
            Some(true) => "; the result is in use",
            Some(false) => "; the result is not in use",
        };
        let mut state = Section::new("")
            .text(format!(
                "Parameters in use: {} (fingerprint {})",
                self.origin, control.fingerprint
            ))
            .text(format!("Calibration: {}{result}", self.phase));
        if let Some(gate) = &self.gate {
            let [taken, untested, rejected] = [gate.taken, gate.untested, gate.rejected];
            state = state.text(format!(
                "Gate: {taken} samples taken ({untested} untested), {rejected} rejected"
            ));
            state = gate
                .alarm
                .iter()
                .fold(state, |state, alarm| state.text(format!("Alarm: {alarm}")));
        }
        let [x, y, z] = control.point_mm;
        let [q1, q2, q3] = control.joints_deg;
        let calibrating = microseconds(control.longest_turn_calibrating_us);
        let turns = rows(
            "Control loop since the start",
            [
                ("turns", &control.turns),
                ("late or left out", &control.late),
                ("point out of reach", &control.unreachable),
                ("longest turn", &microseconds(control.longest_turn_us)),
                ("longest turn while calibrating", &calibrating),
                ("switches to other parameters", &control.switches),
            ],
        )
        .text(format!("platform at {x:.3}, {y:.3}, {z:.3} mm"))
        .text(format!("joints at {q1:.3}, {q2:.3}, {q3:.3} deg"));
        let frames = rows(
            "Link since the start",
            [
                ("frames received", &link.received),
                ("damaged", &link.damaged),
                ("repeated", &link.repeated),
                ("lost", &link.lost),
                ("of an unknown version", &link.unknown_version),
                ("unknown requests", &link.unknown_request),
                ("refused requests", &link.refused),
                ("bytes lost in the UART", &link.overrun),
            ],
        );
        terminal::text([state, turns, frames])
    }
}

/// A calibration done by the controller.
#[derive(Debug, Serialize)]
#[expect(
    clippy::struct_field_names,
    reason = "the names are the keys of the JSON"
)]
pub(crate) struct Calibration<'a> {
    /// The report of `delta-cal calibrate` on the same files.
    pub(crate) calibration: &'a Calibrated,
    /// Rms difference between the positions of the controller's result and of this computer's, at the samples.
    pub(crate) difference_mm: f64,
    /// Fingerprint of the controller's result.
    pub(crate) fingerprint: String,
    pub(crate) applied: bool,
    /// During the calibration.
    pub(crate) control_loop: ControlLoop,
    pub(crate) repeated_requests: u32,
}

impl Calibration<'_> {
    pub(crate) fn text(&self) -> String {
        let control = &self.control_loop;
        let turns = rows(
            "Control loop while the controller calibrated",
            [
                ("turns", &control.turns),
                ("late or left out", &control.late),
                (
                    "longest turn",
                    &microseconds(control.longest_turn_calibrating_us),
                ),
                ("requests lost and repeated", &self.repeated_requests),
            ],
        );
        let fingerprint = &self.fingerprint;
        let applied = if self.applied {
            format!(
                "Applied: the control loop uses the new parameters (fingerprint {fingerprint}).\n\
                 Undo: delta-cal device --port PORT revert\n"
            )
        } else {
            format!(
                "Not applied (fingerprint {fingerprint}). Apply: the same command with --apply\n"
            )
        };
        format!(
            "\n{}\n{turns}\nThe controller's positions differ by {} mm rms from those of the report above.\n{applied}",
            self.calibration.to_text(),
            small(self.difference_mm)
        )
    }
}

/// Numbers by name.
type Numbers = BTreeMap<&'static str, f64>;

/// A geometry of the controller.
#[derive(Debug, Serialize)]
pub(crate) struct Parameters {
    set: &'static str,
    /// The origin, in words.
    origin: &'static str,
    fingerprint: String,
    arms: [Numbers; 3],
    /// The transmission errors (gear and encoder) of each joint; `null` if there are none.
    transmissions: Option<[Numbers; 3]>,
}

impl Parameters {
    /// The parameters as received from the controller.
    pub(crate) fn new<T: Number>(set: &'static str, parameters: &protocol::Parameters<T>) -> Self {
        let arm = |values: [T; 8]| {
            let named = Parameter::ROTARY.into_iter().zip(values);
            let named = named.map(|(own, value)| (own.symbol(), in_unit(own, value.to_f64())));
            named.collect()
        };
        let transmission = |[gain, harmonics @ ..]: [T; 5]| {
            let [cos, sin, cos2, sin2] = harmonics.map(|own| own.to_f64().to_degrees());
            Numbers::from([
                ("gain", gain.to_f64()),
                ("cos_deg", cos),
                ("sin_deg", sin),
                ("cos2_deg", cos2),
                ("sin2_deg", sin2),
            ])
        };
        let geometry = &parameters.geometry;
        Self {
            set,
            origin: origin(parameters.origin),
            fingerprint: hexadecimal(geometry.fingerprint()),
            arms: geometry.arms.map(arm),
            transmissions: geometry.transmissions.map(|all| all.map(transmission)),
        }
    }

    /// The change from the parameters in use before.
    pub(crate) fn changed_from(&self, before: &Self) -> String {
        let [from, to] =
            [before, self].map(|own| format!("{} (fingerprint {})", own.origin, own.fingerprint));
        if from == to {
            format!("Parameters in use: {to}, unchanged\n")
        } else {
            format!("Parameters before: {from}\nParameters in use: {to}\n")
        }
    }
}
