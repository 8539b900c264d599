//! The reports for programs. Lengths in millimetres, angles in degrees; `null` where a figure is
//! unknown.

use super::{firmware, microseconds, origin, phase, processor, result_in_use, scalar};
use crate::device::{Comparison, Number, Pace};
use crate::report::json::{JsonReport, SCHEMA_VERSION};
use crate::units::degrees;
use delta_cal::{Parameter, ParameterKind, Real};
use delta_cal_protocol::{ControlLoop, Counters, Identity, Parameters, Status};
use serde::Serialize;
use std::collections::BTreeMap;

/// Any report, with what all have in common.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonDeviceReport<R> {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The program's version.
    pub program_version: &'static str,
    /// The port as it was given.
    pub port: String,
    /// Who is there.
    pub device: JsonIdentity,
    /// What was asked for.
    #[serde(flatten)]
    pub report: R,
}

/// Who is there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonIdentity {
    /// Version of the firmware.
    pub firmware: String,
    /// `f32` or `f64`.
    pub scalar: &'static str,
    /// The processor's name, or its CPUID.
    pub processor: String,
    /// Fingerprint of the nominal geometry.
    pub nominal_fingerprint: String,
}

/// A calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonCalibration {
    /// The report as `delta-cal calibrate --json` writes it; `before` is the controller's current
    /// geometry, `robot_file` the controller.
    pub calibration: JsonReport,
    /// Fingerprint of the result.
    pub fingerprint: String,
    /// Whether the control loop uses the result.
    pub applied: bool,
    /// The control loop while it was calibrated.
    pub control_loop: JsonControlLoop,
    /// Requests that were sent again because something was lost on the link.
    pub repeated_requests: u32,
}

/// The control loop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonControlLoop {
    /// Turns: since the controller started, or while it was calibrated.
    pub turns: u32,
    /// Turns that began late or were left out.
    pub late: u32,
    /// Turns whose point could not be reached.
    pub unreachable: u32,
    /// The longest turn since the controller started.
    pub longest_turn_us: Option<f64>,
    /// The longest turn while a calibration was at work.
    pub longest_turn_calibrating_us: Option<f64>,
    /// The same two in instructions (not cycles), of an emulated controller.
    pub longest_turn_instructions: Option<u64>,
    /// See [`longest_turn_instructions`](Self::longest_turn_instructions).
    pub longest_turn_calibrating_instructions: Option<u64>,
    /// How often the loop switched to other parameters since the controller started.
    pub switches: u32,
    /// Fingerprint of the parameters in use.
    pub fingerprint: String,
    /// The last point of the path.
    pub point_mm: [f64; 3],
    /// The joint angles for it.
    pub joints_deg: [f64; 3],
}

impl JsonControlLoop {
    /// The loop since the controller started.
    pub fn new<T: Number>(control: &ControlLoop<T>, pace: Option<Pace>) -> Self {
        let instructions =
            |ticks| pace.and_then(|pace| pace.instructions(ticks, control.ticks_a_second));
        Self {
            longest_turn_instructions: instructions(control.longest_ticks),
            longest_turn_calibrating_instructions: instructions(control.longest_ticks_calibrating),
            turns: control.turns,
            late: control.late,
            unreachable: control.unreachable,
            longest_turn_us: microseconds(control.longest_ticks, control.ticks_a_second),
            longest_turn_calibrating_us: microseconds(
                control.longest_ticks_calibrating,
                control.ticks_a_second,
            ),
            switches: control.switches,
            fingerprint: hexadecimal(control.fingerprint),
            point_mm: control.point.map(Real::to_f64),
            joints_deg: control.joints.map(|q| degrees(q.to_f64())),
        }
    }

    /// The loop between two looks.
    pub fn between<T: Number>(
        before: &ControlLoop<T>,
        after: &ControlLoop<T>,
        pace: Option<Pace>,
    ) -> Self {
        Self {
            turns: after.turns.wrapping_sub(before.turns),
            late: after.late.wrapping_sub(before.late),
            unreachable: after.unreachable.wrapping_sub(before.unreachable),
            ..Self::new(after, pace)
        }
    }
}

/// What the controller is doing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonStatus {
    /// The open session, 0 without one.
    pub session: u32,
    /// In words.
    pub phase: String,
    /// Whether the result of the last calibration is in use; `null` without a result.
    pub result_in_use: Option<bool>,
    /// Where the parameters in use come from, in words.
    pub origin: &'static str,
    /// The control loop since the controller started.
    pub control_loop: JsonControlLoop,
    /// What it has received since it started.
    pub link: JsonCounters,
}

impl JsonStatus {
    /// From the controller's three answers.
    pub fn new<T: Number>(
        status: &Status<T>,
        parameters: &Parameters<T>,
        counters: &Counters,
        pace: Option<Pace>,
    ) -> Self {
        Self {
            session: status.session,
            phase: phase(&status.phase),
            result_in_use: result_in_use(&status.phase, parameters),
            origin: origin(parameters.origin),
            control_loop: JsonControlLoop::new(&status.control, pace),
            link: JsonCounters {
                received: counters.received,
                damaged: counters.damaged,
                unknown_version: counters.unknown_version,
                unknown_request: counters.unknown_request,
                repeated: counters.repeated,
                lost: counters.lost,
                refused: counters.refused,
                overrun: counters.overrun,
            },
        }
    }
}

/// See [`Counters`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[allow(missing_docs)] // the names are those of `Counters`
pub struct JsonCounters {
    pub received: u32,
    pub damaged: u32,
    pub unknown_version: u32,
    pub unknown_request: u32,
    pub repeated: u32,
    pub lost: u32,
    pub refused: u32,
    pub overrun: u32,
}

/// A geometry.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonParameters {
    /// `current` or `nominal`.
    pub set: &'static str,
    /// Where it comes from, in words.
    pub origin: &'static str,
    /// Its fingerprint.
    pub fingerprint: String,
    /// Three arms of eight parameters by their symbols: mm and degrees.
    pub arms: Vec<BTreeMap<&'static str, f64>>,
}

impl JsonParameters {
    /// A geometry.
    pub fn new<T: Number>(set: &'static str, parameters: &Parameters<T>) -> Self {
        let arm = |values: &[T; 8]| {
            let named = Parameter::ALL.into_iter().zip(values);
            named
                .map(|(parameter, value)| match parameter.kind() {
                    ParameterKind::Length => (parameter.symbol(), value.to_f64()),
                    ParameterKind::Angle => (parameter.symbol(), degrees(value.to_f64())),
                })
                .collect()
        };
        Self {
            set,
            origin: origin(parameters.origin),
            fingerprint: hexadecimal(delta_cal_protocol::fingerprint(&parameters.arms)),
            arms: parameters.arms.iter().map(arm).collect(),
        }
    }
}

/// A comparison of bits.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct JsonComparison {
    /// Whether the controller calibrated the robot; otherwise it refused.
    pub calibrated: bool,
    /// Samples.
    pub sample_count: usize,
    /// Figures that were compared.
    pub figures: usize,
    /// Those that differ.
    pub differences: Vec<JsonDifference>,
}

/// A figure that is not the same on both sides.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct JsonDifference {
    /// Which.
    pub figure: String,
    /// What the controller has.
    pub device: String,
    /// What comes out on the host.
    pub host: String,
}

impl JsonComparison {
    /// A comparison.
    pub fn new(calibrated: bool, sample_count: usize, comparison: &Comparison) -> Self {
        Self {
            calibrated,
            sample_count,
            figures: comparison.figures,
            differences: comparison
                .differences
                .iter()
                .map(|difference| JsonDifference {
                    figure: difference.figure.clone(),
                    device: difference.device.clone(),
                    host: difference.here.clone(),
                })
                .collect(),
        }
    }
}

/// A fingerprint as text.
pub fn hexadecimal(fingerprint: u32) -> String {
    format!("{fingerprint:08x}")
}

impl<R: Serialize> JsonDeviceReport<R> {
    /// A report of the controller at this port.
    pub fn new(port: String, identity: &Identity, report: R) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION"),
            port,
            device: JsonIdentity {
                firmware: firmware(identity),
                scalar: scalar(identity),
                processor: processor(identity.processor),
                nominal_fingerprint: hexadecimal(identity.nominal),
            },
            report,
        }
    }

    /// As text, indented, ending in a new line.
    ///
    /// # Errors
    /// None is known; the serialiser's, if it had one.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}
