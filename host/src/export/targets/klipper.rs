//! Klipper.

use crate::export::error::ExportError;
use crate::export::geometry::{ARMS, Each, Holds, Shape, TOWERS};
use crate::export::target::{Content, Entry, Fitted, Target, Written};
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;
use std::fmt::Write;

/// `[printer] kinematics: rotary_delta`.
pub(crate) const ROTARY: Target = Target {
    name: "klipper",
    title: "Klipper rotary_delta",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: Holds {
            heights: Each::Shared,
            ..ARMS
        },
        write: rotary,
    },
    comment: "#",
    conventions: &[
        "stepper_a, stepper_b and stepper_c are arms 1, 2 and 3",
        "the joint angle is 0 with the upper arm level and positive with the elbow up: φ − q of the robot file's \
         angle q; position_endstop contains φ",
        "shoulder_radius is the base radius minus the platform radius",
        "position_endstop is the height of the nozzle at x = y = 0 with that arm at its end stop (--home)",
    ],
    source: "klippy/kinematics/rotary_delta.py and klippy/chelper/kin_rotary_delta.c of Klipper",
    alternative: "a kinematics class of your own with all 24 parameters (in Klipper a Python class with a C function)",
};

/// `[printer] kinematics: delta`.
pub(crate) const LINEAR: Target = Target {
    name: "klipper",
    title: "Klipper delta",
    drive: Some(Drive::Linear),
    content: Content::Fitted {
        holds: TOWERS,
        write: linear,
    },
    comment: "#",
    conventions: &[
        "stepper_a, stepper_b and stepper_c are towers 1, 2 and 3",
        "delta_radius is the distance of the towers from the centre minus the platform radius",
        "position_endstop is the height of the nozzle at x = y = 0 with that carriage at its end stop (--home)",
        "delete these options from the SAVE_CONFIG block at the end of the file, or the next SAVE_CONFIG restores the \
         old ones",
    ],
    source: "klippy/kinematics/delta.py of Klipper",
    alternative: super::marlin::ALTERNATIVE,
};

const STEPPERS: [&str; 3] = ["stepper_a", "stepper_b", "stepper_c"];

/// The height of the platform on the z axis with the upper arm at an angle above level, mm. `None` if there is none, or if
/// Klipper, which assumes the outer elbow, would find another arm angle.
fn height_on_the_axis(arm: &Shape, angle: f64) -> Option<f64> {
    let (sin, cos) = angle.sin_cos();
    let out = arm.radius + arm.upper * cos;
    let square = arm.lower * arm.lower - out * out;
    if !(square > 0.0) {
        return None;
    }
    let below = arm.upper * sin - square.sqrt();
    let towards = f64::atan2(below, -arm.radius);
    (cos > (2.0 * towards - angle).cos()).then_some(arm.height + below)
}

/// The entries as options in their sections.
fn sections(entries: &[Entry], first: &str) -> String {
    let mut lines = first.to_owned();
    let mut above = "";
    for Entry { name, value, .. } in entries {
        let (section, option) = name.split_once(' ').unwrap_or(("", name));
        if section != above {
            let _ = write!(lines, "\n[{section}]\n");
            above = section;
        }
        let _ = writeln!(lines, "{option}: {value:.6}");
    }
    lines
}

fn rotary(fitted: &Fitted) -> Result<Written, ExportError> {
    let [first, ..] = &fitted.geometry.arms;
    if !(first.radius > 0.0) {
        let cause = format!(
            "its base radius minus the platform radius is {:.3} mm; Klipper accepts only a shoulder_radius above 0",
            first.radius
        );
        return Err(ExportError::CannotHold {
            arm: ArmIndex::First,
            key: "dx_mm",
            cause,
        });
    }
    let mut entries = vec![
        Entry::length("shoulder_radius", first.radius),
        Entry::length("shoulder_height", first.height),
    ];
    for (index, stepper) in ArmIndex::ALL.into_iter().zip(STEPPERS) {
        let arm = &fitted.geometry.arms[index.index()];
        let home = fitted.home[index.index()];
        let endstop = height_on_the_axis(arm, arm.zero - home).ok_or(ExportError::Home {
            arm: index,
            degrees: home.to_degrees(),
        })?;
        entries.extend([
            Entry::azimuth(format!("{stepper} angle"), arm.azimuth),
            Entry::length(format!("{stepper} upper_arm_length"), arm.upper),
            Entry::length(format!("{stepper} lower_arm_length"), arm.lower),
            Entry::length(format!("{stepper} position_endstop"), endstop),
        ]);
    }
    let mut warnings = fitted.assumptions();
    if !(first.height > 0.0) {
        warnings.push("Klipper accepts only a shoulder_height above 0.".to_owned());
    }
    Ok(Written {
        lines: sections(&entries, "[printer]\nkinematics: rotary_delta\n"),
        entries,
        warnings,
    })
}

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn linear(fitted: &Fitted) -> Result<Written, ExportError> {
    let towers = &fitted.geometry.arms;
    let mut entries = vec![Entry::length("delta_radius", towers[0].radius)];
    for ((tower, stepper), endstop) in towers.iter().zip(STEPPERS).zip(fitted.tower_endstops()) {
        entries.extend([
            Entry::azimuth(format!("{stepper} angle"), tower.azimuth),
            Entry::length(format!("{stepper} arm_length"), tower.lower),
            Entry::length(format!("{stepper} position_endstop"), endstop),
        ]);
    }
    Ok(Written {
        lines: sections(&entries, "[printer]\n"),
        entries,
        warnings: fitted.assumptions(),
    })
}
