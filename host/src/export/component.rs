//! LinuxCNC's component `deltacalkins` (`bindings/c/linuxcnc`), with all 24 parameters.

use super::error::ExportError;
use super::target::{Entry, Written, decimals};
use crate::files::robot_file::RobotFile;
use crate::text::degrees;
use delta_cal::robot::ParameterKind;
use delta_cal::{Parameter, Robot};
use delta_cal_protocol::Geometry;
use std::fmt::Write;

/// Decimals of mm and degrees: 1e-9° is 1e-8 mm at a distance of half a metre.
const DIGITS: usize = 9;

/// The pins, in the order of `Parameter::ROTARY`.
const PINS: [&str; 8] = ["dx", "dy", "dz", "theta", "alpha", "la-x", "la-y", "lb"];

/// A file of `setp` lines, and the robot that it describes. `home`: the joint angle of each arm at its home switch,
/// radians, if stated.
pub(super) fn write(
    robot: &RobotFile,
    home: Option<[f64; 3]>,
) -> Result<(Written, Robot<f64>), ExportError> {
    let mut written = Written::default();
    let mut arms = robot.robot.parameters();
    for (arm, number) in arms.iter_mut().zip(1..) {
        for ((value, parameter), pin) in arm.iter_mut().zip(Parameter::ROTARY).zip(PINS) {
            let name = format!("deltacalkins.arm{number}.{pin}");
            let angle = parameter.kind() == ParameterKind::Angle;
            let text = decimals(if angle { degrees(*value) } else { *value }, DIGITS);
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

/// The lines for the INI file, as comments in the HAL file.
fn ini(lines: &mut String, robot: &RobotFile, home: Option<[f64; 3]>) {
    lines.push_str(
        "#\n# In the INI file:\n#\n# [KINS]\n# KINEMATICS = deltacalkins\n# JOINTS = 3\n",
    );
    let limits = [robot.limits.minimum(), robot.limits.maximum()];
    let [low, high] = limits.map(|limit| decimals(limit.to_degrees(), 4));
    for joint in 0..3 {
        let _ = write!(
            lines,
            "#\n# [JOINT_{joint}]\n# TYPE = ANGULAR\n# MIN_LIMIT = {low}\n# MAX_LIMIT = {high}\n"
        );
        if let Some(home) = home {
            let offset = decimals(home[joint].to_degrees(), 4);
            let _ = writeln!(lines, "# HOME_OFFSET = {offset}");
        }
    }
}
