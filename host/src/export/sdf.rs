//! A model for simulators, with all 24 parameters and its closed loops.

use super::exported::{Content, Export};
use super::loss::Loss;
use super::target::Written;
use super::wanted::Wanted;
use crate::accuracy::workspace_poses::inside;
use crate::files::robot_file::RobotFile;
use delta_cal::ArmIndex;
use nalgebra::Vector3;
use std::fmt::Write;

/// Masses that keep a simulation stable until the true ones stand in their place, kg.
const UPPER_MASS: f64 = 0.5;
const FOREARM_MASS: f64 = 0.1;
const PLATFORM_MASS: f64 = 0.3;

/// Metres with 9 decimals: 1e-6 mm.
fn metres(at: &Vector3<f64>) -> String {
    unit(&(at * 1e-3))
}

fn unit(at: &Vector3<f64>) -> String {
    let [x, y, z] = [at.x, at.y, at.z].map(|value| (value * 1e9).round() / 1e9 + 0.0);
    format!("{x:.9} {y:.9} {z:.9}")
}

/// The joint angles of the model's pose: all at 0, or the first of the workspace.
fn pose(robot: &RobotFile) -> ([f64; 3], Vector3<f64>) {
    let reach = robot.reach();
    let level = reach.clear_position(&robot.robot, &[0.0; 3]);
    if let Ok(position) = level {
        return ([0.0; 3], position);
    }
    inside(&robot.robot, &reach)
        .first()
        .map_or(([0.0; 3], Vector3::zeros()), |pose| {
            (pose.joints, pose.position)
        })
}

/// A link with a rod from its origin to `end`, mm.
fn link(text: &mut String, name: &str, at: &Vector3<f64>, end: &Vector3<f64>, mass: f64) {
    let (middle, length) = (end * 0.5, end.norm());
    let pitch = f64::atan2(end.xy().norm(), end.z);
    let yaw = f64::atan2(end.y, end.x);
    let turned = format!("{} 0 {pitch:.9} {yaw:.9}", metres(&middle));
    let inertia = f64::max(mass * (length * 1e-3).powi(2) / 12.0, 1e-6);
    let _ = write!(
        text,
        "    <link name=\"{name}\">\n      <pose relative_to=\"__model__\">{} 0 0 0</pose>\n      \
         <inertial>\n        <pose>{turned}</pose>\n        <mass>{mass}</mass>\n        \
         <inertia><ixx>{inertia:.9}</ixx><iyy>{inertia:.9}</iyy><izz>{inertia:.9}</izz></inertia>\n      \
         </inertial>\n      <visual name=\"rod\">\n        <pose>{turned}</pose>\n        \
         <geometry><cylinder><radius>0.006</radius><length>{:.9}</length></cylinder></geometry>\n      \
         </visual>\n    </link>\n",
        metres(at),
        f64::max(length * 1e-3, 1e-3),
    );
}

/// A universal joint at a place in the model, mm, with the directions of its two axes.
fn universal(
    text: &mut String,
    [name, parent, child]: [&str; 3],
    at: &Vector3<f64>,
    [first, second]: [&Vector3<f64>; 2],
) {
    let _ = write!(
        text,
        "    <joint name=\"{name}\" type=\"universal\">\n      \
         <pose relative_to=\"__model__\">{} 0 0 0</pose>\n      \
         <parent>{parent}</parent>\n      <child>{child}</child>\n      \
         <axis><xyz expressed_in=\"__model__\">{}</xyz></axis>\n      \
         <axis2><xyz expressed_in=\"__model__\">{}</xyz></axis2>\n    </joint>\n",
        metres(at),
        unit(first),
        unit(second),
    );
}

fn model(robot: &RobotFile) -> String {
    let (joints, platform) = pose(robot);
    let mut text = String::from("  <model name=\"delta_robot\">\n    <link name=\"base\"/>\n");
    text.push_str(
        "    <joint name=\"base_to_world\" type=\"fixed\">\n      <parent>world</parent>\n      \
         <child>base</child>\n    </joint>\n",
    );
    link(
        &mut text,
        "platform",
        &platform,
        &Vector3::zeros(),
        PLATFORM_MASS,
    );
    for ((index, q), number) in ArmIndex::ALL.into_iter().zip(joints).zip(1..) {
        let arm = robot.robot.arm(index);
        let (motor, elbow, axis) = (arm.d(), arm.elbow(q), arm.basis().ey);
        let forearm = platform - elbow;
        let across = forearm.cross(&axis);
        let across = across / across.norm();
        let upper_arm = format!("upper_arm_{number}");
        let forearm_name = format!("forearm_{number}");
        link(&mut text, &upper_arm, &motor, &(elbow - motor), UPPER_MASS);
        link(&mut text, &forearm_name, &elbow, &forearm, FOREARM_MASS);
        let _ = write!(
            text,
            "    <joint name=\"motor_{number}\" type=\"revolute\">\n      \
             <pose relative_to=\"__model__\">{} 0 0 0</pose>\n      \
             <parent>base</parent>\n      <child>{upper_arm}</child>\n      \
             <axis>\n        <xyz expressed_in=\"__model__\">{}</xyz>\n        \
             <limit><lower>{:.9}</lower><upper>{:.9}</upper></limit>\n      </axis>\n    </joint>\n",
            metres(&motor),
            unit(&axis),
            robot.limits.minimum() - q,
            robot.limits.maximum() - q,
        );
        universal(
            &mut text,
            [&format!("elbow_{number}"), &upper_arm, &forearm_name],
            &elbow,
            [&axis, &across],
        );
        universal(
            &mut text,
            [&format!("wrist_{number}"), &forearm_name, "platform"],
            &platform,
            [&across, &axis],
        );
    }
    text.push_str("  </model>\n");
    text
}

/// As SDF 1.8.
pub(super) fn export(robot: &RobotFile, wanted: &Wanted) -> Export {
    let ([q1, q2, q3], _) = pose(robot);
    let mut warnings = vec![
        "Masses and radii of the rods are placeholders: no calibration measures them.".to_owned(),
        "The platform is a child of three joints: that closes the loops. Whether your simulator's physics engine \
         closes them is to be confirmed there."
            .to_owned(),
    ];
    if [q1, q2, q3].iter().any(|q| q.abs() > 0.0) {
        warnings.push(format!(
            "The model's joints are at 0 where the robot's are at {:.6}°, {:.6}° and {:.6}°.",
            q1.to_degrees(),
            q2.to_degrees(),
            q3.to_degrees()
        ));
    }
    let nothing = Loss::of(wanted.evaluated.iter().map(|at| (*at, Some(0.0))));
    Export {
        name: "sdf",
        title: "SDF 1.8",
        comment: "",
        content: Content::Everything,
        written: Written {
            entries: Vec::new(),
            lines: format!("<sdf version=\"1.8\">\n{}</sdf>\n", model(robot)),
            warnings,
        },
        frame: None,
        loss: nothing,
        uncalibrated: nothing,
        uncalibrated_moved: nothing,
        within: None,
        controller: None,
        conventions: vec![
            "metres, radians; motor_1, motor_2 and motor_3 are the robot's joints, positive with the elbow down",
            "each forearm is one rod between two universal joints, whose parallel axes keep the platform from turning; \
             the rods meet in the platform point, for the 24 parameters have the platform's radius subtracted",
        ],
        source: "the SDF specification, version 1.8 (sdformat.org)",
        alternative: "nothing is lost",
    }
}
