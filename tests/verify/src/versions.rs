//! The oldest Rust: what `rust-version` states must do for every dependency.

use crate::check::{Check, output, root};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// What users build.
const PACKAGES: [&str; 4] = [
    "delta-cal",
    "delta-cal-protocol",
    "delta-cal-host",
    "delta-cal-firmware-example",
];

/// No dependency demands a newer Rust than is stated here.
pub(crate) fn check(check: &mut Check) {
    let metadata = output("cargo metadata --format-version 1 --all-features --locked");
    let Some(metadata) = metadata.and_then(|text| serde_json::from_str::<Value>(&text).ok()) else {
        return check.fail("cargo metadata failed".to_owned());
    };
    let mut seen = 0;
    for package in PACKAGES {
        match dependencies(&metadata, package) {
            Some((stated, dependencies)) => {
                seen += dependencies.len();
                for (name, demanded) in dependencies {
                    if demanded > stated {
                        let [stated, demanded] = [stated, demanded].map(shown);
                        check.fail(format!(
                            "{package} states Rust {stated}, and {name} demands {demanded}"
                        ));
                    }
                }
            }
            None => check.fail(format!("{package} is not in cargo's metadata")),
        }
    }
    println!("{seen} dependencies of {}", PACKAGES.join(", "));
}

/// Builds with the oldest Rust that is stated, which rustup fetches.
pub(crate) fn oldest(check: &mut Check) {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap_or_default();
    let Some(version) = stated(&manifest) else {
        return check.fail("Cargo.toml states no rust-version".to_owned());
    };
    check.command(&format!(
        "rustup toolchain install {version} --profile minimal --no-self-update"
    ));
    for package in PACKAGES {
        check.command(&format!(
            "rustup run {version} cargo check --quiet --locked --package {package} --target-dir target/oldest"
        ));
    }
}

fn stated(manifest: &str) -> Option<String> {
    let table: toml::Table = manifest.parse().ok()?;
    let version = table
        .get("workspace")?
        .get("package")?
        .get("rust-version")?;
    version.as_str().map(str::to_owned)
}

type Version = [u32; 3];

/// The version of Rust that a package states, and what each of its dependencies demands, of those that are built
/// into it or while it is built.
fn dependencies<'a>(
    metadata: &'a Value,
    package: &str,
) -> Option<(Version, Vec<(&'a str, Version)>)> {
    let packages: BTreeMap<&str, &Value> = metadata["packages"]
        .as_array()?
        .iter()
        .filter_map(|package| Some((package["id"].as_str()?, package)))
        .collect();
    let nodes: BTreeMap<&str, &Value> = metadata["resolve"]["nodes"]
        .as_array()?
        .iter()
        .filter_map(|node| Some((node["id"].as_str()?, node)))
        .collect();
    let own = packages
        .iter()
        .find(|(_, other)| other["name"] == package && other["source"].is_null());
    let (root, own) = own?;
    let mut open = vec![*root];
    let mut reached = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !reached.insert(id) {
            continue;
        }
        for dependency in nodes.get(id)?["deps"].as_array()? {
            let kinds = dependency["dep_kinds"].as_array()?;
            if kinds.iter().any(|kind| kind["kind"] != "dev") {
                open.push(dependency["pkg"].as_str()?);
            }
        }
    }
    let others = reached.into_iter().filter(|id| id != root);
    let demanded = others.filter_map(|id| {
        let package = packages.get(id)?;
        Some((
            package["name"].as_str()?,
            version(&package["rust_version"])?,
        ))
    });
    Some((version(&own["rust_version"])?, demanded.collect()))
}

/// `1.89` and `1.89.0`
fn version(value: &Value) -> Option<Version> {
    let mut parts = value.as_str()?.split('.').map(str::parse);
    let mut next = || parts.next().map_or(Some(0), Result::ok);
    Some([next()?, next()?, next()?])
}

fn shown([major, minor, patch]: Version) -> String {
    format!("{major}.{minor}.{patch}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_only_tested_with_does_not_count() -> Result<(), serde_json::Error> {
        let metadata: Value = serde_json::from_str(
            r#"{
            "packages": [
                {"id": "a", "name": "delta-cal", "source": null, "rust_version": "1.89"},
                {"id": "b", "name": "b", "source": "r", "rust_version": "1.90.1"},
                {"id": "c", "name": "c", "source": "r", "rust_version": null},
                {"id": "d", "name": "d", "source": "r", "rust_version": "1.99"}
            ],
            "resolve": {"nodes": [
                {"id": "a", "deps": [
                    {"pkg": "c", "dep_kinds": [{"kind": null}]},
                    {"pkg": "d", "dep_kinds": [{"kind": "dev"}]}
                ]},
                {"id": "b", "deps": []},
                {"id": "c", "deps": [{"pkg": "b", "dep_kinds": [{"kind": "build"}]}]},
                {"id": "d", "deps": []}
            ]}}"#,
        )?;
        let expected = ([1, 89, 0], vec![("b", [1, 90, 1])]);
        assert_eq!(dependencies(&metadata, "delta-cal"), Some(expected));
        assert_eq!(dependencies(&metadata, "b"), None);
        Ok(())
    }
}
