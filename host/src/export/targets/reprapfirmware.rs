//! RepRapFirmware.

use crate::export::error::ExportError;
use crate::export::geometry::{ARMS, Shape, TOWERS, within_half_turn};
use crate::export::target::{AXES, Content, Entry, Fitted, Target, Written, decimals, words};
use delta_cal::robot::Drive;
use std::f64::consts::FRAC_PI_2;

/// `M669 K10` and `M666`.
pub(crate) const ROTARY: Target = Target {
    name: "reprapfirmware",
    title: "RepRapFirmware M669 K10",
    drive: Some(Drive::Rotary),
    content: Content::Fitted {
        holds: ARMS,
        write: rotary,
    },
    comment: ";",
    conventions: &[
        "X, Y and Z are arms 1, 2 and 3; the corrections X, Y and Z count from −150°, −30° and 90°, and keep the robot's \
         x axis however large they are",
        "the joint angle is 0 with the upper arm level and positive with the elbow up; the arm is at the upper limit \
         of A at its end stop, and M666 corrects that angle in degrees",
        "R is the base radius minus the platform radius; H is the height of the motor axes above z = 0",
    ],
    source: "src/Movement/Kinematics/RotaryDeltaKinematics.cpp of RepRapFirmware",
    alternative: super::four_lengths::ALTERNATIVE,
};

/// `M665` and `M666`.
pub(crate) const LINEAR: Target = Target {
    name: "reprapfirmware",
    title: "RepRapFirmware M665",
    drive: Some(Drive::Linear),
    content: Content::Fitted {
        holds: TOWERS,
        write: linear,
    },
    comment: ";",
    conventions: &[
        "X, Y and Z are towers 1, 2 and 3; the corrections X, Y and Z of M665 count from 210°, 330° and 90°, \
         counter-clockwise",
        "R is the distance of the towers from the centre minus the platform radius; L has a rod for each tower",
        "H is the height of the nozzle at x = y = 0 with all carriages at their end stops; M666 is how much higher each end \
         stop is, with a mean of 0",
        "B is the printable radius; M666 A and B, the tilt of the bed, are 0",
    ],
    source: "src/Movement/Kinematics/LinearDeltaKinematics.cpp of RepRapFirmware",
    alternative: super::marlin::ALTERNATIVE,
};

/// The azimuths without a correction, degrees.
const AZIMUTHS: [f64; 3] = [-150.0, -30.0, 90.0];
/// If upper arms differ by more than this, mm, RepRapFirmware's forward and inverse kinematics differ.
const EQUAL: f64 = 0.001;

/// One value for each arm, as in a word.
fn three(arms: &[Shape; 3], value: fn(&Shape) -> f64) -> String {
    arms.each_ref().map(|arm| decimals(value(arm))).join(":")
}

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn rotary(fitted: &Fitted) -> Result<Written, ExportError> {
    let arms = &fitted.geometry.arms;
    let [first, ..] = arms;
    // Angles are positive upwards: the upper limit is at the smallest joint angle.
    let [lowest, highest] = fitted.limits;
    let top = -fitted.home.into_iter().fold(f64::INFINITY, f64::min);
    let bottom = f64::min(-highest, top);
    let mut entries = vec![Entry::length("M669 R", first.radius)];
    let (mut corrections, mut stops) = (Vec::new(), Vec::new());
    for (index, (axis, arm)) in AXES.into_iter().zip(arms).enumerate() {
        let correction = within_half_turn(arm.azimuth - AZIMUTHS[index].to_radians());
        corrections.push(Entry::degrees(format!("M669 {axis}"), correction));
        let stop = arm.zero - fitted.home[index] - top;
        stops.push(Entry::degrees(format!("M666 {axis}"), stop));
        entries.extend([
            Entry::length(format!("M669 U ({axis})"), arm.upper),
            Entry::length(format!("M669 L ({axis})"), arm.lower),
            Entry::length(format!("M669 H ({axis})"), arm.height),
        ]);
    }
    let lines = format!(
        "M669 K10 U{} L{} H{} R{} {} A{}:{} B{:.1}\nM666 {}\n",
        three(arms, |arm| arm.upper),
        three(arms, |arm| arm.lower),
        three(arms, |arm| arm.height),
        decimals(first.radius),
        words(&corrections),
        decimals(bottom.to_degrees()),
        decimals(top.to_degrees()),
        fitted.reach.ceil(),
        words(&stops),
    );
    let mut warnings = fitted.assumptions();
    if arms
        .iter()
        .any(|arm| (arm.upper - first.upper).abs() > EQUAL)
    {
        warnings.push(
            "The three upper arms differ. RepRapFirmware's forward kinematics uses arm X's length for all elbows, so the \
             position that it assumes after homing is off by about the difference. After homing, first move to a stated \
             X, Y and Z away from obstacles; moves (inverse kinematics) are right."
                .to_owned(),
        );
    }
    if lowest.abs() > FRAC_PI_2 || highest.abs() > FRAC_PI_2 {
        warnings.push(
            "RepRapFirmware computes joint angles from −90° to 90° only, and [joints] exceeds that."
                .to_owned(),
        );
    }
    Ok(Written {
        entries: [entries, corrections, stops].concat(),
        lines,
        warnings,
    })
}

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn linear(fitted: &Fitted) -> Result<Written, ExportError> {
    let towers = &fitted.geometry.arms;
    let radius = towers[0].radius;
    let endstops = fitted.tower_endstops();
    let height = endstops.iter().sum::<f64>() / 3.0;
    let azimuths = fitted.geometry.tower_corrections();
    let mut entries = vec![
        Entry::length("M665 R", radius),
        Entry::length("M665 H", height),
    ];
    let (mut corrections, mut stops) = (Vec::new(), Vec::new());
    for (index, (axis, tower)) in AXES.into_iter().zip(towers).enumerate() {
        entries.push(Entry::length(format!("M665 L ({axis})"), tower.lower));
        corrections.push(Entry::degrees(format!("M665 {axis}"), azimuths[index]));
        stops.push(Entry::length(
            format!("M666 {axis}"),
            endstops[index] - height,
        ));
    }
    let lines = format!(
        "M665 L{} R{} H{} B{:.1} {}\nM666 {} A0 B0\n",
        three(towers, |tower| tower.lower),
        decimals(radius),
        decimals(height),
        fitted.reach.ceil(),
        words(&corrections),
        words(&stops),
    );
    Ok(Written {
        entries: [entries, corrections, stops].concat(),
        lines,
        warnings: fitted.assumptions(),
    })
}
