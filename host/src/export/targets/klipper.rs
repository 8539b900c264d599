//! Klipper.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::shape::ArmShape;
use crate::export::target::{Entry, Fitted, Target, Written, assumed_home, decimals};
use delta_cal::ArmIndex;
use std::fmt::Write;

/// `[printer] kinematics: rotary_delta`.
pub(crate) const KLIPPER: Target = Target {
    name: "klipper",
    title: "Klipper rotary_delta",
    holds: Holds {
        fixed_azimuths: None,
        radii: Each::Shared,
        heights: Each::Shared,
        upper: Each::Arm,
        lower: Each::Arm,
        zeros: Each::Arm,
    },
    comment: "#",
    conventions: &[
        "stepper_a, stepper_b and stepper_c are arms 1, 2 and 3",
        "the joint angle is 0 with the upper arm horizontal and positive with the elbow up: it is \
         φ − q of the robot file's angle q, with φ contained in position_endstop",
        "shoulder_radius is the base's radius less the platform's",
        "position_endstop is the height of the nozzle at x = y = 0 with that arm at its end stop; each is \
         computed from the joint angle at the end stop (--home-deg)",
    ],
    source: "klippy/kinematics/rotary_delta.py and klippy/chelper/kin_rotary_delta.c of Klipper",
    alternative: "a kinematics class of your own with all 24 parameters (in Klipper a Python class with a C function)",
    write,
};

/// The height of the platform on the z axis with the upper arm at an angle above horizontal, mm. `None` where it
/// has none, or where Klipper would find the arm on the other side of its line with the forearm: it takes
/// the elbow that is further out.
fn height_on_the_axis(arm: &ArmShape, angle: f64) -> Option<f64> {
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

fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let [first, ..] = fitted.geometry.by_motor();
    if !(first.radius > 0.0) {
        let cause = format!(
            "the motor axis stands {:.3} mm from the middle, the platform's radius taken off, and Klipper takes only a \
             shoulder_radius above 0",
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
    let mut lines = format!(
        "[printer]\nkinematics: rotary_delta\nshoulder_radius: {}\nshoulder_height: {}\n",
        decimals(first.radius),
        decimals(first.height)
    );
    for (index, letter) in ArmIndex::ALL.into_iter().zip(["a", "b", "c"]) {
        let arm = &fitted.geometry.arms[index.index()];
        let home = fitted.home[index.index()];
        let Some(endstop) = height_on_the_axis(arm, arm.zero - home) else {
            let cause = format!(
                "with its end stop at a joint angle of {:.3}°, Klipper's position_endstop has no value: on the z axis \
                 the elbow would not stand outwards there",
                home.to_degrees()
            );
            return Err(ExportError::Home { arm: index, cause });
        };
        let name = |key: &str| format!("stepper_{letter} {key}");
        let azimuth = arm.azimuth.to_degrees().rem_euclid(360.0);
        entries.extend([
            Entry {
                name: name("angle"),
                value: azimuth,
                unit: "deg",
            },
            Entry::length(name("upper_arm_length"), arm.upper),
            Entry::length(name("lower_arm_length"), arm.lower),
            Entry::length(name("position_endstop"), endstop),
        ]);
        let _ = write!(
            lines,
            "\n[stepper_{letter}]\nangle: {}\nupper_arm_length: {}\nlower_arm_length: {}\n\
             position_endstop: {endstop:.6}\n",
            decimals(azimuth),
            decimals(arm.upper),
            decimals(arm.lower),
        );
    }
    let mut warnings: Vec<_> = assumed_home(fitted).into_iter().collect();
    if !(first.height > 0.0) {
        warnings.push("Klipper takes no shoulder_height of 0 or below.".to_owned());
    }
    Ok(Written {
        entries,
        lines,
        warnings,
    })
}
