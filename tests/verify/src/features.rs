//! The core without features, with each, all but one and all of them, and the controller for other boards.

use crate::check::{Check, root};
use delta_cal_verify::firmware::{OTHER_TARGETS, TARGET};

/// Every package, on this machine, with what a Cortex-M logs and what others leave out.
pub(crate) const EVERYTHING: &str =
    "--workspace --features delta-cal/defmt,delta-cal-target-tests/linear";

/// Where what other targets need is checked, once for all stages.
pub(crate) const ELSEWHERE: &str = "--target-dir target/other-boards --target";

pub(crate) fn check(check: &mut Check) {
    let manifest = root().join("core/Cargo.toml");
    let names = match std::fs::read_to_string(&manifest).map(|text| names(&text)) {
        Ok(Some(names)) => names,
        Ok(None) => return check.fail("core/Cargo.toml has no features".to_owned()),
        Err(error) => return check.fail(format!("{}: {error}", manifest.display())),
    };
    // Each of these commands keeps one processor busy; two of cargo's would wait for each other in one folder.
    let (mut on_host, mut on_target) = (Vec::new(), Vec::new());
    let quiet = "cargo check --quiet --package";
    for features in choices(&names) {
        let list = features.join(",");
        let core = format!("{quiet} delta-cal --no-default-features --features={list}");
        // Nothing in the core is for one target alone: what a feature's absence breaks, breaks on the host.
        if features.is_empty() || features.len() == names.len() {
            on_target.push(format!("{core} {ELSEWHERE} {TARGET}"));
        }
        on_host.push(core);
    }
    on_target
        .extend(OTHER_TARGETS.map(|target| {
            format!("{quiet} delta-cal-firmware-example --lib {ELSEWHERE} {target}")
        }));
    check.side_by_side(&[on_host, on_target]);
}

/// What stands under `[features]`, other than `default`.
fn names(manifest: &str) -> Option<Vec<String>> {
    let table: toml::Table = manifest.parse().ok()?;
    let features = table.get("features")?.as_table()?;
    let names = features.keys().filter(|name| *name != "default");
    Some(names.cloned().collect())
}

/// None, each, all but one, and all: what a feature needs of another is missed with it alone, and what others need of
/// it, with all but it.
fn choices(names: &[String]) -> Vec<Vec<&str>> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut choices = vec![Vec::new()];
    choices.extend(names.iter().map(|name| vec![*name]));
    if names.len() > 2 {
        let without = |absent: &&str| {
            names
                .iter()
                .copied()
                .filter(|name| name != absent)
                .collect()
        };
        choices.extend(names.iter().map(without));
    }
    if names.len() > 1 {
        choices.push(names);
    }
    choices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_combined() {
        let names =
            names("[features]\ndefault = [\"a\"]\na = []\nb = []\nc = []\n").unwrap_or_default();
        let list: Vec<String> = choices(&names).iter().map(|them| them.join(",")).collect();
        assert_eq!(list, ["", "a", "b", "c", "b,c", "a,c", "a,b", "a,b,c"]);
        assert_eq!(choices(&names[..2]).len(), 4);
    }
}
