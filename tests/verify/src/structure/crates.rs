//! Where the workspace's crates begin.

use std::fs;
use std::path::{Path, PathBuf};

/// The root files of all crates, relative to the repository's root: libraries, programs, tests,
/// benchmarks, examples.
pub(super) fn roots(repository: &Path) -> Result<Vec<PathBuf>, String> {
    let manifest = repository.join("Cargo.toml");
    let fault = |error: &dyn std::fmt::Display| format!("{}: {error}", manifest.display());
    let text = fs::read_to_string(&manifest).map_err(|error| fault(&error))?;
    let table: toml::Table = text.parse().map_err(|error| fault(&error))?;
    // What is excluded is a workspace of its own, and no less a crate of this repository.
    let packages = ["members", "exclude"]
        .into_iter()
        .filter_map(|key| table.get("workspace")?.get(key)?.as_array())
        .flatten()
        .filter_map(toml::Value::as_str);
    let mut found = Vec::new();
    for package in packages {
        let before = found.len();
        for file in ["src/lib.rs", "src/main.rs"] {
            let path = Path::new(package).join(file);
            if repository.join(&path).is_file() {
                found.push(path);
            }
        }
        for folder in ["src/bin", "tests", "benches", "examples", "fuzz_targets"] {
            programs(repository, &Path::new(package).join(folder), &mut found);
        }
        if found.len() == before {
            return Err(format!("{package} holds no crate"));
        }
    }
    Ok(found)
}

/// Each file of a folder, and of each folder in it `main.rs`.
fn programs(repository: &Path, folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(repository.join(folder))
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| folder.join(entry.file_name()))
        .collect();
    entries.sort_unstable();
    for path in entries {
        let main = path.join("main.rs");
        if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        } else if repository.join(&main).is_file() {
            found.push(main);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_crate_is_found() {
        let found = roots(&crate::check::root()).unwrap_or_default();
        for path in [
            "core/src/lib.rs",
            "host/src/main.rs",
            "host/tests/simulate/main.rs",
            "tests/benches/poses.rs",
            "tests/fuzz/fuzz_targets/store.rs",
            "tests/target/src/bin/measure/main.rs",
        ] {
            assert!(found.contains(&PathBuf::from(path)), "{path}: {found:?}");
        }
    }
}
