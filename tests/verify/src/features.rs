//! The core with every combination of its features, without any, with each and with all of them also for the
//! bare target, and the controller for other boards.

use crate::check::{Check, root};
use delta_cal_verify::firmware::{OTHER_TARGETS, TARGET};

pub(crate) fn check(check: &mut Check) {
    let manifest = root().join("core/Cargo.toml");
    let names = match std::fs::read_to_string(&manifest).map(|text| names(&text)) {
        Ok(Some(names)) => names,
        Ok(None) => return check.fail("core/Cargo.toml has no features".to_owned()),
        Err(error) => return check.fail(format!("{}: {error}", manifest.display())),
    };
    for features in combinations(&names) {
        let list = features.join(",");
        let core = "cargo check --quiet --package delta-cal --no-default-features --features";
        check.command(&format!("{core}={list}"));
        // Nothing in the core is for one target alone: what two features break together breaks on the host.
        if features.len() <= 1 || features.len() == names.len() {
            check.command(&format!("{core}={list} --target {TARGET}"));
        }
    }
    for target in OTHER_TARGETS {
        check.command(&format!(
            "cargo check --quiet --package delta-cal-firmware-example --lib --target {target}"
        ));
    }
}

/// What stands under `[features]`, other than `default`.
fn names(manifest: &str) -> Option<Vec<String>> {
    let table: toml::Table = manifest.parse().ok()?;
    let features = table.get("features")?.as_table()?;
    let names = features.keys().filter(|name| *name != "default");
    Some(names.cloned().collect())
}

/// Every subset, the empty one first.
fn combinations(names: &[String]) -> Vec<Vec<&str>> {
    names.iter().fold(vec![Vec::new()], |subsets, name| {
        let with = subsets.iter().cloned().map(|mut subset| {
            subset.push(name.as_str());
            subset
        });
        let with: Vec<_> = with.collect();
        subsets.into_iter().chain(with).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_combined() {
        let names = names("[features]\ndefault = [\"a\"]\na = []\nb = []\n").unwrap_or_default();
        let empty: Vec<&str> = Vec::new();
        assert_eq!(
            combinations(&names),
            [empty, vec!["a"], vec!["b"], vec!["a", "b"]]
        );
    }
}
