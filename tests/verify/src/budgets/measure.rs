//! The figures of one build.

use super::figures::{Figure, Figures, figure};
use super::flash;
use delta_cal_verify::firmware::{Board, Clock, build_for_target, emulate};
use std::path::Path;

/// Everything that is measured of one build, with these further arguments of cargo.
pub(super) fn measure(directory: &Path, arguments: &[&str]) -> Result<Figures, String> {
    let programs = ["--bin", "measure", "--bin", "flash"];
    let programs = build_for_target(directory, &[&programs[..], arguments].concat())?;
    let output = emulate(Board::M4, Clock::Instructions, &programs.join("measure"))?;
    let mut figures = Figures::new();
    for line in output.lines() {
        match figure(line) {
            Some((item, figure)) => {
                figures.insert(item, figure);
            }
            None => println!("{line}"),
        }
    }
    let (flash, largest) = flash::of(&programs.join("flash"))?;
    figures.insert(
        "f32/flash".to_owned(),
        Figure {
            value: flash,
            unit: "bytes".to_owned(),
            words: "flash of a calibration: code and constants".to_owned(),
        },
    );
    println!("\nlargest symbols of the calibration path, bytes:");
    for (size, name) in largest {
        println!("  {size:>6}  {name}");
    }
    Ok(figures)
}
