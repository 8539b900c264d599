//! The robot file's text, with a comment for what a person may want to change.

use super::linear::LinearPrinter;
use super::rotary::RotaryPrinter;
use std::fmt::Write;

/// A rod whose length is no whole number of these was not bought so, mm.
const ROUND: f64 = 0.1;

/// Whether a length is one that somebody made, and not the result of a calibration.
pub(super) fn is_round(length: f64) -> bool {
    let parts = length / ROUND;
    (parts - parts.round()).abs() < 1e-6
}

/// What stands in the file beside the geometry.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside<'a> {
    /// The controller's name.
    pub(super) controller: &'a str,
    /// The configuration's name.
    pub(super) source: &'a str,
    /// The range of the joints, in the file's unit.
    pub(super) limits: [f64; 2],
    /// Whether the measurements hold heights above the bed.
    pub(super) heights: bool,
    /// What is known, in sentences.
    pub(super) notes: &'a [String],
}

fn head(beside: &Beside<'_>) -> String {
    let source: String = beside.source.replace(char::is_control, "?");
    let mut text = format!(
        "# Imported by delta-cal {} from {source}: the robot as {} is told that it is.\n\
         # delta-cal calibrate finds what it is really like.\n",
        env!("CARGO_PKG_VERSION"),
        beside.controller
    );
    for note in beside.notes {
        let _ = writeln!(text, "# {note}");
    }
    text
}

fn lines(text: &mut String, section: &str, lines: &[(&str, f64, &str)]) {
    let _ = writeln!(text, "\n{section}");
    for (key, value, meaning) in lines {
        let entry = format!("{key} = {value:?}");
        let _ = writeln!(text, "{entry:<26} # {meaning}");
    }
}

/// Of a printer with towers.
pub(super) fn linear(printer: &LinearPrinter, beside: &Beside<'_>) -> String {
    let mut text = head(beside);
    text.push_str(
        "# The travel s of a carriage is its height above z = 0 of the controller, rod's upper end.\n",
    );
    let [a, b, c] = printer.rods;
    if a.total_cmp(&b).is_eq() && b.total_cmp(&c).is_eq() {
        text.push_str("\n[nominal]\nkind = \"linear\"\n");
        let [first, second, third] = printer.azimuths;
        let _ = writeln!(text, "tower_radius_mm = {:?}", printer.radius);
        let _ = writeln!(text, "tower_deg = [{first:?}, {second:?}, {third:?}]");
        let _ = writeln!(text, "forearm_mm = {a:?}");
    } else {
        for (azimuth, rod) in printer.azimuths.into_iter().zip(printer.rods) {
            let (sine, cosine) = azimuth.to_radians().sin_cos();
            let (x, y) = (printer.radius * cosine, printer.radius * sine);
            let _ = write!(
                text,
                "\n[[arm]]\ndx_mm = {x:?}\ndy_mm = {y:?}\ndz_mm = 0.0\nlean_x_deg = 0.0\nlean_y_deg = 0.0\n\
                 scale = 1.0\nlb_mm = {rod:?}\n"
            );
        }
    }
    let [low, high] = beside.limits;
    lines(
        &mut text,
        "[joints]",
        &[
            ("min_mm", low, "lowest carriage that the printed area needs"),
            ("max_mm", high, "highest end stop"),
        ],
    );
    lines(
        &mut text,
        "[tolerance]",
        &[
            (
                "length_mm",
                0.5,
                "one sigma of a tower's place and of a rod; 2 if nobody",
            ),
            (
                "angle_deg",
                0.17,
                "ever measured delta_radius. Lean of a tower: 3 in 1000",
            ),
            ("zero_mm", 5.0, "end stops"),
            ("scale", 0.001, "belts: 1 in 1000"),
        ],
    );
    noise(&mut text, "joint_mm", beside);
    text
}

/// Of a robot whose motors turn its arms.
pub(super) fn rotary(printer: &RotaryPrinter, beside: &Beside<'_>) -> String {
    let mut text = head(beside);
    text.push_str(
        "# The joint angle is 0 with the upper arm level, and positive downwards: Klipper's with the other sign.\n",
    );
    let lengths = printer.upper.into_iter().zip(printer.lower);
    for (azimuth, (upper, lower)) in printer.azimuths.into_iter().zip(lengths) {
        let (sine, cosine) = azimuth.to_radians().sin_cos();
        let (x, y) = (printer.radius * cosine, printer.radius * sine);
        let _ = write!(
            text,
            "\n[[arm]]\ndx_mm = {x:?}\ndy_mm = {y:?}\ndz_mm = {:?}\ntheta_deg = {azimuth:?}\nalpha_deg = 0.0\n\
             la_x_mm = {upper:?}\nla_y_mm = 0.0\nlb_mm = {lower:?}\n",
            printer.height
        );
    }
    let [low, high] = beside.limits;
    lines(
        &mut text,
        "[joints]",
        &[
            ("min_deg", low, "highest end stop"),
            ("max_deg", high, "change it if the arms cannot get there"),
        ],
    );
    lines(
        &mut text,
        "[tolerance]",
        &[
            ("length_mm", 0.5, "one sigma of every length"),
            ("angle_deg", 0.2, "one sigma of every angle"),
        ],
    );
    noise(&mut text, "joint_deg", beside);
    text
}

fn noise(text: &mut String, joint: &str, beside: &Beside<'_>) {
    lines(
        text,
        "[noise]",
        &[
            (
                "height_mm",
                0.1,
                "one sigma of a height: probe or paper, and a bed that is not flat",
            ),
            (
                "distance_mm",
                0.2,
                "one sigma of a distance on a printed object: calliper, and the print",
            ),
            (joint, 0.0, "steps are counted"),
        ],
    );
    if beside.heights {
        text.push_str(
            "\n# The controller's frame: z = 0 is the bed, and z is at right angles to it.",
        );
        lines(
            text,
            "[planes.plane]",
            &[
                ("z_mm", 0.0, "the bed that the heights were measured above"),
                ("sigma_mm", 0.001, "exact, for it says what z = 0 is"),
                ("tilt_deg", 0.001, "and what level is"),
            ],
        );
    }
}
