//! Every dependency's licence against the list of `deny.toml`.

use crate::check::{Check, output};
use std::collections::BTreeSet;

const RULES: &str = include_str!("../../../deny.toml");

pub(crate) fn check(check: &mut Check) {
    if output("cargo deny --version").is_some() {
        for package in ["", "--manifest-path tests/fuzz/programs/Cargo.toml "] {
            check.command(&format!(
                "cargo deny {package}check --config deny.toml licenses bans sources"
            ));
        }
        return;
    }
    println!("cargo-deny is not installed; reading the licences from cargo tree");
    let mut tree = String::new();
    for package in ["", "--manifest-path tests/fuzz/programs/Cargo.toml "] {
        let Some(part) = output(&format!(
            "cargo tree {package}--workspace --all-features --target all --edges normal,build,dev --prefix none --format {{p}}|{{l}}"
        )) else {
            check.fail(format!("cargo tree {package}failed"));
            return;
        };
        tree.push_str(&part);
    }
    let allowed = allowed_licences(RULES);
    // A package that was shown before is marked with an asterisk.
    let packages: BTreeSet<&str> = tree
        .lines()
        .map(|line| line.trim_end_matches(" (*)"))
        .filter(|line| !line.is_empty())
        .collect();
    let mut refused = 0;
    for package in &packages {
        let (name, licence) = package.rsplit_once('|').unwrap_or((package, ""));
        if !permits(licence, &allowed) {
            refused += 1;
            check.fail(format!("{name}: licence {licence:?} is not allowed"));
        }
    }
    println!("{} packages, {refused} refused", packages.len());
    if packages.is_empty() {
        check.fail("cargo tree lists no package".to_owned());
    }
}

/// What `deny.toml` says of known weaknesses.
pub(crate) fn advisories(check: &mut Check) {
    for package in ["", "--manifest-path tests/fuzz/programs/Cargo.toml "] {
        check.command(&format!(
            "cargo deny {package}check --config deny.toml advisories"
        ));
    }
}

/// The strings of `allow = [ … ]`.
fn allowed_licences(rules: &str) -> Vec<&str> {
    rules
        .split_once("allow = [")
        .and_then(|(_, rest)| rest.split_once(']'))
        .map(|(list, _)| list.split('"').skip(1).step_by(2).collect())
        .unwrap_or_default()
}

/// Whether the licence expression (SPDX) can be met with allowed licences alone. The slash is how
/// `OR` was written before.
fn permits(expression: &str, allowed: &[&str]) -> bool {
    let spaced = expression
        .replace('(', " ( ")
        .replace(')', " ) ")
        .replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    either(&mut rest, allowed) == Some(true) && rest.is_empty()
}

/// `a OR b OR …`; `None` where it is not an expression.
fn either(words: &mut &[&str], allowed: &[&str]) -> Option<bool> {
    let mut permitted = both(words, allowed)?;
    while let ["OR", rest @ ..] = *words {
        *words = rest;
        permitted |= both(words, allowed)?;
    }
    Some(permitted)
}

/// `a AND b AND …`, which binds more tightly.
fn both(words: &mut &[&str], allowed: &[&str]) -> Option<bool> {
    let mut permitted = one(words, allowed)?;
    while let ["AND", rest @ ..] = *words {
        *words = rest;
        permitted &= one(words, allowed)?;
    }
    Some(permitted)
}

fn one(words: &mut &[&str], allowed: &[&str]) -> Option<bool> {
    match *words {
        ["(", rest @ ..] => {
            *words = rest;
            let permitted = either(words, allowed)?;
            let [")", rest @ ..] = *words else {
                return None;
            };
            *words = rest;
            Some(permitted)
        }
        [")" | "OR" | "AND" | "WITH", ..] | [] => None,
        [licence, "WITH", exception, rest @ ..] => {
            *words = rest;
            Some(allowed.contains(&format!("{licence} WITH {exception}").as_str()))
        }
        [licence, rest @ ..] => {
            *words = rest;
            Some(allowed.contains(licence))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_are_read_as_spdx_reads_them() {
        let allowed = [
            "MIT",
            "Apache-2.0",
            "Unicode-3.0",
            "Apache-2.0 WITH LLVM-exception",
        ];
        for (expression, expected) in [
            ("MIT", true),
            ("MIT OR GPL-3.0", true),
            ("GPL-3.0 OR MIT", true),
            ("MIT AND GPL-3.0", false),
            ("MIT/Apache-2.0", true),
            ("(MIT OR Apache-2.0) AND Unicode-3.0", true),
            ("(MIT OR Apache-2.0) AND GPL-3.0", false),
            ("GPL-3.0 AND MIT OR MIT", true),
            ("Apache-2.0 WITH LLVM-exception", true),
            ("MIT WITH LLVM-exception", false),
            ("GPL-3.0", false),
            ("", false),
            ("MIT MIT", false),
            ("(MIT", false),
        ] {
            assert_eq!(permits(expression, &allowed), expected, "{expression:?}");
        }
    }

    #[test]
    fn the_list_is_found() {
        assert!(allowed_licences(RULES).contains(&"Apache-2.0 WITH LLVM-exception"));
        assert!(!allowed_licences(RULES).contains(&"GPL-3.0"));
    }
}
