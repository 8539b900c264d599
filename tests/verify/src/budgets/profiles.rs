//! The core in a user's profile: generic code is compiled where it is used, with the levels that stand there.

use super::measure::measure;
use super::{panic_free, tables};
use crate::check::Check;
use std::path::Path;

const LEVELS: [&str; 3] = ["3", "s", "z"];
const LINK_TIME: [&str; 3] = ["off", "thin", "fat"];
/// What is shown of a build, beside the panic paths.
const ITEMS: [&str; 7] = [
    "f32/forward",
    "f32/add-mean",
    "f32/outcome-20-mean",
    "f32/outcome-20-step",
    "f32/joint-outcome-20-mean",
    "f32/stack",
    "f32/flash",
];

pub(super) fn check(check: &mut Check, directory: &Path) {
    let mut rows = Vec::new();
    for level in LEVELS {
        for link_time in LINK_TIME {
            let level_key = format!("profile.firmware.opt-level={}", value(level));
            let link_key = format!("profile.firmware.lto={}", value(link_time));
            let arguments = ["--config", &level_key, "--config", &link_key];
            let directory = directory.join(format!("{level}-{link_time}"));
            match row(&directory, &arguments) {
                Ok(cells) => rows.push((format!("{level}, {link_time}"), cells)),
                Err(error) => check.fail(format!("{level}, {link_time}: {error}")),
            }
        }
    }
    println!(
        "\n| opt-level, lto | functions with a panic path | forward | a sample | arms apart: solve | its longest \
         step | joint: solve | stack, bytes | flash |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (words, cells) in rows {
        tables::row(check, &words, &cells);
    }
}

/// A level as TOML has it.
fn value(level: &str) -> String {
    if level.parse::<u8>().is_ok() {
        level.to_owned()
    } else {
        format!("\"{level}\"")
    }
}

fn row(directory: &Path, arguments: &[&str]) -> Result<Vec<String>, String> {
    let (functions, culprits) = panic_free::prove(directory, arguments)?;
    for culprit in &culprits {
        println!("a panic path survives in {culprit}");
    }
    let mut cells = vec![format!("{} of {functions}", culprits.len())];
    let figures = measure(directory, arguments)?;
    cells.extend(ITEMS.map(|item| tables::of(&figures, item)));
    Ok(cells)
}
