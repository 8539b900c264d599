//! RepRapFirmware.

use crate::export::linear::target::{LinearFitted, LinearTarget, warnings};
use crate::export::target::{Entry, Written, decimals};

const AXES: [&str; 3] = ["X", "Y", "Z"];

/// `M665` and `M666`.
pub(crate) const REPRAPFIRMWARE: LinearTarget = LinearTarget {
    name: "reprapfirmware",
    title: "RepRapFirmware M665",
    comment: ";",
    conventions: &[
        "X, Y and Z are towers 1, 2 and 3; the corrections X, Y and Z of M665 count from 210°, 330° and 90°, \
         counter-clockwise",
        "R is the distance of the towers from the centre less the platform's radius; L has a rod for each tower",
        "H is the height of the nozzle at x = y = 0 with all carriages at their end stops, M666 what each end stop \
         is higher; their mean is 0",
        "B is the printable radius; M666 A and B, the tilt of the bed, are 0",
    ],
    source: "src/Movement/Kinematics/LinearDeltaKinematics.cpp of RepRapFirmware",
    write,
};

fn write(fitted: &LinearFitted) -> Written {
    let geometry = &fitted.geometry;
    let endstops = geometry.endstops(&fitted.home);
    let corrections = geometry.corrections();
    let height = endstops.iter().sum::<f64>() / 3.0;
    let axis_values = |values: [f64; 3]| {
        let [x, y, z] = values.map(decimals);
        format!("X{x} Y{y} Z{z}")
    };
    let [a, b, c] = geometry.rods.map(decimals);
    let lines = format!(
        "M665 L{a}:{b}:{c} R{} H{} B{:.1} {}\nM666 {} A0 B0\n",
        decimals(geometry.radius),
        decimals(height),
        fitted.reach.ceil(),
        axis_values(corrections.map(f64::to_degrees)),
        axis_values(endstops.map(|endstop| endstop - height)),
    );
    let mut entries = vec![
        Entry::length("M665 R", geometry.radius),
        Entry::length("M665 H", height),
    ];
    for (tower, axis) in AXES.into_iter().enumerate() {
        entries.extend([
            Entry::length(format!("M665 L ({axis})"), geometry.rods[tower]),
            Entry::degrees(format!("M665 {axis}"), corrections[tower]),
            Entry::length(format!("M666 {axis}"), endstops[tower] - height),
        ]);
    }
    Written {
        entries,
        lines,
        warnings: warnings(fitted),
    }
}
