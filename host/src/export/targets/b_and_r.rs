//! B&R mapp Motion.

use crate::export::error::ExportError;
use crate::export::geometry::{ARMS, Each, Holds};
use crate::export::target::{AXES, Content, Entry, Fitted, Target, Written, decimals};
use crate::files::convention::Vertical;
use delta_cal::robot::Drive;
use std::fmt::Write;

/// `Delta/3AxesDeltaA`.
pub(crate) const B_AND_R: Target = Target {
    name: "b-and-r",
    title: "B&R mapp Motion, Delta/3AxesDeltaA",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: Holds {
            radii: Each::Arm,
            from_base_plane: true,
            ..ARMS
        },
        write,
    },
    comment: "#",
    conventions: &[
        "to be confirmed on the machine: joints Q1, Q2 and Q3 are arms 1, 2 and 3",
        "to be confirmed on the machine: with count direction Standard a joint angle is 0 with the upper arm level and positive \
         with the elbow down; an offset is subtracted from the angle of the robot file",
        "z = 0 is the plane of the motors; only the difference of the base and platform radii matters",
        "TranslationToFlange is [target] of the robot file",
    ],
    source: "names of a mechanical system file (Config_3.mechanicalsystem of a published project); the controller's source is \
             not public, so the signs are not verified",
    alternative: "a correction table (--for correction-table)",
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let platform = fitted.platform_radius;
    let up = fitted.convention.joint_positive == Vertical::Up;
    let arms = || (1..).zip(&fitted.geometry.arms);
    let mut entries = Vec::new();
    for (number, arm) in arms() {
        let base = format!("BasePlatform.Arm{number}LinkPoint");
        entries.extend([
            Entry::azimuth(format!("{base}.Angle"), arm.azimuth),
            Entry::length(format!("{base}.Radius"), arm.radius + platform),
            Entry::length(format!("{base}.Z"), arm.height),
        ]);
    }
    for (number, arm) in arms() {
        let own = format!("Arms.Arm{number}");
        entries.extend([
            Entry::length(format!("{own}.UpperArmLength"), arm.upper),
            Entry::length(format!("{own}.LowerArmLength"), arm.lower),
        ]);
    }
    for (number, _) in arms() {
        let end = format!("EndEffectorPlatform.Arm{number}LinkPoint");
        entries.extend([
            Entry::length(format!("{end}.Radius"), platform),
            Entry::length(format!("{end}.Z"), 0.0),
        ]);
    }
    let flange = fitted.target.unwrap_or_default();
    for (axis, value) in AXES.into_iter().zip(flange.iter()) {
        let name = format!("EndEffectorPlatform.TranslationToFlange.{axis}");
        entries.push(Entry::length(name, *value));
    }
    entries.extend(arms().map(|(number, arm)| {
        let zero = if up { -arm.zero } else { arm.zero };
        Entry::degrees(format!("Offsets.JointAxis[{number}]"), zero)
    }));
    let mut lines = String::new();
    for Entry { name, value, unit } in &entries {
        let _ = writeln!(lines, "{name} = {} {unit}", decimals(*value));
    }
    let direction = if up { "Inverse" } else { "Standard" };
    for number in 1..=3 {
        let _ = writeln!(lines, "CountDirections.JointAxis[{number}] = {direction}");
    }
    Ok(Written {
        entries,
        lines,
        warnings: vec![
            "Confirm the signs on the machine: enter the values in the mechanical system of your Automation Studio \
             project, move to three positions and compare the joint angles."
                .to_owned(),
        ],
    })
}
