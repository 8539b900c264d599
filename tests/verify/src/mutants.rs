//! Mutation testing of the core's numeric modules by `cargo-mutants`: every mutant that no test notices
//! must be explained in `tests/mutants.toml`. Of all files, or of those that are asked for.

use crate::check::{Check, attempt, command, output, root};
use std::collections::BTreeMap;

const EXPLAINED: &str = include_str!("../../mutants.toml");
const CONFIGURATION: &str = include_str!("../../../.cargo/mutants.toml");

/// Seconds: the tests take less, on a busy machine too; a mutant that loops without end is stopped.
const TIMEOUT: u32 = 300;

pub(crate) fn check(check: &mut Check) {
    if output("cargo mutants --version").is_none() {
        check.fail("cargo-mutants is missing. Install it: cargo install cargo-mutants".to_owned());
        return;
    }
    let mut explained = match explained() {
        Ok(explained) => explained,
        Err(error) => return check.fail(format!("tests/mutants.toml: {error}")),
    };
    let files = std::mem::take(&mut check.files);
    if let Some(missing) = files.iter().find(|file| !root().join(file).is_file()) {
        return check.fail(format!("there is no file {missing}"));
    }
    explained.retain(|name, _| is_of(name, &files));
    // cargo-mutants' own run without a mutation would be of the mutated package alone, which has no test of most
    // of these names.
    let Some(tests) = tests(CONFIGURATION) else {
        return check.fail(".cargo/mutants.toml names no tests".to_owned());
    };
    if let Err(error) = attempt(&format!("cargo test --quiet {tests}")) {
        return check.fail(format!("without a mutation: {error}"));
    }
    let chosen: String = files.iter().flat_map(|file| [" --file ", file]).collect();
    let line = format!(
        "cargo mutants --package delta-cal --baseline=skip --timeout={TIMEOUT} --output target{chosen}"
    );
    println!("$ {line}");
    // In a folder of its own: what is left of a mutant in a shared one would pass for a build of these sources.
    let status = command(&line).env_remove("CARGO_TARGET_DIR").status();
    let code = status.ok().and_then(|status| status.code());
    // 2 and 3: some survive, or take too long; which ones may is decided below. Anything else is no whole run.
    if !matches!(code, Some(0 | 2 | 3)) {
        return check.fail(format!("{line}: ended early"));
    }
    let missed = root().join("target/mutants.out/missed.txt");
    match std::fs::read_to_string(&missed) {
        Ok(missed) => judge(check, &missed, &explained),
        Err(error) => check.fail(format!("{}: {error}", missed.display())),
    }
}

/// The tests that are run against a mutant, as arguments of `cargo test`.
fn tests(configuration: &str) -> Option<String> {
    let table: toml::Table = configuration.parse().ok()?;
    let words = |key: &str, before: &str| {
        let words = table.get(key)?.as_array()?.iter();
        let words = words.map(|word| Some(format!("{before}{}", word.as_str()?)));
        words.collect::<Option<Vec<_>>>()
    };
    let mut all = words("test_package", "--package=")?;
    all.extend(words("additional_cargo_args", "")?);
    Some(all.join(" "))
}

/// Mutants that make no difference: the name without line and column, and how many of that name there
/// are. They are grouped by reason.
fn explained() -> Result<BTreeMap<String, u32>, String> {
    let table: toml::Table = EXPLAINED
        .parse()
        .map_err(|error: toml::de::Error| error.to_string())?;
    let groups = table.get("group").and_then(toml::Value::as_array);
    let mut explained: BTreeMap<String, u32> = BTreeMap::new();
    for group in groups.ok_or("there is no [[group]]")? {
        let reason = group.get("reason").and_then(toml::Value::as_str);
        if reason.is_none_or(|reason| reason.trim().is_empty()) {
            return Err("a group without a reason".to_owned());
        }
        let mutants = group.get("mutants").and_then(toml::Value::as_table);
        for (name, count) in mutants.ok_or("a group without mutants")? {
            let count = count.as_integer().map(u32::try_from);
            let count = count.ok_or_else(|| format!("{name}: how many?"))?;
            *explained.entry(name.clone()).or_default() += count.map_err(|e| e.to_string())?;
        }
    }
    Ok(explained)
}

/// Whether a mutant is one of these files', or there are none.
fn is_of(name: &str, files: &[String]) -> bool {
    files.is_empty()
        || files
            .iter()
            .any(|file| name.split(':').next() == Some(file))
}

/// Every name in the list of survivors against how often it is explained.
fn judge(check: &mut Check, missed: &str, explained: &BTreeMap<String, u32>) {
    let mut survivors: BTreeMap<String, u32> = BTreeMap::new();
    for name in missed.lines() {
        *survivors.entry(without_place(name)).or_insert(0) += 1;
    }
    for (name, count) in &survivors {
        let known = explained.get(name).copied().unwrap_or(0);
        if *count > known {
            check.fail(format!(
                "{count} mutants survive, {known} explained in tests/mutants.toml: {name}"
            ));
        }
    }
    for (name, count) in explained {
        let found = survivors.get(name).copied().unwrap_or(0);
        if found < *count {
            println!("no longer survives, remove it from tests/mutants.toml: {name}");
        }
    }
    println!("{} mutants survive", survivors.values().sum::<u32>());
}

/// `core/src/real.rs:72:18: replace …` without line and column, which move with every change.
fn without_place(name: &str) -> String {
    let mut parts = name.splitn(4, ':');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(file), Some(_), Some(_), Some(what)) => format!("{file}:{what}"),
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_well_formed_and_names_files_that_exist() {
        let explained = explained().unwrap_or_default();
        assert!(!explained.is_empty());
        for name in explained.keys() {
            let file = name.split(':').next().unwrap_or_default();
            assert!(root().join(file).is_file(), "{name}");
        }
    }

    #[test]
    fn the_tests_are_those_of_the_configuration() {
        let tests = tests(CONFIGURATION).unwrap_or_default();
        assert!(tests.starts_with("--package=delta-cal --package=delta-cal-tests --lib --test="));
    }

    #[test]
    fn explanations_of_other_files_are_not_judged() {
        let name = "core/src/a.rs: replace + with - in f";
        let [own, other] = ["core/src/a.rs", "core/src/b.rs"].map(str::to_owned);
        assert!(is_of(name, &[]));
        assert!(is_of(name, &[other.clone(), own]));
        assert!(!is_of(name, &[other]));
    }

    #[test]
    fn survivors_beyond_the_explained_ones_fail() {
        let explained = BTreeMap::from([("core/src/a.rs: replace + with - in f".to_owned(), 1)]);
        let one = "core/src/a.rs:7:20: replace + with - in f\n";
        let mut check = Check::default();
        judge(&mut check, one, &explained);
        judge(&mut check, "", &explained);
        assert!(check.into_failures().is_empty());
        let mut check = Check::default();
        judge(
            &mut check,
            &format!("{one}core/src/a.rs:9:1: replace + with - in f\n"),
            &explained,
        );
        judge(
            &mut check,
            "core/src/b.rs:7:20: replace + with - in f\n",
            &explained,
        );
        assert_eq!(check.into_failures().len(), 2);
    }
}
