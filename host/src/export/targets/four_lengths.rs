//! Controllers that hold the same four lengths, f, e, rf and re; Smoothieware also a zero for each arm.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::target::{Content, Entry, Fitted, Target, Written, decimals, words};
use delta_cal::robot::Drive;
use std::fmt::Write;

/// Of the three motors, degrees.
const AZIMUTHS: [f64; 3] = [-90.0, 30.0, 150.0];

const HOLDS: Holds = Holds {
    fixed_azimuths: Some(AZIMUTHS),
    radii: Each::Shared,
    heights: Each::Fixed,
    from_base_plane: false,
    upper: Each::Shared,
    lower: Each::Shared,
    zeros: Each::Fixed,
};

/// What holds more.
pub(super) const ALTERNATIVE: &str =
    "a correction table (--for correction-table) or a G-code filter with all 24 parameters";

/// The side of the equilateral triangle around a circle, mm.
fn side_of_triangle(radius: f64) -> f64 {
    2.0 * 3f64.sqrt() * radius
}

/// The limits of FluidNC's lengths, mm.
const FLUIDNC_LIMIT: f64 = 500.0;

/// FluidNC.
pub(crate) const FLUIDNC: Target = Target {
    name: "fluidnc",
    title: "FluidNC parallel_delta",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: HOLDS,
        write: |fitted| {
            let mut written = four(
                fitted,
                "kinematics:\n  parallel_delta:\n",
                [
                    "crank_mm",
                    "linkage_mm",
                    "base_triangle_mm",
                    "end_effector_triangle_mm",
                ],
                |name, value| format!("    {name}: {value}\n"),
            );
            for entry in &written.entries {
                if entry.value > FLUIDNC_LIMIT {
                    written.warnings.push(format!(
                        "FluidNC takes no {} above {FLUIDNC_LIMIT} mm: raise the limit in ParallelDelta.cpp, or the \
                         stated loss does not hold.",
                        entry.name
                    ));
                }
            }
            Ok(written)
        },
    },
    comment: "#",
    conventions: &[
        "motors X, Y and Z drive the arms at −90°, 30° and 150°",
        "the joint angle is 0 with the crank level and positive with the elbow down, in radians; one angle of \
         homing serves all motors",
        "base_triangle_mm and end_effector_triangle_mm are sides of triangles: 2√3 times the radii",
        "z = 0 is the plane of the motor axes",
    ],
    source: "FluidNC/src/Kinematics/ParallelDelta.cpp of FluidNC",
    alternative: ALTERNATIVE,
};

/// grblHAL.
pub(crate) const GRBLHAL: Target = Target {
    name: "grblhal",
    title: "grblHAL delta",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: HOLDS,
        write: |fitted| {
            Ok(four(
                fitted,
                "",
                [
                    "Bicep length",
                    "Forearm length",
                    "Base radius",
                    "End effector radius",
                ],
                |name, value| format!("{name} = {value}\n"),
            ))
        },
    },
    comment: ";",
    conventions: &[
        "motors A, B and C (axes X, Y and Z) drive the arms at −90°, 30° and 150°",
        "the joint angle is 0 with the upper arm level and positive with the elbow down; one home position serves all \
         motors",
        "\"Base radius\" and \"End effector radius\" are used as sides of triangles, 2√3 times the radii, whatever \
         they are called (kinematics/delta.c, version 0.03)",
        "z = 0 is the plane of the motor axes",
    ],
    source: "kinematics/delta.c of grblHAL; the numbers of the settings are to be confirmed on the machine",
    alternative: ALTERNATIVE,
};

/// µCNC.
pub(crate) const UCNC: Target = Target {
    name: "ucnc",
    title: "µCNC delta",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: HOLDS,
        write: |fitted| {
            Ok(four(
                fitted,
                "",
                [
                    "delta_bicep_length",
                    "delta_forearm_length",
                    "delta_base_radius",
                    "delta_effector_radius",
                ],
                |name, value| format!("{name} = {value}\n"),
            ))
        },
    },
    comment: ";",
    conventions: &[
        "motors 0, 1 and 2 drive the arms at −90°, 30° and 150°",
        "the joint angle is 0 with the upper arm level and positive with the elbow down; one homing angle serves \
         all motors",
        "delta_base_radius and delta_effector_radius are used as sides of triangles, 2√3 times the radii, whatever \
         they are called",
        "z = 0 is where homing puts it: set the work offset there",
    ],
    source: "uCNC/src/hal/kinematics/kinematic_delta.c of µCNC; the numbers of the settings are to be confirmed on \
             the machine",
    alternative: ALTERNATIVE,
};

/// Delta X.
pub(crate) const DELTA_X: Target = Target {
    name: "delta-x",
    title: "Delta X firmware",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: HOLDS,
        write: |fitted| {
            Ok(four(
                fitted,
                "// Geometry.h:\n",
                ["RD_RF", "RD_RE", "RD_F", "RD_E"],
                |name, value| format!("#define DEFAULT_{name} {value}\n"),
            ))
        },
    },
    comment: "//",
    conventions: &[
        "Theta1, Theta2 and Theta3 drive the arms at −90°, 30° and 150°",
        "the joint angle is 0 with the upper arm level and positive with the elbow down, in degrees",
        "RD_F and RD_E are sides of triangles: 2√3 times the radii",
        "z = 0 is the plane of the motor axes",
    ],
    source: "Delta_Firmware/DeltaKinematics.cpp of Delta-X-Firmware",
    alternative: ALTERNATIVE,
};

/// CODESYS.
pub(crate) const CODESYS: Target = Target {
    name: "codesys",
    title: "CODESYS SoftMotion, tripod with rotary axes",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: HOLDS,
        write: |fitted| {
            let [arm, ..] = fitted.geometry.by_motor();
            let platform = fitted.platform_radius;
            let entries = vec![
                Entry::length("dArmLength1", arm.upper),
                Entry::length("dArmLength2", arm.lower),
                Entry::length("dArm1Radius", arm.radius + platform),
                Entry::length("dStewartRadius", platform),
                Entry::length("dDistance", 0.0),
            ];
            let mut lines = String::new();
            for entry in &entries {
                let _ = writeln!(lines, "{} := {}; // mm", entry.name, decimals(entry.value));
            }
            let level = arm.radius + arm.upper;
            let below = (arm.lower * arm.lower - level * level).max(0.0).sqrt();
            Ok(Written {
                entries,
                lines,
                warnings: vec![
                    format!(
                        "The origin is the platform's centre with the upper arms level: z = {} mm in the robot's frame.",
                        decimals(arm.height - below)
                    ),
                    "Confirm the signs on the machine: move to three positions and compare the joint angles."
                        .to_owned(),
                ],
            })
        },
    },
    comment: "//",
    conventions: &[
        "A0, A1 and A2 drive the arms at −90°, 30° and 150°; x points from the origin away from A0's motor: the robot's y axis",
        "the joint angle is 0 with the upper arm level, in degrees; here positive with the elbow down",
        "dStewartRadius goes with dDistance 0: for rods that are d apart write d into dDistance and √(dStewartRadius² + d²/4) \
         into dStewartRadius",
    ],
    source: "the reference of Kin_Tripod_Rotary in the library SM3_Transformation; its source is not public, so nothing here is \
             verified against it",
    alternative: "a correction table (--for correction-table) or a kinematics function block of your own with all 24 parameters",
};

/// Smoothieware.
pub(crate) const SMOOTHIEWARE: Target = Target {
    name: "smoothieware",
    title: "Smoothieware rotary_delta",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: Holds {
            heights: Each::Shared,
            zeros: Each::Arm,
            ..HOLDS
        },
        write: smoothieware,
    },
    comment: "#",
    conventions: &[
        "alpha drives the arm at −90°, beta the one at 30°, gamma the one at 150°",
        "the joint angle is 0 with the upper arm level and positive with the elbow down, in degrees",
        "delta_f and delta_e are sides of triangles: 2√3 times the radii of base and platform; only their \
         difference counts",
        "M206 corrects the angles of the end stops in degrees (rotary_delta_calibration.enable true); add the values \
         to those that were in force when the samples were measured",
    ],
    source: "src/modules/robot/arm_solutions/RotaryDeltaSolution.cpp and \
             src/modules/tools/rotarydeltacalibration of Smoothieware",
    alternative: ALTERNATIVE,
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn smoothieware(fitted: &Fitted) -> Result<Written, ExportError> {
    let motors = fitted.geometry.by_motor();
    let [first, ..] = motors;
    let platform = fitted.platform_radius;
    let mut entries = vec![
        Entry::length("delta_e", side_of_triangle(platform)),
        Entry::length("delta_f", side_of_triangle(first.radius + platform)),
        Entry::length("delta_re", first.lower),
        Entry::length("delta_rf", first.upper),
        Entry::length("delta_z_offset", first.height),
        Entry::length("delta_ee_offs", 0.0),
        Entry::length("tool_offset", 0.0),
    ];
    let mut lines = String::from("arm_solution rotary_delta\n");
    for Entry { name, value, .. } in &entries {
        let _ = writeln!(lines, "{name} {}", decimals(*value));
    }
    let zeros = ["X", "Y", "Z"].into_iter().zip(motors);
    let zeros = zeros.map(|(axis, arm)| Entry::degrees(format!("M206 {axis}"), -arm.zero));
    let zeros: Vec<_> = zeros.collect();
    let _ = writeln!(
        lines,
        "# As a command, stored with M500:\nM206 {}",
        words(&zeros)
    );
    entries.extend(zeros);
    Ok(Written {
        entries,
        lines,
        warnings: Vec::new(),
    })
}

/// Upper arm, forearm, and the triangles of base and platform under these names.
fn four(
    fitted: &Fitted,
    before: &str,
    names: [&str; 4],
    line: fn(&str, &str) -> String,
) -> Written {
    let [arm, ..] = fitted.geometry.by_motor();
    let platform = fitted.platform_radius;
    let values = [
        arm.upper,
        arm.lower,
        side_of_triangle(arm.radius + platform),
        side_of_triangle(platform),
    ];
    let mut lines = before.to_owned();
    let mut entries = Vec::new();
    for (name, value) in names.into_iter().zip(values) {
        lines.push_str(&line(name, &decimals(value)));
        entries.push(Entry::length(name, value));
    }
    Written {
        entries,
        lines,
        warnings: Vec::new(),
    }
}
