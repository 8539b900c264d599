//! B&R mapp Motion.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::target::{Content, Entry, Fitted, Target, Written, decimals};
use delta_cal::robot::Drive;
use std::fmt::Write;

/// `Delta/3AxesDeltaA`.
pub(crate) const B_AND_R: Target = Target {
    name: "b-and-r",
    title: "B&R mapp Motion, Delta/3AxesDeltaA",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: Holds {
            fixed_azimuths: None,
            radii: Each::Arm,
            heights: Each::Arm,
            upper: Each::Arm,
            lower: Each::Arm,
            zeros: Each::Arm,
        },
        write,
    },
    comment: "#",
    conventions: &[
        "to be confirmed on the machine: joints Q1, Q2 and Q3 are arms 1, 2 and 3",
        "to be confirmed on the machine: a joint angle is positive with the elbow down, and 0 with the upper arm \
         level; JointOffset is subtracted from the angle of the robot file",
        "to be confirmed on the machine: Radius is the base's, and the platform's is stated beside it; only their \
         difference counts",
    ],
    source: "the controller's documentation; its source is not public, so nothing here is verified against it",
    alternative: "a correction table (--for correction-table)",
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let platform = fitted.platform_radius;
    let mut entries = Vec::new();
    for (number, arm) in (1..).zip(&fitted.geometry.arms) {
        entries.extend([
            Entry::azimuth(format!("Arm{number}.Angle"), arm.azimuth),
            Entry::length(format!("Arm{number}.Radius"), arm.radius + platform),
            Entry::length(format!("Arm{number}.Z"), arm.height),
            Entry::length(format!("Arm{number}.UpperArm"), arm.upper),
            Entry::length(format!("Arm{number}.LowerArm"), arm.lower),
            Entry::degrees(format!("Arm{number}.JointOffset"), arm.zero),
        ]);
    }
    entries.extend([
        Entry::length("Platform.Radius", platform),
        Entry::length("Platform.Z", 0.0),
    ]);
    let mut lines = String::new();
    for Entry { name, value, unit } in &entries {
        let _ = writeln!(lines, "{name} = {} {unit}", decimals(*value));
    }
    Ok(Written {
        entries,
        lines,
        warnings: vec![
            "Confirm names and signs on the machine: enter the values in the mechanical system of your Automation \
             Studio project, move to three positions and compare the joint angles."
                .to_owned(),
        ],
    })
}
