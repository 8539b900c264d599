//! Marlin.

use crate::export::error::ExportError;
use crate::export::geometry::{TOWERS, to_decimals};
use crate::export::target::{AXES, Content, Entry, Fitted, Target, Written, words};
use delta_cal::robot::Drive;

/// The alternative for a linear Delta.
pub(super) const ALTERNATIVE: &str =
    "a correction table (--for correction-table), or belts whose steps per mm hold the scale";

/// `M665` and `M666`.
pub(crate) const MARLIN: Target = Target {
    name: "marlin",
    title: "Marlin M665",
    drive: Some(Drive::Linear),
    content: Content::Fitted {
        holds: TOWERS,
        write,
    },
    comment: ";",
    conventions: &[
        "X, Y and Z are towers 1, 2 and 3; the trims X, Y and Z of M665 count from 210°, 330° and 90°, \
         counter-clockwise; A, B and C are added to the rod L of each tower",
        "R is the distance of the towers from the centre minus the platform radius, with DELTA_RADIUS_TRIM_TOWER 0",
        "H is the height of the nozzle at x = y = 0 after homing; M666 is the move of each carriage from its end stop \
         when it homes, 0 or negative (down)",
        "S, the segments per second, is not changed; M500 stores the values",
    ],
    source: "Marlin/src/module/delta.cpp, motion.cpp, gcode/calibrate/M665.cpp and M666.cpp of Marlin 2",
    alternative: ALTERNATIVE,
};

#[allow(clippy::unnecessary_wraps)] // the type of every target's function
fn write(fitted: &Fitted) -> Result<Written, ExportError> {
    let towers = &fitted.geometry.arms;
    let endstops = fitted.tower_endstops();
    // No carriage moves up from its end stop.
    let height = endstops.into_iter().fold(f64::INFINITY, f64::min);
    let rod = to_decimals(towers.iter().map(|tower| tower.lower).sum::<f64>() / 3.0);
    let corrections = fitted.geometry.tower_corrections();
    let mut main = vec![
        Entry::length("M665 L", rod),
        Entry::length("M665 R", towers[0].radius),
        Entry::length("M665 H", height),
    ];
    let mut stops = Vec::new();
    for ((axis, correction), endstop) in AXES.into_iter().zip(corrections).zip(endstops) {
        main.push(Entry::degrees(format!("M665 {axis}"), correction));
        stops.push(Entry::length(format!("M666 {axis}"), height - endstop));
    }
    for (tower, letter) in towers.iter().zip(["A", "B", "C"]) {
        main.push(Entry::length(format!("M665 {letter}"), tower.lower - rod));
    }
    let mut warnings = fitted.assumptions();
    warnings.push(
        "With a bed probe Marlin takes H minus the probe's z offset as the height after homing: add that offset \
         (M851 Z) to H."
            .to_owned(),
    );
    Ok(Written {
        lines: format!("M665 {}\nM666 {}\n", words(&main), words(&stops)),
        entries: [main, stops].concat(),
        warnings,
    })
}
