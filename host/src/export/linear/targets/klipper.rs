//! Klipper.

use crate::export::linear::target::{LinearFitted, LinearTarget, warnings};
use crate::export::target::{Entry, Written};
use std::fmt::Write;

/// `[printer] kinematics: delta`.
pub(crate) const KLIPPER: LinearTarget = LinearTarget {
    name: "klipper",
    title: "Klipper delta",
    comment: "#",
    conventions: &[
        "stepper_a, stepper_b and stepper_c are towers 1, 2 and 3",
        "delta_radius is the distance of the towers from the centre less the platform's radius",
        "position_endstop is the height of the nozzle at x = y = 0 with that carriage at its end stop; each is \
         computed from the travel at the end stop (--home-mm)",
        "delete these options from the block that SAVE_CONFIG wrote at the end of the file: Klipper takes the ones \
         above it, and the block's own come back with the next SAVE_CONFIG",
    ],
    source: "klippy/kinematics/delta.py of Klipper",
    write,
};

fn write(fitted: &LinearFitted) -> Written {
    let geometry = &fitted.geometry;
    let endstops = geometry.endstops(&fitted.home);
    let mut entries = vec![Entry::length("delta_radius", geometry.radius)];
    let mut lines = format!("[printer]\ndelta_radius: {:.6}\n", geometry.radius);
    for (tower, letter) in ["a", "b", "c"].into_iter().enumerate() {
        let azimuth = geometry.azimuths[tower].to_degrees().rem_euclid(360.0);
        let (rod, endstop) = (geometry.rods[tower], endstops[tower]);
        let name = |key: &str| format!("stepper_{letter} {key}");
        entries.extend([
            Entry {
                name: name("angle"),
                value: azimuth,
                unit: "deg",
            },
            Entry::length(name("arm_length"), rod),
            Entry::length(name("position_endstop"), endstop),
        ]);
        let _ = write!(
            lines,
            "\n[stepper_{letter}]\nangle: {azimuth:.6}\narm_length: {rod:.6}\nposition_endstop: {endstop:.6}\n"
        );
    }
    Written {
        entries,
        lines,
        warnings: warnings(fitted),
    }
}
