//! Marlin.

use crate::export::error::ExportError;
use crate::export::geometry::{TOWERS, to_decimals};
use crate::export::target::{Content, Entry, Fitted, Target, Written, words};
use delta_cal::robot::Drive;

/// What holds more of a robot with towers.
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
        "R is the distance of the towers from the centre less the platform's radius, DELTA_RADIUS_TRIM_TOWER 0",
        "H is the height of the nozzle at x = y = 0 after homing; M666 is how far each carriage moves down from its \
         end stop when it homes, 0 or negative",
        "S, the segments per second, is not written and stays as it is; M500 stores the values",
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
    let mut main = vec![
        Entry::length("M665 L", rod),
        Entry::length("M665 R", towers[0].radius),
        Entry::length("M665 H", height),
    ];
    let (mut trims, mut stops) = (Vec::new(), Vec::new());
    let corrections = fitted.geometry.tower_corrections();
    for (index, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
        main.push(Entry::degrees(format!("M665 {axis}"), corrections[index]));
        stops.push(Entry::length(
            format!("M666 {axis}"),
            height - endstops[index],
        ));
    }
    for (tower, letter) in towers.iter().zip(["A", "B", "C"]) {
        trims.push(Entry::length(format!("M665 {letter}"), tower.lower - rod));
    }
    let lines = format!(
        "M665 {} {}\nM666 {}\n",
        words(&main),
        words(&trims),
        words(&stops)
    );
    let mut warnings = fitted.assumptions();
    warnings.push(
        "With a bed probe Marlin takes H less the probe's z offset as the height after homing: add that offset \
         (M851 Z) to H."
            .to_owned(),
    );
    Ok(Written {
        entries: [main, trims, stops].concat(),
        lines,
        warnings,
    })
}
