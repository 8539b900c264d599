//! All 24 parameters for LinuxCNC: the pins of the component `deltacalkins` (`c/linuxcnc`).

use super::error::ExportError;
use super::exported::{Content, Export};
use super::loss::Loss;
use super::target::{Entry, Written, decimals};
use super::wanted::Wanted;
use crate::files::robot_file::RobotFile;
use crate::text::units::degrees;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::ParameterKind;
use delta_cal::{Parameter, Robot};
use delta_cal_protocol::Geometry;
use std::fmt::Write;

/// Digits after the decimal point, of mm and degrees: 1e-9° are 1e-8 mm at the end of half a metre.
const DIGITS: usize = 9;

/// The pins, in the order of `Parameter::ROTARY`.
const PINS: [&str; 8] = ["dx", "dy", "dz", "theta", "alpha", "la-x", "la-y", "lb"];

/// A file of `setp` lines. `home`: the joint angle of each arm at its home switch, radians, if it is stated.
pub(super) fn export(
    robot: &RobotFile,
    wanted: &Wanted,
    home: Option<[f64; 3]>,
) -> Result<Export, ExportError> {
    let mut entries = Vec::new();
    let mut lines = String::new();
    let mut written = robot.robot.parameters();
    for (arm, number) in written.iter_mut().zip(1..) {
        for ((value, parameter), pin) in arm.iter_mut().zip(Parameter::ROTARY).zip(PINS) {
            let (text, unit) = match parameter.kind() {
                ParameterKind::Angle => (text(degrees(*value)), "deg"),
                ParameterKind::Length | ParameterKind::Ratio => (text(*value), "mm"),
            };
            let rounded: f64 = text.parse().unwrap_or(*value);
            *value = match unit {
                "deg" => rounded.to_radians(),
                _ => rounded,
            };
            let name = format!("deltacalkins.arm{number}.{pin}");
            let _ = writeln!(lines, "setp {name} {text}");
            entries.push(Entry {
                name,
                value: rounded,
                unit,
            });
        }
    }
    lines.push_str("# Last: takes over what stands above. Other parameters have another number.\n");
    let revision = Geometry {
        arms: written,
        transmissions: None,
    };
    let revision = revision.fingerprint().max(1);
    let _ = writeln!(lines, "setp deltacalkins.revision {revision}");
    lines.push_str(&ini(robot, home));
    let written = Robot::from_parameters(written).map_err(|_| ExportError::Unreached)?;
    let loss = Loss::of_controller(&robot.robot, &written, &RigidTransform::default(), wanted);
    Ok(Export {
        name: "linuxcnc-component",
        title: "LinuxCNC deltacalkins",
        comment: "#",
        content: Content::Everything,
        written: Written {
            entries,
            lines,
            warnings: Vec::new(),
        },
        frame: None,
        loss,
        uncalibrated: loss,
        uncalibrated_moved: loss,
        within: None,
        controller: None,
        conventions: vec![
            "joints 0, 1 and 2 drive arms 1, 2 and 3, in degrees, as the robot file counts their angles: 0 where La \
             has it, positive with the elbow down",
            "X, Y and Z are those of the platform point in the robot's frame; a calibration in another frame moves the \
             work offset",
            "HOME_OFFSET is the joint's angle at its home switch in the same count; a calibration does not change it",
            "with LINEAR_UNITS = inch: setp deltacalkins.units-per-mm 0.03937007874015748, before the revision",
        ],
        source: "c/linuxcnc/deltacalkins.comp and docs/linuxcnc.md of delta-cal",
        alternative: if robot
            .robot
            .arms()
            .iter()
            .all(|arm| arm.transmission().is_none())
        {
            "nothing is lost"
        } else {
            "the component knows no transmissions; --for correction-table holds them as well"
        },
    })
}

fn text(value: f64) -> String {
    let text = format!("{value:.DIGITS$}");
    // No minus before zero.
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        format!("{:.DIGITS$}", 0.0)
    } else {
        text
    }
}

/// The lines for the INI file, as comments: the file itself is a HAL file.
fn ini(robot: &RobotFile, home: Option<[f64; 3]>) -> String {
    let mut lines = String::from(
        "#\n# In the INI file:\n#\n# [KINS]\n# KINEMATICS = deltacalkins\n# JOINTS = 3\n",
    );
    let [low, high] = [robot.limits.minimum(), robot.limits.maximum()].map(f64::to_degrees);
    for joint in 0..3 {
        let _ = write!(
            lines,
            "#\n# [JOINT_{joint}]\n# TYPE = ANGULAR\n# MIN_LIMIT = {}\n# MAX_LIMIT = {}\n",
            decimals(low),
            decimals(high)
        );
        if let Some(home) = home {
            let _ = writeln!(
                lines,
                "# HOME_OFFSET = {}",
                decimals(home[joint].to_degrees())
            );
        }
    }
    lines
}
