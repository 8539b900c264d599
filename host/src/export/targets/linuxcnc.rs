//! LinuxCNC.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::target::{Content, Entry, Fitted, Target, Written, decimals};
use delta_cal::robot::Drive;
use std::fmt::Write;

/// `rotarydeltakins`.
pub(crate) const LINUXCNC: Target = Target {
    name: "linuxcnc",
    title: "LinuxCNC rotarydeltakins",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: Holds {
            fixed_azimuths: Some([-90.0, 150.0, 30.0]),
            radii: Each::Shared,
            heights: Each::Fixed,
            from_base_plane: false,
            upper: Each::Shared,
            lower: Each::Shared,
            zeros: Each::Arm,
        },
        write,
    },
    comment: "#",
    conventions: &[
        "joint 0 drives the arm at −y, joint 1 the one at 150° (−x), joint 2 the one at 30° (+x)",
        "the joint angle is 0 with the thigh level and positive with the knee down, in degrees",
        "z = 0 is the plane of the hips; only platformradius − footradius counts",
        "HOME_OFFSET is the joint's angle at its home switch (--home) and replaces the one in force",
    ],
    source: "src/emc/kinematics/rotarydeltakins-common.h of LinuxCNC",
    alternative: "the kinematics component deltacalkins with all 24 parameters (--for linuxcnc-component)",
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let geometry = &fitted.geometry;
    let [first, ..] = geometry.by_motor();
    let foot = fitted.platform_radius;
    let length = |name: &str, value: f64| {
        if fitted.inches {
            Entry::inches(name, value)
        } else {
            Entry::length(name, value)
        }
    };
    let mut entries = vec![
        length("platformradius", first.radius + foot),
        length("thighlength", first.upper),
        length("shinlength", first.lower),
        length("footradius", foot),
    ];
    let mut lines = String::from("# In the HAL file:\n");
    for Entry { name, value, .. } in &entries {
        // An inch has as many digits more as it is larger.
        let value = if fitted.inches {
            format!("{value:.6}")
        } else {
            decimals(*value)
        };
        let _ = writeln!(lines, "setp rotarydeltakins.{name} {value}");
    }
    lines.push_str("# In the INI file:\n");
    for (joint, arm) in geometry.motors.into_iter().enumerate() {
        let offset = fitted.home[arm] - geometry.arms[arm].zero;
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
        warnings: fitted.assumptions(),
    })
}
