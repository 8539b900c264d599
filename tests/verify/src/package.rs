//! What is published: the core and the protocol.

use crate::check::{Check, output};
use std::path::PathBuf;

const PUBLISHED: [&str; 2] = ["delta-cal", "delta-cal-protocol"];

pub(crate) fn check(check: &mut Check) {
    let packages = PUBLISHED.map(|name| format!("--package {name}")).join(" ");
    forget_unpacked(check);
    // The state that is checked may not be committed yet.
    check.command(&format!(
        "cargo publish --dry-run --quiet --allow-dirty {packages}"
    ));
    semver(check, &packages);
}

/// Cargo unpacks what it is about to publish beside the packages of the registries and does not
/// unpack the same version again: in a second clone at the same place it would build the sources
/// of the first one.
fn forget_unpacked(check: &mut Check) {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let sources = home.map(|home| home.join("registry/src"));
    let Some(registries) = sources.and_then(|sources| sources.read_dir().ok()) else {
        return;
    };
    for registry in registries.flatten() {
        for name in PUBLISHED {
            let unpacked = registry
                .path()
                .join(format!("{name}-{}", env!("CARGO_PKG_VERSION")));
            if unpacked.is_dir()
                && let Err(error) = std::fs::remove_dir_all(&unpacked)
            {
                check.fail(format!("cannot remove {}: {error}", unpacked.display()));
            }
        }
    }
}

/// The public items against those of the last release.
fn semver(check: &mut Check, packages: &str) {
    if output("cargo semver-checks --version").is_none() {
        println!(
            "cargo-semver-checks is not installed; the public items are not compared. \
             Install it: cargo install cargo-semver-checks --locked"
        );
        return;
    }
    match output("git describe --tags --abbrev=0 --match v*") {
        Some(release) => check.command(&format!(
            "cargo semver-checks {packages} --baseline-rev {}",
            release.trim()
        )),
        None => println!("no release to compare the public items with: no tag v*"),
    }
}
