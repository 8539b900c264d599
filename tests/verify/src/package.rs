//! What is published: the core and the protocol.

use crate::check::{Check, output};

const PUBLISHED: [&str; 2] = ["delta-cal", "delta-cal-protocol"];

pub(crate) fn check(check: &mut Check) {
    let packages = PUBLISHED.map(|name| format!("--package {name}")).join(" ");
    // The state that is checked may not be committed yet.
    check.command(&format!(
        "cargo publish --dry-run --quiet --allow-dirty {packages}"
    ));
    semver(check, &packages);
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
