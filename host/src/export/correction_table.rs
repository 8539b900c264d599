//! A correction table as a target: its lines and what is lost.

use super::corrections::between::Region;
use super::corrections::choice::{Finished, Nodes};
use super::corrections::kind::{Kind, Pair};
use super::corrections::table::Node;
use super::error::ExportError;
use super::exported::{Content, Export};
use super::shape::ArmShape;
use super::target::Written;
use super::wanted::Wanted;
use crate::files::robot_file::RobotFile;
use crate::text::units::degrees;
use delta_cal::Robot;
use delta_cal::robot::Drive;
use std::fmt::Write;

/// The table of a calibrated robot for a controller that computes with the nominal one, which the user stated or not.
///
/// # Errors
/// Too many nodes, a limit that no spacing keeps to, or no wanted position in a cell with corrections.
pub(crate) fn export(
    robot: &RobotFile,
    (nominal, stated): (&Robot<f64>, bool),
    wanted: &Wanted,
    (kind, nodes): (Kind, Nodes),
) -> Result<Export, ExportError> {
    let pair = Pair {
        calibrated: &robot.robot,
        nominal,
    };
    let region = Region::of(robot, wanted);
    let finished = Finished::of(&pair, kind, nodes, &region)?;
    let loss = finished.between.wanted;
    if loss.positions == 0 {
        return Err(ExportError::Unreached);
    }
    let how = match (kind, robot.robot.drive()) {
        (Kind::Position, _) => {
            "to be at (x, y, z), command (x + dx, y + dy, z + dz) to a controller whose kinematics is that of the \
             robot before calibration; between nodes interpolate linearly along x, y and z"
        }
        (Kind::Joint, Drive::Rotary) => {
            "to be at (x, y, z), add dq1, dq2, dq3 to the joint angles that the kinematics of the robot before \
             calibration has there; between nodes interpolate linearly along x, y and z"
        }
        (Kind::Joint, Drive::Linear) => {
            "to be at (x, y, z), add ds1, ds2, ds3 to the travels that the kinematics of the robot before \
             calibration has there; between nodes interpolate linearly along x, y and z"
        }
    };
    Ok(Export {
        name: "correction-table",
        title: "correction table",
        comment: "#",
        written: Written {
            entries: Vec::new(),
            lines: lines(&finished, robot.robot.drive()),
            warnings: nominal_assumed(nominal, stated).into_iter().collect(),
        },
        frame: None,
        loss,
        uncalibrated: loss,
        uncalibrated_moved: loss,
        within: None,
        controller: None,
        conventions: vec![
            "positions in the calibrated robot's frame, mm",
            how,
            "node: computed; extrapolated, where the robot reaches nodes beside this one only, or is near a parallel \
             singularity at this one, which serves positions between them; empty, where there is no correction",
        ],
        source: "computed",
        alternative: "a smaller --spacing, a --limit, or --positions with a file of where the robot works",
        content: Content::Corrections(Box::new(finished)),
    })
}

/// What to say of a controller's robot that nobody stated.
fn nominal_assumed(nominal: &Robot<f64>, stated: bool) -> Option<String> {
    if stated {
        return None;
    }
    let which = match nominal.drive() {
        Drive::Rotary => {
            let [arm, ..] = ArmShape::all(nominal);
            format!(
                " (base less platform radius {:.4}, height {:.4}, upper arm {:.4}, forearm {:.4} mm, first arm at \
                 {:.4}°, joint angles 0 at {:.4}° above horizontal)",
                arm.radius,
                arm.height,
                arm.upper,
                arm.lower,
                degrees(arm.azimuth),
                degrees(arm.zero)
            )
        }
        Drive::Linear => String::new(),
    };
    Some(format!(
        "The table is right only for a controller that computes with the symmetric robot{which}, for --nominal does not \
         name the controller's own."
    ))
}

/// A row for each node.
fn lines(finished: &Finished, drive: Drive) -> String {
    let table = &finished.table;
    // To 1e-5 mm, or to 1e-7°, which are 1e-6 mm half a metre away.
    let (names, digits) = match (table.kind, drive) {
        (Kind::Position, _) => ("dx_mm,dy_mm,dz_mm", 5),
        (Kind::Joint, Drive::Rotary) => ("dq1_deg,dq2_deg,dq3_deg", 7),
        (Kind::Joint, Drive::Linear) => ("ds1_mm,ds2_mm,ds3_mm", 5),
    };
    let number = |value: f64| {
        let text = format!("{value:.digits$}");
        match text.strip_prefix('-') {
            Some(zero) if zero.bytes().all(|byte| matches!(byte, b'0' | b'.')) => zero.to_owned(),
            _ => text,
        }
    };
    let mut lines = format!("x_mm,y_mm,z_mm,{names},node\n");
    for (node, index) in table.nodes.iter().zip(0..) {
        let at = table.grid.position(index).map(|value| value + 0.0);
        let values = match node {
            Node::Computed(by) | Node::Extrapolated(by) => [by.x, by.y, by.z].map(number).join(","),
            Node::Empty => ",,".to_owned(),
        };
        let _ = writeln!(lines, "{},{},{},{values},{}", at.x, at.y, at.z, node.name());
    }
    lines
}
