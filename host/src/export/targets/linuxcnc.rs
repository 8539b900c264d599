//! LinuxCNC.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::target::{Entry, Fitted, Target, Written, assumed_home, decimals};
use std::fmt::Write;

/// `rotarydeltakins`.
pub(crate) const LINUXCNC: Target = Target {
    name: "linuxcnc",
    title: "LinuxCNC rotarydeltakins",
    holds: Holds {
        fixed_azimuths: Some([-90.0, 150.0, 30.0]),
        radii: Each::Shared,
        heights: Each::Fixed,
        upper: Each::Shared,
        lower: Each::Shared,
        zeros: Each::Arm,
    },
    comment: "#",
    conventions: &[
        "joint 0 drives the arm at −y, joint 1 the one at 150° (−x), joint 2 the one at 30° (+x)",
        "the joint angle is 0 with the thigh horizontal and positive with the knee down, in degrees",
        "z = 0 is the plane of the hips; only platformradius − footradius counts",
        "HOME_OFFSET is the joint's angle at its home switch; it is computed from --home-deg and replaces the \
         home offset that was in force",
    ],
    source: "src/emc/kinematics/rotarydeltakins-common.h of LinuxCNC",
    alternative: "the kinematics component deltacalkins with all 24 parameters (--for linuxcnc-component)",
    write,
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let geometry = &fitted.geometry;
    let first = geometry.arm_of_motor(0);
    let foot = fitted.platform_radius;
    let pins = [
        ("platformradius", first.radius + foot),
        ("thighlength", first.upper),
        ("shinlength", first.lower),
        ("footradius", foot),
    ];
    let mut entries = Vec::new();
    let mut lines = String::from("# In the HAL file:\n");
    for (name, value) in pins {
        entries.push(Entry::length(name, value));
        let _ = writeln!(lines, "setp rotarydeltakins.{name} {}", decimals(value));
    }
    lines.push_str("# In the INI file:\n");
    for (joint, arm) in geometry.motors.into_iter().enumerate() {
        let own = &geometry.arms[arm];
        let offset = fitted.home[arm] - own.zero;
        entries.push(Entry::degrees(format!("JOINT_{joint} HOME_OFFSET"), offset));
        let _ = writeln!(
            lines,
            "[JOINT_{joint}]\n# arm {}\nHOME_OFFSET = {}",
            arm + 1,
            decimals(offset.to_degrees())
        );
    }
    Ok(Written {
        entries,
        lines,
        warnings: assumed_home(fitted).into_iter().collect(),
    })
}
