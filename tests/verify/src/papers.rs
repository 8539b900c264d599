//! What a release contains of others: their licences, and the bill of materials as CycloneDX 1.5.

use delta_cal_verify::{at_root, run};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// What is delivered: package with features, target, and its own workspace if it has one.
const DELIVERED: [&str; 5] = [
    "--package delta-cal-host --features man --target {}",
    "--package delta-cal-c --target {}",
    "--package delta-cal-python --target {}",
    "--package delta-cal-web --target wasm32-unknown-unknown",
    "--manifest-path firmware-example/boards/pico2/Cargo.toml --target thumbv8m.main-none-eabihf",
];

/// Name and version.
type Key = (String, String);

struct Package {
    license: String,
    source: String,
    needs: BTreeSet<Key>,
}

/// Writes `THIRD-PARTY.txt` and `sbom.cdx.json`; the command is built for `target`.
///
/// # Errors
/// What could not be read or written.
pub(crate) fn write(target: &str, folder: &Path) -> Result<(), String> {
    let packages = packages(target)?;
    let save = |name: &str, text: String| {
        fs::write(folder.join(name), text).map_err(|error| format!("{name}: {error}"))
    };
    save("THIRD-PARTY.txt", licences(&packages)?)?;
    save("sbom.cdx.json", bill(&packages)?)
}

fn packages(target: &str) -> Result<BTreeMap<Key, Package>, String> {
    let mut packages = BTreeMap::<Key, Package>::new();
    for delivered in DELIVERED {
        let mut cargo = at_root("cargo");
        cargo.args("tree --locked --quiet --edges normal,no-proc-macro --prefix depth".split(' '));
        cargo.args(["--format", "|{p}|{l}|{r}"]);
        cargo.args(delivered.replace("{}", target).split(' '));
        let mut parents: Vec<Key> = Vec::new();
        for line in run(cargo)?.lines() {
            let fields: Vec<&str> = line.split('|').collect();
            let [depth, package, license, source] = fields[..] else {
                return Err(format!("cargo tree printed {line:?}"));
            };
            let (name, version) = package.split_once(" v").ok_or(line)?;
            let version = version.split(' ').next().unwrap_or_default();
            let key = (name.to_owned(), version.to_owned());
            parents.truncate(depth.parse().map_err(|_| line)?);
            if let Some(parent) = parents.last().and_then(|it| packages.get_mut(it)) {
                parent.needs.insert(key.clone());
            }
            packages.entry(key.clone()).or_insert_with(|| Package {
                // The separator of old manifests.
                license: license.replace('/', " OR "),
                source: source.trim_end_matches(" (*)").to_owned(),
                needs: BTreeSet::new(),
            });
            parents.push(key);
        }
    }
    Ok(packages)
}

fn is_own(name: &str) -> bool {
    name.starts_with("delta-cal")
}

/// A list of all packages, then each licence text once, below the packages that it belongs to.
fn licences(packages: &BTreeMap<Key, Package>) -> Result<String, String> {
    let mut list =
        "The programs and libraries of this release contain these packages:\n\n".to_owned();
    let mut texts = BTreeMap::<String, Vec<String>>::new();
    for ((name, version), package) in packages.iter().filter(|((name, _), _)| !is_own(name)) {
        let (license, source) = (&package.license, &package.source);
        let _ = writeln!(list, "{name} {version}: {license} ({source})");
        for text in licence_texts(&format!("{name}-{version}"))? {
            texts
                .entry(text)
                .or_default()
                .push(format!("{name} {version}"));
        }
    }
    list.push_str("\nand Rust's standard library, MIT OR Apache-2.0 (https://github.com/rust-lang/rust), whose static");
    list.push_str(" form for Linux contains musl, MIT (https://musl.libc.org).\n");
    for (text, packages) in texts {
        let _ = write!(
            list,
            "\n{}\n{}:\n\n{text}",
            "-".repeat(80),
            packages.join(", ")
        );
    }
    Ok(list)
}

/// The texts in a package's sources; of several licences to choose from, MIT's.
fn licence_texts(package: &str) -> Result<Vec<String>, String> {
    let folder = sources(package)?;
    let entries = fs::read_dir(&folder).map_err(|error| format!("{package}: {error}"))?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|it| it.path()).collect();
    let contains = |file: &Path, words: &[&str]| {
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .to_uppercase();
        words.iter().any(|word| name.contains(word))
    };
    files.retain(|it| contains(it, &["LICENSE", "LICENCE", "COPYING", "NOTICE"]) && it.is_file());
    files.sort();
    if files.iter().any(|it| contains(it, &["MIT"])) {
        files.retain(|it| contains(it, &["MIT", "NOTICE"]));
    }
    let read =
        |it: &PathBuf| fs::read_to_string(it).map(|text| text.trim().replace('\r', "") + "\n");
    files
        .iter()
        .map(read)
        .collect::<Result<_, _>>()
        .map_err(|error| format!("{package}: {error}"))
}

/// Where cargo keeps the sources of a package.
fn sources(package: &str) -> Result<PathBuf, String> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let registries = home.and_then(|it| fs::read_dir(it.join("registry/src")).ok());
    let folders = registries
        .into_iter()
        .flatten()
        .flatten()
        .map(|it| it.path().join(package));
    folders
        .into_iter()
        .find(|it| it.is_dir())
        .ok_or(format!("{package}: no sources"))
}

fn bill(packages: &BTreeMap<Key, Package>) -> Result<String, String> {
    let sums = checksums()?;
    let reference = |(name, version): &Key| format!("pkg:cargo/{name}@{version}");
    let (mut components, mut edges) = (Vec::new(), Vec::new());
    for (key, package) in packages {
        let sum = sums.get(key).map_or_else(String::new, |it| {
            format!(r#","hashes":[{{"alg":"SHA-256","content":"{it}"}}]"#)
        });
        let (name, version, license, purl) = (&key.0, &key.1, &package.license, reference(key));
        components.push(format!(
            r#"{{"type":"library","bom-ref":"{purl}","name":"{name}","version":"{version}","purl":"{purl}","licenses":[{{"expression":"{license}"}}]{sum}}}"#
        ));
        let needs: Vec<String> = package
            .needs
            .iter()
            .map(|it| format!("\"{}\"", reference(it)))
            .collect();
        edges.push(format!(
            r#"{{"ref":"{purl}","dependsOn":[{}]}}"#,
            needs.join(",")
        ));
    }
    Ok(format!(
        r#"{{"bomFormat":"CycloneDX","specVersion":"1.5","version":1,
"metadata":{{"component":{{"type":"application","name":"delta-cal","version":"{}"}}}},
"components":[
{}],
"dependencies":[
{}]}}
"#,
        env!("CARGO_PKG_VERSION"),
        components.join(",\n"),
        edges.join(",\n")
    ))
}

/// The checksums of both lock files.
fn checksums() -> Result<BTreeMap<Key, String>, String> {
    let mut sums = BTreeMap::new();
    for lock in ["Cargo.lock", "firmware-example/boards/pico2/Cargo.lock"] {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let text =
            fs::read_to_string(root.join(lock)).map_err(|error| format!("{lock}: {error}"))?;
        for package in text.split("[[package]]") {
            let value = |key: &str| {
                let line = package
                    .lines()
                    .find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
                line.map(|it| it.trim_matches('"').to_owned())
            };
            if let (Some(name), Some(version), Some(sum)) =
                (value("name"), value("version"), value("checksum"))
            {
                sums.insert((name, version), sum);
            }
        }
    }
    Ok(sums)
}
