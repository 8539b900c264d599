//! The reports for programs. Lengths in millimetres, angles in degrees; `null` where a figure is
//! unknown.

use super::{firmware, microseconds, origin, phase, processor, result_in_use, scalar};
use crate::device::{Comparison, Number, Pace};
use crate::render::json;
use crate::report::calibration::json::{SCHEMA_VERSION, transmission};
use crate::text::units::degrees;
use delta_cal::robot::ParameterKind;
use delta_cal::{Parameter, Real};
use delta_cal_protocol::{ControlLoop, Counters, Identity, Parameters, Status};
use serde_json::{Map, Value, json};

/// A report of the controller at this port: `contents`, an object, after what all have in common.
pub fn of_device(port: &str, identity: &Identity, contents: Value) -> Value {
    let mut common = json!({
        // As it was given.
        "port": port,
        "device": {
            "firmware": firmware(identity),
            // `f32` or `f64`.
            "scalar": scalar(identity),
            // Its name, or its CPUID.
            "processor": processor(identity.processor),
            // Of the nominal geometry.
            "nominal_fingerprint": hexadecimal(identity.nominal),
        },
    });
    if let (Some(common), Value::Object(contents)) = (common.as_object_mut(), contents) {
        common.extend(contents);
    }
    json::report(SCHEMA_VERSION, common)
}

/// What a calibration did to the control loop, and what became of it.
#[derive(Debug, Clone)]
pub struct Calibration<'a, T> {
    /// As `delta-cal calibrate --json` writes it. Of positions `before` is the controller's current geometry and the
    /// robot file the controller.
    pub report: Value,
    /// Of the result.
    pub fingerprint: u32,
    /// Whether the control loop uses the result.
    pub applied: bool,
    /// The control loop before and after.
    pub control: [&'a ControlLoop<T>; 2],
    /// Of an emulated controller.
    pub pace: Option<Pace>,
    /// Requests that were sent again because something was lost on the link.
    pub repeated_requests: u32,
}

/// A calibration.
pub fn calibration<T: Number>(calibration: &Calibration<'_, T>) -> Value {
    let [before, after] = calibration.control;
    // What is counted since the controller started is counted from `before` on.
    let between = ControlLoop {
        turns: after.turns.wrapping_sub(before.turns),
        late: after.late.wrapping_sub(before.late),
        unreachable: after.unreachable.wrapping_sub(before.unreachable),
        ..*after
    };
    json!({
        // As `delta-cal calibrate --json` writes it.
        "calibration": calibration.report,
        "fingerprint": hexadecimal(calibration.fingerprint),
        "applied": calibration.applied,
        // While it was calibrated.
        "control_loop": control_loop(&between, calibration.pace),
        "repeated_requests": calibration.repeated_requests,
    })
}

fn control_loop<T: Number>(control: &ControlLoop<T>, pace: Option<Pace>) -> Value {
    let time = |ticks| microseconds(ticks, control.ticks_a_second);
    // Not cycles; of an emulated controller only.
    let instructions =
        |ticks| pace.and_then(|pace| pace.instructions(ticks, control.ticks_a_second));
    json!({
        // Since the controller started, or while it was calibrated, as the next two.
        "turns": control.turns,
        // Turns that began late or were left out.
        "late": control.late,
        // Turns whose point could not be reached.
        "unreachable": control.unreachable,
        // Since the controller started.
        "longest_turn_us": time(control.longest_ticks),
        // While a calibration was at work.
        "longest_turn_calibrating_us": time(control.longest_ticks_calibrating),
        "longest_turn_instructions": instructions(control.longest_ticks),
        "longest_turn_calibrating_instructions": instructions(control.longest_ticks_calibrating),
        // How often the loop took other parameters since the controller started.
        "switches": control.switches,
        // Of the parameters in use.
        "fingerprint": hexadecimal(control.fingerprint),
        // The last point of the path, and the joint angles for it.
        "point_mm": control.point.map(Real::to_f64),
        "joints_deg": control.joints.map(|q| degrees(q.to_f64())),
    })
}

/// What the controller is doing.
pub fn status<T: Number>(
    status: &Status<T>,
    parameters: &Parameters<T>,
    counters: &Counters,
    pace: Option<Pace>,
) -> Value {
    json!({
        // The open one, 0 without one.
        "session": status.session,
        // These two in words.
        "phase": phase(&status.phase),
        "origin": origin(parameters.origin),
        // Whether the result of the last calibration is in use; `null` without a result.
        "result_in_use": result_in_use(&status.phase, parameters),
        // What the gate has done with the samples; `null` without one.
        "gate": status.gate.map(|gate| json!({
            "taken": gate.counts.taken,
            // Of them, those that could not be tested.
            "untested": gate.counts.untested,
            "rejected": gate.counts.rejected,
            "rejected_by_arm": gate.counts.rejected_by_arm,
            "longest_run": gate.counts.longest_run,
            // In words; `null` without one.
            "alarm": gate.alarm.map(|alarm| alarm.to_string()),
        })),
        // Since the controller started.
        "control_loop": control_loop(&status.control, pace),
        // What it has received since it started.
        "link": {
            "received": counters.received,
            "damaged": counters.damaged,
            "unknown_version": counters.unknown_version,
            "unknown_request": counters.unknown_request,
            "repeated": counters.repeated,
            "lost": counters.lost,
            "refused": counters.refused,
            "overrun": counters.overrun,
        },
    })
}

/// A geometry: `set` is `current` or `nominal`.
pub fn geometry<T: Number>(set: &str, parameters: &Parameters<T>) -> Value {
    let arm = |values: &[T; 8]| {
        let named = Parameter::ROTARY.into_iter().zip(values);
        let named = named.map(|(parameter, value)| {
            let value = match parameter.kind() {
                ParameterKind::Length | ParameterKind::Ratio => value.to_f64(),
                ParameterKind::Angle => degrees(value.to_f64()),
            };
            (parameter.symbol().to_owned(), json!(value))
        });
        named.collect::<Map<_, _>>()
    };
    json!({
        "set": set,
        // Where it comes from, in words.
        "origin": origin(parameters.origin),
        "fingerprint": hexadecimal(parameters.geometry.fingerprint()),
        // Three arms of eight parameters by their symbols: mm and degrees.
        "arms": parameters.geometry.arms.iter().map(arm).collect::<Vec<_>>(),
        // What the gear and encoder of each joint do beside turning its arm; `null` if nothing.
        "transmissions": parameters.geometry.transmissions.map(|all| {
            all.map(|own| transmission(own.map(Real::to_f64)))
        }),
    })
}

/// A comparison of bits.
pub fn comparison(calibrated: bool, sample_count: usize, comparison: &Comparison) -> Value {
    let differences = comparison.differences.iter().map(|difference| {
        json!({
            "figure": difference.figure,
            "device": difference.device,
            "host": difference.here,
        })
    });
    json!({
        // Whether the controller calibrated the robot; otherwise it refused.
        "calibrated": calibrated,
        "sample_count": sample_count,
        // How many were compared.
        "figures": comparison.figures,
        // Those that are not the same on both sides.
        "differences": differences.collect::<Vec<_>>(),
    })
}

/// A fingerprint as text.
pub fn hexadecimal(fingerprint: u32) -> String {
    format!("{fingerprint:08x}")
}
