//! Which file depends on which, and by which ways to name an item.

use super::{Crate, Edge};
use std::path::Path;

/// The edges of a crate with these files, as `from:line to`.
fn edges(files: &[(&str, &str)]) -> Vec<String> {
    let text_of = |path: &Path| {
        let file = files.iter().find(|(name, _)| Path::new(name) == path);
        file.map(|(_, text)| (*text).to_owned())
    };
    let found = Crate::read(Path::new(files[0].0), &text_of).unwrap_or_default();
    let line = |e: &Edge| format!("{}:{} {}", e.from.display(), e.line, e.to.display());
    found.edges().iter().map(line).collect()
}

#[test]
fn every_way_to_name_an_item_counts() {
    for naming in [
        "use crate::b::B;",
        "use crate::{b::{self, B}, a};",
        "use super::b::B as Other;",
        "use crate::b::*;",
        "use crate::b; fn f(b: b::B) {}",
        "fn f() { crate::b::B::new(); }",
        "fn f() { let v = Vec::<super::b::B>::new(); }",
        "fn f() { println!(\"{}\", crate::b::B); }",
        "mod inner { use super::super::b::B; }",
        "mod inner { fn f() -> crate::b::B {} }",
        "#[arg(value_parser = crate::b::B)] struct A;",
        "use crate::B;",
        "use super::B;",
    ] {
        let found = edges(&[
            ("lib.rs", "mod a; mod b; pub use b::B;"),
            ("a.rs", naming),
            ("b.rs", "pub struct B;"),
        ]);
        assert_eq!(found, ["a.rs:1 b.rs"], "{naming}");
    }
}

#[test]
fn a_file_elsewhere_is_found() {
    let found = edges(&[
        ("lib.rs", "mod a; #[path = \"../b.rs\"] mod b;"),
        ("a.rs", "use crate::b::B;"),
        ("../b.rs", "pub struct B;"),
    ]);
    assert_eq!(found, ["a.rs:1 ../b.rs"]);
}

#[test]
fn what_is_of_other_crates_or_for_tests_alone_does_not() {
    for naming in [
        "use std::b::B;",
        "use crate::b;",
        "// use crate::b::B;",
        "/// [`crate::b::B`]\nfn f() { \"crate::b::B\"; }",
        "#[cfg(test)] mod tests { use crate::b::B; }",
        "#[cfg(test)] use crate::b::{B};",
        "#[cfg(all(test, unix))] fn f(b: crate::b::B) {}",
        "fn f() -> impl Sized + use<> { b::B }",
    ] {
        let found = edges(&[
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", naming),
            ("b.rs", "pub struct B;"),
        ]);
        assert_eq!(found, [""; 0], "{naming}");
    }
    let after = "#[cfg(test)] use crate::b::{B};\nuse crate::b::B;";
    let found = edges(&[
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", after),
        ("b.rs", "struct B;"),
    ]);
    assert_eq!(found, ["a.rs:2 b.rs"]);
}

#[test]
fn modules_for_tests_alone_are_read_by_themselves() {
    let files = [
        ("lib.rs", "mod a; pub struct B;"),
        ("a.rs", "#[cfg(test)] mod tests; use crate::B;"),
        (
            "a/tests.rs",
            "mod one; mod two; use crate::B; use one::One;",
        ),
        (
            "a/tests/one.rs",
            "use super::two::Two; use crate::B; pub struct One;",
        ),
        ("a/tests/two.rs", "use super::one::One; pub struct Two;"),
    ];
    let text_of = |path: &Path| {
        let file = files.iter().find(|(name, _)| Path::new(name) == path);
        file.map(|(_, text)| (*text).to_owned())
    };
    let whole = Crate::read(Path::new("lib.rs"), &text_of).unwrap_or_default();
    let parts = whole.read_tests(&text_of).unwrap_or_default();
    let edges = parts.iter().flat_map(Crate::edges);
    let found: Vec<_> = edges
        .map(|e| format!("{} {}", e.from.display(), e.to.display()))
        .collect();
    assert_eq!(
        found,
        [
            "a/tests/one.rs a/tests/two.rs",
            "a/tests/two.rs a/tests/one.rs",
            "a/tests.rs a/tests/one.rs",
        ]
    );
}

#[test]
fn a_front_door_depends_on_its_children_by_its_own_code_alone() {
    let child = ("door/child.rs", "use super::Own; pub struct Item;");
    let found = edges(&[
        ("lib.rs", "mod door;"),
        (
            "door.rs",
            "mod child;\npub(crate) use child::Item;\npub struct Own;",
        ),
        child,
    ]);
    assert_eq!(found, ["door/child.rs:1 door.rs"]);
    let found = edges(&[
        ("lib.rs", "mod door;"),
        (
            "door/mod.rs",
            "mod child;\nuse child::Item;\npub struct Own;",
        ),
        ("door/child.rs", "pub struct Item;"),
    ]);
    assert_eq!(found, ["door/mod.rs:2 door/child.rs"]);
}

#[test]
fn re_exports_are_followed_to_the_file_that_defines() {
    let found = edges(&[
        ("lib.rs", "mod a; mod door; pub use door::*;"),
        (
            "a.rs",
            "use crate::door::{Item, Own};\nuse crate::Item as Same;",
        ),
        ("door.rs", "mod child; pub use child::Item; pub struct Own;"),
        ("door/child.rs", "pub struct Item;"),
    ]);
    assert_eq!(found, ["a.rs:1 door/child.rs", "a.rs:1 door.rs"]);
}
