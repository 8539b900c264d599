//! LinuxCNC: its own kinematics, and the component `deltacalkins` (`bindings/c/linuxcnc`) with all 24 parameters.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::target::{Content, Entry, Fitted, Target, Written, decimals};
use crate::files::robot_file::RobotFile;
use crate::text::degrees;
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::{Parameter, Robot};
use delta_cal_protocol::Geometry;
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
        "z = 0 is the plane of the hips; only platformradius − footradius matters",
        "HOME_OFFSET is the joint's angle at its home switch (--home) and replaces the current one",
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
        // Inches need more digits.
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

/// `deltacalkins`.
pub(crate) const COMPONENT: Target = Target {
    name: "linuxcnc-component",
    title: "LinuxCNC deltacalkins",
    drive: Some(Drive::Rotary),
    content: Content::Everything,
    comment: "#",
    conventions: &[
        "joints 0, 1 and 2 drive arms 1, 2 and 3, in degrees, as in the robot file: La defines 0, and positive is with the \
         elbow down",
        "X, Y and Z are the platform point in the robot's frame; a calibration in another frame moves the work offset",
        "HOME_OFFSET is the joint's angle at its home switch in the same convention; a calibration does not change it",
        "with LINEAR_UNITS = inch: setp deltacalkins.units-per-mm 0.03937007874015748, before the revision",
    ],
    source: "bindings/c/linuxcnc/deltacalkins.comp and docs/linuxcnc.md of delta-cal",
    alternative: "a correction table (--for correction-table), which includes transmission errors",
};

/// Decimals of mm and degrees: 1e-9° is 1e-8 mm at a distance of half a metre.
const DIGITS: usize = 9;

/// The pins, in the order of `Parameter::ROTARY`.
const PINS: [&str; 8] = ["dx", "dy", "dz", "theta", "alpha", "la-x", "la-y", "lb"];

/// A file of `setp` lines, and the robot that it describes. `home`: the joint angle of each arm at its home switch,
/// radians, if stated.
pub(crate) fn write_component(
    robot: &RobotFile,
    home: Option<[f64; 3]>,
) -> Result<(Written, Robot<f64>), ExportError> {
    let mut written = Written::default();
    let mut arms = robot.robot.parameters();
    for (arm, number) in arms.iter_mut().zip(1..) {
        for ((value, parameter), pin) in arm.iter_mut().zip(Parameter::ROTARY).zip(PINS) {
            let name = format!("deltacalkins.arm{number}.{pin}");
            let angle = parameter.kind() == ParameterKind::Angle;
            let text = text(if angle { degrees(*value) } else { *value });
            let rounded: f64 = text.parse().unwrap_or(*value);
            let _ = writeln!(written.lines, "setp {name} {text}");
            *value = if angle { rounded.to_radians() } else { rounded };
            written.entries.push(Entry {
                name,
                value: rounded,
                unit: if angle { "deg" } else { "mm" },
            });
        }
    }
    let geometry = Geometry {
        arms,
        transmissions: None,
    };
    let _ = writeln!(
        written.lines,
        "# Last: applies the values above. Other parameters have another number.\nsetp deltacalkins.revision {}",
        geometry.fingerprint().max(1)
    );
    ini(&mut written.lines, robot, home);
    let mut own = robot.robot.arms().iter();
    if own.any(|arm| arm.transmission().is_some()) {
        let warning = "The component has no transmission errors: the robot file's are lost.";
        written.warnings.push(warning.to_owned());
    }
    let held = Robot::from_parameters(arms).map_err(|_| ExportError::Unreached)?;
    Ok((written, held))
}

/// The value without −0.
fn text(value: f64) -> String {
    let text = format!("{value:.DIGITS$}");
    let zero = text.trim_start_matches(['-', '0', '.']).is_empty();
    text.trim_start_matches(|sign| zero && sign == '-')
        .to_owned()
}

/// The lines for the INI file, as comments in the HAL file.
fn ini(lines: &mut String, robot: &RobotFile, home: Option<[f64; 3]>) {
    lines.push_str(
        "#\n# In the INI file:\n#\n# [KINS]\n# KINEMATICS = deltacalkins\n# JOINTS = 3\n",
    );
    let limits = [robot.limits.minimum(), robot.limits.maximum()];
    let [low, high] = limits.map(|limit| decimals(limit.to_degrees()));
    for joint in 0..3 {
        let _ = write!(
            lines,
            "#\n# [JOINT_{joint}]\n# TYPE = ANGULAR\n# MIN_LIMIT = {low}\n# MAX_LIMIT = {high}\n"
        );
        if let Some(home) = home {
            let _ = writeln!(
                lines,
                "# HOME_OFFSET = {}",
                decimals(home[joint].to_degrees())
            );
        }
    }
}
