//! B&R mapp Motion.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::target::{Entry, Fitted, Target, Written, decimals};
use std::fmt::Write;

/// `Delta/3AxesDeltaA`.
pub(crate) const B_AND_R: Target = Target {
    name: "b-and-r",
    title: "B&R mapp Motion, Delta/3AxesDeltaA",
    holds: Holds {
        fixed_azimuths: None,
        radii: Each::Arm,
        heights: Each::Arm,
        upper: Each::Arm,
        lower: Each::Arm,
        zeros: Each::Arm,
    },
    comment: "#",
    conventions: &[
        "to be confirmed on the machine: joints Q1, Q2 and Q3 are arms 1, 2 and 3",
        "to be confirmed on the machine: a joint angle is positive with the elbow down, and 0 with the upper \
         arm horizontal; JointOffset is what is subtracted from the angle of the robot file",
        "to be confirmed on the machine: Radius is the base's, and the platform's is stated beside it; only \
         their difference counts",
    ],
    source: "the controller's documentation; its source is not public, so nothing here is verified against it",
    alternative: "a correction table (--for correction-table)",
    write,
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let mut entries = Vec::new();
    for (number, arm) in (1..).zip(&fitted.geometry.arms) {
        let name = |key: &str| format!("Arm{number}.{key}");
        entries.extend([
            Entry {
                name: name("Angle"),
                value: arm.azimuth.to_degrees().rem_euclid(360.0),
                unit: "deg",
            },
            Entry::length(name("Radius"), arm.radius + fitted.platform_radius),
            Entry::length(name("Z"), arm.height),
            Entry::length(name("UpperArm"), arm.upper),
            Entry::length(name("LowerArm"), arm.lower),
            Entry::degrees(name("JointOffset"), arm.zero),
        ]);
    }
    entries.extend([
        Entry::length("Platform.Radius", fitted.platform_radius),
        Entry::length("Platform.Z", 0.0),
    ]);
    let mut lines = String::new();
    for entry in &entries {
        let _ = writeln!(
            lines,
            "{} = {} {}",
            entry.name,
            decimals(entry.value),
            entry.unit
        );
    }
    Ok(Written {
        entries,
        lines,
        warnings: vec![
            "The names and signs are to be confirmed on the machine: enter the values in the mechanical system \
             of your Automation Studio project, move to three positions and compare the joint angles."
                .to_owned(),
        ],
    })
}
