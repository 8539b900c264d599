//! Smoothieware.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::target::{Entry, Fitted, Target, Written, decimals};
use crate::export::targets::four_lengths::{AZIMUTHS, side_of_triangle};
use std::fmt::Write;

/// `arm_solution rotary_delta`.
pub(crate) const SMOOTHIEWARE: Target = Target {
    name: "smoothieware",
    title: "Smoothieware rotary_delta",
    holds: Holds {
        fixed_azimuths: Some(AZIMUTHS),
        radii: Each::Shared,
        heights: Each::Shared,
        upper: Each::Shared,
        lower: Each::Shared,
        zeros: Each::Arm,
    },
    comment: "#",
    conventions: &[
        "alpha drives the arm at −90°, beta the one at 30°, gamma the one at 150°",
        "the joint angle is 0 with the upper arm horizontal and positive with the elbow down, in degrees",
        "delta_f and delta_e are sides of triangles: 2√3 times the radii of base and platform; only their \
         difference counts",
        "M206 corrects the angles of the end stops in degrees (rotary_delta_calibration.enable true); add the values \
         to those that were in force when the samples were measured",
    ],
    source: "src/modules/robot/arm_solutions/RotaryDeltaSolution.cpp and \
             src/modules/tools/rotarydeltacalibration of Smoothieware",
    alternative: "a correction table (--for correction-table) or a G-code filter with all 24 parameters",
    write,
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let geometry = &fitted.geometry;
    let first = geometry.arm_of_motor(0);
    let platform = fitted.platform_radius;
    let lengths = [
        ("delta_e", side_of_triangle(platform)),
        ("delta_f", side_of_triangle(first.radius + platform)),
        ("delta_re", first.lower),
        ("delta_rf", first.upper),
        ("delta_z_offset", first.height),
        ("delta_ee_offs", 0.0),
        ("tool_offset", 0.0),
    ];
    let mut entries = Vec::new();
    let mut lines = String::from("arm_solution rotary_delta\n");
    for (name, value) in lengths {
        entries.push(Entry::length(name, value));
        let _ = writeln!(lines, "{name} {}", decimals(value));
    }
    lines.push_str("# As a command, stored with M500:\nM206");
    for (axis, arm) in ["X", "Y", "Z"].into_iter().zip(geometry.by_motor()) {
        entries.push(Entry::degrees(format!("M206 {axis}"), -arm.zero));
        let _ = write!(lines, " {axis}{}", decimals(-arm.zero.to_degrees()));
    }
    lines.push('\n');
    Ok(Written {
        entries,
        lines,
        warnings: Vec::new(),
    })
}
