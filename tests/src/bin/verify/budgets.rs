//! What the core costs on a Cortex-M4F, against `target-tests/budgets.toml`.

mod flash;
mod panic_free;
mod tables;

use crate::check::Check;
use delta_cal_tests::firmware::{Board, Clock, build_for_target, emulate};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const BUDGETS: &str = include_str!("../../../../target-tests/budgets.toml");

/// The file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Budgets {
    budget: Vec<Budget>,
    peer: Vec<Peer>,
}

/// What an item may cost, and what it did when the limit was last raised.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Budget {
    item: String,
    limit: u64,
    measured: u64,
}

/// Another solver, measured elsewhere.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Peer {
    name: String,
    at_20: String,
    at_60: String,
    at_1000: String,
}

/// One line that the firmware wrote.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Figure {
    value: u64,
    unit: String,
    words: String,
}

type Figures = BTreeMap<String, Figure>;

pub(crate) fn check(check: &mut Check) {
    let budgets: Budgets = match toml::from_str(BUDGETS) {
        Ok(budgets) => budgets,
        Err(error) => return check.fail(format!("budgets.toml: {error}")),
    };
    match measure(&directory("firmware")) {
        Err(error) => check.fail(error),
        Ok(figures) => {
            tables::budgets(check, &budgets.budget, &figures);
            tables::rest(&budgets.budget, &figures);
            tables::document(check, &figures);
            tables::peers(check, &budgets.peer, &figures);
        }
    }
    panic_free::check(check, &directory("firmware"));
}

/// Beside the directory that this program was built in.
pub(crate) fn directory(name: &str) -> PathBuf {
    std::env::current_exe()
        .ok()
        .as_deref()
        .and_then(Path::parent)
        .and_then(Path::parent)
        .unwrap_or(Path::new("target"))
        .join(name)
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

/// `MEASURED <item> <value> <unit>, <words>`
fn figure(line: &str) -> Option<(String, Figure)> {
    let (item, rest) = line.strip_prefix("MEASURED ")?.split_once(' ')?;
    let (value, rest) = rest.split_once(' ')?;
    let (unit, words) = rest.split_once(", ")?;
    let figure = Figure {
        value: value.parse().ok()?,
        unit: unit.to_owned(),
        words: words.to_owned(),
    };
    Some((item.to_owned(), figure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_firmware_are_read() {
        let read = Figure {
            value: 451,
            unit: "instructions".to_owned(),
            words: "forward, worst".to_owned(),
        };
        assert_eq!(
            figure("MEASURED f32/forward 451 instructions, forward, worst"),
            Some(("f32/forward".to_owned(), read))
        );
        assert_eq!(figure("measured nothing"), None);
    }

    #[test]
    fn the_file_is_read() {
        let found = toml::from_str::<Budgets>(BUDGETS).map(|file| {
            let mut budgets = file.budget.iter();
            budgets.any(|budget| budget.item == "f32/forward" && budget.limit == 600)
        });
        assert_eq!(found, Ok(true));
    }
}
