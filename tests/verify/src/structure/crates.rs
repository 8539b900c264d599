//! Where the workspace's crates begin.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Where crates begin, relative to the repository's root.
#[derive(Debug, Default)]
pub(super) struct Roots {
    /// The root files of all crates: libraries, programs, tests, benchmarks, examples.
    pub(super) files: Vec<PathBuf>,
    /// Folders of which a manifest lists the programs: a file that is a module of none is never compiled.
    pub(super) listed: Vec<PathBuf>,
}

impl Roots {
    /// The files in the folders whose programs are listed that are not among those which were read.
    pub(super) fn left_out(&self, repository: &Path, read: &BTreeSet<PathBuf>) -> Vec<PathBuf> {
        let mut left_out = Vec::new();
        let mut folders = self.listed.clone();
        while let Some(folder) = folders.pop() {
            for path in entries(repository, &folder) {
                if repository.join(&path).is_dir() {
                    folders.push(path);
                } else if is_rust(&path) && !read.contains(&path) {
                    left_out.push(path);
                }
            }
        }
        left_out
    }
}

pub(super) fn roots(repository: &Path) -> Result<Roots, String> {
    let table = manifest(repository)?;
    // What is excluded is a workspace of its own, and no less a crate of this repository.
    let packages = ["members", "exclude"]
        .into_iter()
        .filter_map(|key| table.get("workspace")?.get(key)?.as_array())
        .flatten()
        .filter_map(toml::Value::as_str);
    let mut roots = Roots::default();
    for package in packages {
        let found = &mut roots.files;
        let before = found.len();
        for file in ["src/lib.rs", "src/main.rs"] {
            let path = Path::new(package).join(file);
            if repository.join(&path).is_file() {
                found.push(path);
            }
        }
        for folder in ["src/bin", "benches", "examples", "fuzz_targets"] {
            programs(repository, &Path::new(package).join(folder), found);
        }
        let tests = Path::new(package).join("tests");
        match listed_tests(&manifest(&repository.join(package))?) {
            Some(paths) => {
                found.extend(paths.iter().map(|path| Path::new(package).join(path)));
                roots.listed.push(tests);
            }
            None => programs(repository, &tests, found),
        }
        if found.len() == before {
            return Err(format!("{package} holds no crate"));
        }
    }
    Ok(roots)
}

fn manifest(folder: &Path) -> Result<toml::Table, String> {
    let path = folder.join("Cargo.toml");
    let fault = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let text = fs::read_to_string(&path).map_err(|error| fault(&error))?;
    text.parse().map_err(|error| fault(&error))
}

/// The test programs of a package that says `autotests = false`.
fn listed_tests(manifest: &toml::Table) -> Option<Vec<&str>> {
    let automatic = manifest.get("package")?.get("autotests")?.as_bool()?;
    let tests = manifest.get("test").and_then(toml::Value::as_array);
    let paths = tests.into_iter().flatten();
    let paths = paths.filter_map(|test| test.get("path")?.as_str());
    (!automatic).then(|| paths.collect())
}

/// Each file of a folder, and of each folder in it `main.rs`.
fn programs(repository: &Path, folder: &Path, found: &mut Vec<PathBuf>) {
    for path in entries(repository, folder) {
        let main = path.join("main.rs");
        if is_rust(&path) {
            found.push(path);
        } else if repository.join(&main).is_file() {
            found.push(main);
        }
    }
}

/// What a folder holds, in the order of names.
fn entries(repository: &Path, folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> = fs::read_dir(repository.join(folder))
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| folder.join(entry.file_name()))
        .collect();
    entries.sort_unstable();
    entries
}

fn is_rust(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "rs")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_crate_is_found() {
        let found = roots(&crate::check::root()).unwrap_or_default().files;
        for path in [
            "core/src/lib.rs",
            "host/src/main.rs",
            "c/tests/fixture/main.rs",
            "c/tests/misuse.rs",
            "tests/tests/core_alone.rs",
            "tests/benches/poses.rs",
            "tests/fuzz/programs/fuzz_targets/store.rs",
            "tests/target/src/bin/measure/main.rs",
        ] {
            assert!(found.contains(&PathBuf::from(path)), "{path}: {found:?}");
        }
    }
    #[test]
    fn a_file_that_is_a_module_of_no_listed_program_is_found() {
        let root = crate::check::root();
        let read =
            |table: &str| listed_tests(&table.parse().unwrap_or_default()).map(|all| all.len());
        assert_eq!(
            read("package.autotests = false\n[[test]]\npath = \"a\""),
            Some(1)
        );
        assert_eq!(read("package.autotests = true"), None);
        assert_eq!(read("package.name = \"a\""), None);
        let roots = Roots {
            files: Vec::new(),
            listed: vec!["host/tests".into()],
        };
        let read = BTreeSet::from(["host/tests/it/main.rs".into()]);
        let left_out = roots.left_out(&root, &read);
        assert!(left_out.contains(&"host/tests/it/device.rs".into()));
        assert!(!left_out.contains(&"host/tests/it/main.rs".into()));
        assert!(!left_out.contains(&"host/tests/it/linuxcnc/private.sh".into()));
    }
}
