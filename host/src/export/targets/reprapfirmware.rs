//! RepRapFirmware.

use crate::export::error::ExportError;
use crate::export::geometry::{Each, Holds};
use crate::export::shape::{ArmShape, within_half_turn};
use crate::export::target::{Entry, Fitted, Target, Written, assumed_home, decimals};

/// Azimuths of the arms of X, Y and Z without a correction, degrees.
const AZIMUTHS: [f64; 3] = [-150.0, -30.0, 90.0];
/// Arms that differ by more than this make the forward kinematics differ from the inverse, mm.
const EQUAL: f64 = 0.001;

/// `M669 K10` and `M666`.
pub(crate) const REPRAPFIRMWARE: Target = Target {
    name: "reprapfirmware",
    title: "RepRapFirmware M669 K10",
    holds: Holds {
        fixed_azimuths: None,
        radii: Each::Shared,
        heights: Each::Arm,
        upper: Each::Arm,
        lower: Each::Arm,
        zeros: Each::Arm,
    },
    comment: ";",
    conventions: &[
        "X, Y and Z are arms 1, 2 and 3; the corrections X, Y and Z count from −150°, −30° and 90° and are as \
         large as it takes to keep the robot's x axis",
        "the joint angle is 0 with the upper arm horizontal and positive with the elbow up; the arm is at the \
         upper limit of A at its end stop, and M666 corrects that angle in degrees",
        "R is the base's radius less the platform's; H is the height of the motor axes above z = 0",
    ],
    source: "src/Movement/Kinematics/RotaryDeltaKinematics.cpp of RepRapFirmware",
    alternative: "a correction table (--for correction-table) or a G-code filter with all 24 parameters",
    write,
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let arms = &fitted.geometry.arms;
    let [first, ..] = arms;
    let axes = ["X", "Y", "Z"];
    let three = |value: fn(&ArmShape) -> f64| {
        let [a, b, c] = arms.each_ref().map(|arm| decimals(value(arm)));
        format!("{a}:{b}:{c}")
    };
    let mut corrections = [0.0; 3];
    for ((correction, arm), azimuth) in corrections.iter_mut().zip(arms).zip(AZIMUTHS) {
        *correction = within_half_turn(arm.azimuth - azimuth.to_radians());
    }
    // Up positive: the upper limit of the angle is where the joint angle is smallest.
    let [lowest, highest] = fitted.limits;
    let top = -fitted.home.into_iter().fold(f64::INFINITY, f64::min);
    let bottom = f64::min(-highest, top);
    let mut endstops = [0.0; 3];
    for ((endstop, arm), home) in endstops.iter_mut().zip(arms).zip(fitted.home) {
        *endstop = arm.zero - home - top;
    }
    let axis_values = |values: [f64; 3]| {
        let [x, y, z] = values.map(|angle| decimals(angle.to_degrees()));
        format!("X{x} Y{y} Z{z}")
    };
    let lines = format!(
        "M669 K10 U{} L{} H{} R{} {} A{}:{} B{:.1}\nM666 {}\n",
        three(|arm| arm.upper),
        three(|arm| arm.lower),
        three(|arm| arm.height),
        decimals(first.radius),
        axis_values(corrections),
        decimals(bottom.to_degrees()),
        decimals(top.to_degrees()),
        fitted.reach.ceil(),
        axis_values(endstops),
    );
    let mut entries = vec![Entry::length("M669 R", first.radius)];
    for ((axis, arm), (correction, endstop)) in axes
        .into_iter()
        .zip(arms)
        .zip(corrections.into_iter().zip(endstops))
    {
        entries.extend([
            Entry::length(format!("M669 U ({axis})"), arm.upper),
            Entry::length(format!("M669 L ({axis})"), arm.lower),
            Entry::length(format!("M669 H ({axis})"), arm.height),
            Entry::degrees(format!("M669 {axis}"), correction),
            Entry::degrees(format!("M666 {axis}"), endstop),
        ]);
    }
    let mut warnings: Vec<_> = assumed_home(fitted).into_iter().collect();
    if arms
        .iter()
        .any(|arm| (arm.upper - first.upper).abs() > EQUAL)
    {
        warnings.push(
            "The three upper arms differ. In the source that we read, RepRapFirmware's forward kinematics \
             takes the length of arm X for the heights of all three elbows. The inverse kinematics, which moves the \
             robot, is right; the position that is assumed after homing is off by about the difference of the \
             arms. After homing, begin with a move to a stated X, Y and Z, away from obstacles."
                .to_owned(),
        );
    }
    if lowest.abs() > std::f64::consts::FRAC_PI_2 || highest.abs() > std::f64::consts::FRAC_PI_2 {
        warnings.push(
            "RepRapFirmware computes joint angles from −90° to 90° only; [joints] goes further."
                .to_owned(),
        );
    }
    Ok(Written {
        entries,
        lines,
        warnings,
    })
}
