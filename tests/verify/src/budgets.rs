//! What the core costs on a Cortex-M4F, against `tests/target/budgets.toml`.

mod figures;
mod flash;
mod panic_free;
mod tables;

use crate::check::{Check, directory};
use delta_cal_verify::firmware::{Board, Clock, build_for_target, emulate};
use figures::{Budgets, Figure, Figures, figure};
use std::path::Path;

const BUDGETS: &str = include_str!("../../target/budgets.toml");

pub(crate) fn check(check: &mut Check) {
    let budgets = match Budgets::read(BUDGETS) {
        Ok(budgets) => budgets,
        Err(error) => return check.fail(format!("budgets.toml: {error}")),
    };
    match measure(&directory("firmware")) {
        Err(error) => check.fail(error),
        Ok(figures) => {
            tables::budgets(check, &budgets.budgets, &figures);
            tables::rest(&budgets.budgets, &figures);
            tables::document(check, &figures);
            tables::peers(check, &budgets.peers, &figures);
        }
    }
    panic_free::check(check, &directory("firmware"));
}

/// Everything that is measured of one build.
fn measure(directory: &Path) -> Result<Figures, String> {
    let programs = build_for_target(directory, &[])?;
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
