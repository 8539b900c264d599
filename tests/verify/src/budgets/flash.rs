//! How much flash a program takes.

use object::{Object, ObjectSection, ObjectSymbol};
use std::path::Path;

/// What every firmware has: the start of `cortex-m-rt` and its default handlers.
const STARTUP: [&str; 6] = [
    "Reset",
    "main",
    "DefaultPreInit",
    "DefaultHandler_",
    "HardFault_",
    "HardFaultTrampoline",
];
/// How many of the largest symbols are named.
const LARGEST: usize = 10;

/// Bytes of code, constants and initial values, without vector table and startup; and the largest
/// symbols.
pub(super) fn of(program: &Path) -> Result<(u64, Vec<(u64, String)>), String> {
    let fault = |error: &dyn std::fmt::Display| format!("{}: {error}", program.display());
    let bytes = std::fs::read(program).map_err(|error| fault(&error))?;
    let file = object::File::parse(&*bytes).map_err(|error| fault(&error))?;
    let mut size = 0;
    for name in [".text", ".rodata", ".data"] {
        let section = file
            .section_by_name(name)
            .ok_or_else(|| fault(&format_args!("no section {name}")))?;
        size += section.size();
    }
    let mut symbols: Vec<(u64, String)> = file
        .symbols()
        .filter(|symbol| symbol.size() > 0 && in_section(&file, symbol, ".text"))
        .filter_map(|symbol| Some((symbol.size(), symbol.name().ok()?.to_owned())))
        .collect();
    let startup: u64 = symbols
        .iter()
        .filter(|(_, name)| STARTUP.contains(&name.as_str()))
        .map(|(size, _)| size)
        .sum();
    symbols.sort_unstable_by(|a, b| b.cmp(a));
    let largest = symbols
        .into_iter()
        .take(LARGEST)
        .map(|(size, name)| (size, format!("{:#}", rustc_demangle::demangle(&name))))
        .collect();
    Ok((size - startup, largest))
}

fn in_section<'a>(file: &object::File<'a>, symbol: &impl ObjectSymbol<'a>, section: &str) -> bool {
    symbol
        .section_index()
        .and_then(|index| file.section_by_index(index).ok())
        .is_some_and(|found| found.name() == Ok(section))
}
