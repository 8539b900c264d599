//! What a controller says, for people and for programs.

pub mod json;
pub mod text;

use super::Number;
use delta_cal_protocol::{Identity, Origin, Parameters, Phase, Scalar};

const ARM_LIMITED: u32 = 0x41;

/// A processor by its CPUID: "Cortex-M4 r0p1".
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

fn firmware(identity: &Identity) -> String {
    let [major, minor, patch] = identity.firmware;
    format!("{major}.{minor}.{patch}")
}

const fn scalar(identity: &Identity) -> &'static str {
    match identity.scalar {
        Scalar::Single => "f32",
        Scalar::Double => "f64",
    }
}

const fn origin(origin: Origin) -> &'static str {
    match origin {
        Origin::Nominal => "nominal",
        Origin::NominalStoreDamaged => "nominal, because what was stored is damaged",
        Origin::Calibration => "calibrated",
        Origin::CalibrationStoreDamaged => {
            "calibrated; part of the store is damaged, it may be the calibration before the last"
        }
        _ => "unknown",
    }
}

fn phase(phase: &Phase) -> String {
    match phase {
        Phase::Idle => "no calibration since the start".to_owned(),
        Phase::Collecting { samples } => format!("taking in samples, {samples} so far"),
        Phase::Solving { arm: Some(arm) } => format!("solving, {arm}"),
        Phase::Solving { arm: None } => "solving".to_owned(),
        Phase::Solved { samples, .. } => format!("solved, from {samples} samples"),
        Phase::CalibrationRefused { samples, refusal } => {
            format!("refused after {samples} samples: {refusal}")
        }
        _ => "unknown".to_owned(),
    }
}

/// Whether the result that a controller holds is in use; `None` if it holds none.
fn result_in_use<T: Number>(phase: &Phase, parameters: &Parameters<T>) -> Option<bool> {
    match phase {
        Phase::Solved {
            fingerprint: result,
            ..
        } => Some(*result == parameters.geometry.fingerprint()),
        _ => None,
    }
}

/// Microseconds of timer ticks.
fn microseconds(ticks: u32, ticks_a_second: u32) -> Option<f64> {
    (ticks_a_second > 0).then(|| f64::from(ticks) * 1e6 / f64::from(ticks_a_second))
}
