//! Marlin.

use crate::export::linear::target::{LinearFitted, LinearTarget, warnings};
use crate::export::target::{Entry, Written, decimals};

/// `M665` and `M666`.
pub(crate) const MARLIN: LinearTarget = LinearTarget {
    name: "marlin",
    title: "Marlin M665",
    comment: ";",
    conventions: &[
        "X, Y and Z are towers 1, 2 and 3; the trims X, Y and Z of M665 count from 210°, 330° and 90°, \
         counter-clockwise; A, B and C are added to the rod L of each tower",
        "R is the distance of the towers from the centre less the platform's radius, DELTA_RADIUS_TRIM_TOWER 0",
        "H is the height of the nozzle at x = y = 0 after homing; M666 is how far each carriage moves down from its \
         end stop when it homes, 0 or negative",
        "S, the segments per second, is left as it is: leave the word out; M500 stores the values",
    ],
    source: "Marlin/src/module/delta.cpp, motion.cpp, gcode/calibrate/M665.cpp and M666.cpp of Marlin 2",
    write,
};

fn write(fitted: &LinearFitted) -> Written {
    let geometry = &fitted.geometry;
    let endstops = geometry.endstops(&fitted.home);
    let corrections = geometry.corrections();
    // No carriage moves up from its end stop.
    let height = endstops.into_iter().fold(f64::INFINITY, f64::min);
    let rod = geometry.rods.iter().sum::<f64>() / 3.0;
    let rod = (rod * 1e4).round() / 1e4;
    let letters = |names: [&str; 3], values: [f64; 3]| {
        let mut words = Vec::new();
        for (name, value) in names.into_iter().zip(values) {
            words.push(format!("{name}{}", decimals(value)));
        }
        words.join(" ")
    };
    let axes = ["X", "Y", "Z"];
    let trims = geometry.rods.map(|own| own - rod);
    let lines = format!(
        "M665 L{} R{} H{} {} {}\nM666 {}\n",
        decimals(rod),
        decimals(geometry.radius),
        decimals(height),
        letters(axes, corrections.map(f64::to_degrees)),
        letters(["A", "B", "C"], trims),
        letters(axes, endstops.map(|endstop| height - endstop)),
    );
    let mut entries = vec![
        Entry::length("M665 L", rod),
        Entry::length("M665 R", geometry.radius),
        Entry::length("M665 H", height),
    ];
    for (tower, (axis, trim)) in axes.into_iter().zip(["A", "B", "C"]).enumerate() {
        entries.extend([
            Entry::degrees(format!("M665 {axis}"), corrections[tower]),
            Entry::length(format!("M665 {trim}"), trims[tower]),
            Entry::length(format!("M666 {axis}"), height - endstops[tower]),
        ]);
    }
    let mut warnings = warnings(fitted);
    warnings.push(
        "With a bed probe Marlin takes H less the probe's z offset as the height after homing: add that offset \
         (M851 Z) to H."
            .to_owned(),
    );
    Written {
        entries,
        lines,
        warnings,
    }
}
