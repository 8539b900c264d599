//! The code of docs/board.md is a crate of its own, with the dependencies that the page lists.

use delta_cal_verify::{TARGET, cargo, have};
use std::path::Path;

/// The block of the page in this language that contains a text.
fn block<'a>(page: &'a str, language: &str, part: &str) -> &'a str {
    let blocks = page.split("```");
    let mut ours = blocks.filter_map(|own| own.strip_prefix(language));
    ours.find(|own| own.contains(part)).expect(part)
}

#[test]
fn its_code_compiles_with_what_it_lists() {
    if !have(&[TARGET]) {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/board.md")).expect("the page");
    let code = block(&page, "rust\n", "impl Timer");
    let lines = block(&page, "toml\n", "[dependencies]").lines();
    let place = |line: &str| match line
        .split_once(" = { git = \"https://github.com/delta-cal/delta-cal\"")
    {
        Some((name, rest)) => {
            let folder = root.join(name.strip_prefix("delta-cal-").unwrap_or("core"));
            format!("{name} = {{ path = {folder:?}{rest}\n")
        }
        None => format!("{line}\n"),
    };
    let dependencies: String = lines.map(place).collect();
    let without = dependencies.replace(", features = [\"transmission\"]", "");
    assert_ne!(dependencies, without, "the page lists the feature");
    for dependencies in [dependencies, without] {
        let folder = tempfile::tempdir().expect("a folder");
        let package =
            "[package]\nname = \"board\"\nversion = \"0.1.0\"\nedition = \"2024\"\n[workspace]\n";
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        };
        write("Cargo.toml", &format!("{package}{dependencies}"));
        write("src/lib.rs", code);
        // The versions of everything else here.
        std::fs::copy(root.join("Cargo.lock"), folder.path().join("Cargo.lock")).expect("a copy");
        let manifest = folder.path().join("Cargo.toml");
        let manifest = manifest.to_str().expect("a path");
        let check = ["check", "--target", TARGET, "--manifest-path", manifest];
        cargo(&root.join("target/firmware"), &check).expect("it compiles");
    }
}
