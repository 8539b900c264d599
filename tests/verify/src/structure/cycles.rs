//! What depends on each other in a circle.

use super::modules::{Crate, Edge};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

/// Dependencies of one member on another that are shown.
const SHOWN: usize = 3;

/// Files, or folders with everything below them, each of which depends on each other one.
#[derive(Debug)]
pub(super) struct Cycle<'a> {
    pub(super) members: Vec<String>,
    between: BTreeMap<(String, String), Vec<&'a Edge>>,
}

impl fmt::Display for Cycle<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { members, between } = self;
        write!(
            formatter,
            "a cycle of {}: {}",
            members.len(),
            members.join(", ")
        )?;
        for ((from, to), edges) in between {
            write!(formatter, "\n  {from} -> {to}")?;
            for edge in edges.iter().take(SHOWN) {
                let Edge {
                    from, line, name, ..
                } = edge;
                write!(formatter, "\n    {}:{line}: {name}", from.display())?;
            }
            if edges.len() > SHOWN {
                write!(formatter, "\n    and {} more", edges.len() - SHOWN)?;
            }
        }
        Ok(())
    }
}

/// Cycles between single files.
pub(super) fn of_files(all: &Crate) -> Vec<Cycle<'_>> {
    let units = all.files().map(|file| (file, file.display().to_string()));
    cycles(all.edges(), &units.collect())
}

/// Cycles between the children of one module, each with everything below it, and its own file; without
/// those between single files.
pub(super) fn of_folders(all: &Crate) -> Vec<Cycle<'_>> {
    let mut found = Vec::new();
    for (index, file) in all.files().enumerate() {
        let mut units = BTreeMap::from([(file, file.display().to_string())]);
        for child in all.children(index) {
            let below = all.files_within(child);
            let folder = below.len() > 1;
            for inner in below.into_iter().filter(|inner| *inner != file) {
                let front = all.file(child);
                let name = if folder {
                    folder_of(front)
                } else {
                    front.display().to_string()
                };
                units.insert(inner, name);
            }
        }
        let has_folder = |cycle: &Cycle<'_>| cycle.members.iter().any(|name| name.ends_with('/'));
        found.extend(cycles(all.edges(), &units).into_iter().filter(has_folder));
    }
    found
}

/// The folder of a front door: `x/` of `x.rs` and of `x/mod.rs`.
fn folder_of(front: &Path) -> String {
    let folder = match front.parent() {
        Some(parent) if front.file_name().is_some_and(|name| name == "mod.rs") => parent.to_owned(),
        _ => front.with_extension(""),
    };
    format!("{}/", folder.display())
}

/// Cycles between units, each of which is made of files.
fn cycles<'a>(edges: &'a [Edge], units: &BTreeMap<&Path, String>) -> Vec<Cycle<'a>> {
    let mut between: BTreeMap<(&str, &str), Vec<&Edge>> = BTreeMap::new();
    for edge in edges {
        let unit = |file: &Path| units.get(file).map(String::as_str);
        if let (Some(from), Some(to)) = (unit(&edge.from), unit(&edge.to))
            && from != to
        {
            between.entry((from, to)).or_default().push(edge);
        }
    }
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in between.keys() {
        next.entry(from).or_default().push(to);
    }
    let reached: BTreeMap<&str, BTreeSet<&str>> = next
        .keys()
        .map(|from| (*from, reachable(from, &next)))
        .collect();
    let mut cycles = Vec::new();
    let mut done = BTreeSet::new();
    for (unit, reaches) in &reached {
        if !reaches.contains(unit) || done.contains(unit) {
            continue;
        }
        let back = |other: &&&str| reached.get(**other).is_some_and(|r| r.contains(unit));
        let members: Vec<&str> = reaches.iter().filter(back).copied().collect();
        done.extend(members.iter().copied());
        let inside = between
            .iter()
            .filter(|((from, to), _)| members.contains(from) && members.contains(to));
        cycles.push(Cycle {
            between: inside
                .map(|((from, to), edges)| (((*from).into(), (*to).into()), edges.clone()))
                .collect(),
            members: members.into_iter().map(str::to_owned).collect(),
        });
    }
    cycles
}

/// Where one comes to in one step or more.
fn reachable<'a>(from: &str, next: &BTreeMap<&'a str, Vec<&'a str>>) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&str> = next.get(from).cloned().unwrap_or_default();
    while let Some(unit) = open.pop() {
        if reached.insert(unit) {
            open.extend(next.get(unit).into_iter().flatten());
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Members of all cycles of a crate with these files: between files, and between folders.
    fn members(files: &[(&str, &str)]) -> [Vec<String>; 2] {
        let text_of = |path: &Path| {
            let file = files.iter().find(|(name, _)| Path::new(name) == path);
            file.map(|(_, text)| (*text).to_owned())
        };
        let all = Crate::read(Path::new(files[0].0), &text_of).unwrap_or_default();
        [of_files(&all), of_folders(&all)]
            .map(|cycles| cycles.iter().map(|cycle| cycle.members.join(" ")).collect())
    }

    #[test]
    fn files_in_a_circle_are_found_and_named_with_their_edges() {
        let files = [
            ("lib.rs", "mod a; mod b; mod c; mod d;"),
            ("a.rs", "use crate::b::B; pub struct A;"),
            ("b.rs", "use crate::c::C; pub struct B;"),
            ("c.rs", "\nfn c() { super::a::A; } pub struct C;"),
            ("d.rs", "use crate::a::A;"),
        ];
        assert_eq!(members(&files), [vec!["a.rs b.rs c.rs".to_owned()], vec![]]);
        let text_of = |path: &Path| {
            let file = files.iter().find(|(name, _)| Path::new(name) == path);
            file.map(|(_, text)| (*text).to_owned())
        };
        let all = Crate::read(Path::new("lib.rs"), &text_of).unwrap_or_default();
        let text = of_files(&all)[0].to_string();
        assert!(
            text.contains("c.rs -> a.rs\n    c.rs:2: super::a::A"),
            "{text}"
        );
    }

    #[test]
    fn a_front_door_and_its_child_are() {
        let front = "mod child; pub use child::Item; pub struct Own; fn f() { child::Item; }";
        let child = "use super::Own; pub struct Item;";
        let files = |front| [("lib.rs", "mod x;"), ("x.rs", front), ("x/child.rs", child)];
        assert_eq!(members(&files(front))[0], ["x.rs x/child.rs"]);
        let declares = "mod child; pub use child::Item; pub struct Own;";
        assert_eq!(members(&files(declares)), [vec![], vec![""; 0]]);
    }

    #[test]
    fn folders_in_a_circle_are_found_where_no_files_are() {
        let found = members(&[
            ("lib.rs", "mod a; mod x;"),
            ("a.rs", "use crate::x::One; pub struct A;"),
            ("x.rs", "mod one; mod two; pub use one::One;"),
            ("x/one.rs", "pub struct One;"),
            ("x/two.rs", "use crate::a::A;"),
        ]);
        assert_eq!(found, [vec![], vec!["a.rs x/".to_owned()]]);
    }

    #[test]
    fn trees_without_a_circle_pass() {
        let found = members(&[
            ("lib.rs", "mod a; mod x; pub use x::{One, Two};"),
            ("a.rs", "use crate::{One, Two};"),
            (
                "x.rs",
                "mod one; mod two; pub use one::One; pub use two::Two;",
            ),
            ("x/one.rs", "use super::Two; pub struct One;"),
            ("x/two.rs", "pub struct Two;"),
        ]);
        assert_eq!(found, [vec![""; 0], vec![""; 0]]);
    }
}
