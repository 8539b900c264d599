//! Reports of a controller, as text and JSON. Lengths in millimetres, angles in degrees.

use super::Number;
use crate::calibration::Report as Calibrated;
use crate::render::{Section, Table};
use crate::report::Versioned;
use crate::text::{in_unit, small};
use delta_cal::{Parameter, Real};
use delta_cal_protocol as protocol;
use delta_cal_protocol::{Geometry, Identity, Origin, Phase, Scalar};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::{self, Display, Write};

/// Version of the JSON schema.
const SCHEMA_VERSION: u32 = 2;
const ARM_LIMITED: u32 = 0x41;

/// A report on the controller at a port: the header common to all reports, then `contents`.
#[derive(Debug, Serialize)]
pub struct Report<C> {
    port: String,
    device: Device,
    #[serde(flatten)]
    contents: C,
}

/// The controller's identity.
#[derive(Debug, Serialize)]
struct Device {
    firmware: String,
    scalar: &'static str,
    /// Its name, or its CPUID.
    processor: String,
    nominal_fingerprint: String,
}

impl<C: Serialize + Display> Report<C> {
    /// A report on a controller.
    pub fn new(port: &impl Display, identity: &Identity, contents: C) -> Self {
        let [major, minor, patch] = identity.firmware;
        Self {
            port: port.to_string(),
            device: Device {
                firmware: format!("{major}.{minor}.{patch}"),
                scalar: match identity.scalar {
                    Scalar::Single => "f32",
                    Scalar::Double => "f64",
                },
                processor: processor(identity.processor),
                nominal_fingerprint: hexadecimal(identity.nominal),
            },
            contents,
        }
    }

    /// The report as JSON.
    pub fn json(&self) -> String {
        crate::report::json(&Versioned::new(SCHEMA_VERSION, self))
    }

    /// The report as text.
    pub fn text(&self) -> String {
        let own = &self.device;
        format!(
            "Controller on {}: {}, firmware {}, computes in {}\n{}",
            self.port, own.processor, own.firmware, own.scalar, self.contents
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
pub fn hexadecimal(fingerprint: u32) -> String {
    format!("{fingerprint:08x}")
}

/// The origin of parameters, in words.
pub const fn origin(origin: Origin) -> &'static str {
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
pub struct ControlLoop {
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
    fn new<T: Number>(control: &protocol::ControlLoop<T>) -> Self {
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
pub struct Status {
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
    pub fn new<T: Number>(
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
}

impl Display for Status {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (control, link) = (&self.control_loop, &self.link);
        writeln!(
            formatter,
            "Parameters in use: {} (fingerprint {})",
            self.origin, control.fingerprint
        )?;
        let result = match self.result_in_use {
            None => "",
            Some(true) => "; the result is in use",
            Some(false) => "; the result is not in use",
        };
        writeln!(formatter, "Calibration: {}{result}", self.phase)?;
        if let Some(gate) = &self.gate {
            writeln!(
                formatter,
                "Gate: {} samples taken ({} untested), {} rejected",
                gate.taken, gate.untested, gate.rejected
            )?;
            if let Some(alarm) = &gate.alarm {
                writeln!(formatter, "Alarm: {alarm}")?;
            }
        }
        let [x, y, z] = control.point_mm;
        let [q1, q2, q3] = control.joints_deg;
        let turns = rows(
            "Control loop since the start",
            [
                ("turns", &control.turns),
                ("late or left out", &control.late),
                ("point out of reach", &control.unreachable),
                ("longest turn", &microseconds(control.longest_turn_us)),
                (
                    "longest turn while calibrating",
                    &microseconds(control.longest_turn_calibrating_us),
                ),
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
        write!(formatter, "\n{turns}\n{frames}")
    }
}

/// A calibration done by the controller.
#[derive(Debug, Serialize)]
#[expect(
    clippy::struct_field_names,
    reason = "the names are the keys of the JSON"
)]
pub struct Calibration<'a> {
    /// The report of `delta-cal calibrate` on the same files.
    calibration: &'a Calibrated,
    /// Rms difference between the positions of the controller's result and of this computer's, at the samples.
    difference_mm: f64,
    /// Fingerprint of the controller's result.
    fingerprint: String,
    applied: bool,
    control_loop: ControlLoop,
    repeated_requests: u32,
}

impl<'a> Calibration<'a> {
    /// `here`: this computer's calibration from the same samples. `there`: the controller's result, and its control
    /// loop during the calibration.
    pub fn new<T: Number>(
        here: &'a Calibrated,
        difference_mm: f64,
        (geometry, control): (&Geometry<T>, &protocol::ControlLoop<T>),
        applied: bool,
        repeated_requests: u32,
    ) -> Self {
        Self {
            calibration: here,
            difference_mm,
            fingerprint: hexadecimal(geometry.fingerprint()),
            applied,
            control_loop: ControlLoop::new(control),
            repeated_requests,
        }
    }
}

impl Display for Calibration<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
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
        write!(formatter, "\n{}\n{turns}", self.calibration.to_text())?;
        writeln!(
            formatter,
            "\nThe controller's positions differ by {} mm rms from those of the report above.",
            small(self.difference_mm)
        )?;
        let fingerprint = &self.fingerprint;
        if self.applied {
            writeln!(
                formatter,
                "Applied: the control loop uses the new parameters (fingerprint {fingerprint}).\n\
                 Undo: delta-cal device --port PORT revert"
            )
        } else {
            writeln!(
                formatter,
                "Not applied (fingerprint {fingerprint}). Apply: the same command with --apply"
            )
        }
    }
}

/// Numbers by name.
type Numbers = BTreeMap<&'static str, f64>;

/// A geometry of the controller.
#[derive(Debug, Serialize)]
pub struct Parameters {
    set: &'static str,
    /// The origin, in words.
    origin: &'static str,
    fingerprint: String,
    arms: [Numbers; 3],
    /// The transmission errors (gear and encoder) of each joint; `null` if there are none.
    transmissions: Option<[Numbers; 3]>,
    /// The change, in words.
    #[serde(skip)]
    change: String,
}

impl Parameters {
    /// The parameters as received from the controller.
    pub fn new<T: Number>(set: &'static str, parameters: &protocol::Parameters<T>) -> Self {
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
            change: String::new(),
        }
    }

    /// The current parameters, compared with those in use before.
    pub fn changed<T: Number>(
        before: &protocol::Parameters<T>,
        after: &protocol::Parameters<T>,
    ) -> Self {
        let [before, mut after] = [before, after].map(|own| Self::new("current", own));
        let [from, to] = [&before, &after]
            .map(|own| format!("{} (fingerprint {})", own.origin, own.fingerprint));
        after.change = if from == to {
            format!("Parameters in use: {to}, unchanged\n")
        } else {
            format!("Parameters before: {from}\nParameters in use: {to}\n")
        };
        after
    }

    /// Adds a remark on the change.
    pub fn note(mut self, note: impl Display) -> Self {
        let _ = writeln!(self.change, "{note}");
        self
    }
}

impl Display for Parameters {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.change)
    }
}
