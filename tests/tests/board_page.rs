//! The code of docs/board.md is a crate of its own, with the dependencies that the page lists.

use crate::target::directory;
use delta_cal_verify::{TARGET, cargo, have};
use std::path::Path;

/// The blocks of the page in this language that contain a text.
fn blocks<'a>(page: &'a str, language: &str, part: &str) -> Vec<&'a str> {
    let blocks = page.split("```");
    let ours = blocks.filter_map(|own| own.strip_prefix(language));
    let found: Vec<_> = ours.filter(|own| own.contains(part)).collect();
    assert!(!found.is_empty(), "{part}");
    found
}

/// Without the gears of the joints, and with them and as tasks of Embassy.
#[test]
fn its_code_compiles_with_what_it_lists() {
    if !have(&[TARGET]) {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/board.md")).expect("the page");
    let [code] = blocks(&page, "rust\n", "impl Timer")[..] else {
        panic!("one program")
    };
    let tasks = blocks(&page, "rust\n", "embassy_executor::task").concat();
    let place = |line: &str| match line
        .split_once(" = { git = \"https://github.com/delta-cal/delta-cal\"")
    {
        Some((name, rest)) => {
            let folder = root.join(name.strip_prefix("delta-cal-").unwrap_or("core"));
            format!("{name} = {{ path = {folder:?}{rest}\n")
        }
        None => format!("{line}\n"),
    };
    let listed = |part| -> String {
        let lists = blocks(&page, "toml\n", part).concat();
        lists.lines().map(place).collect()
    };
    let usual = listed("[dependencies]");
    let without = usual.replace(", features = [\"transmission\"]", "");
    assert_ne!(usual, without, "the page lists the feature");
    let embassy = usual + &listed("embassy-executor");
    // The versions of everything else here.
    let [own, of_pico] = ["Cargo.lock", "firmware-example/boards/pico2/Cargo.lock"];
    for (dependencies, code, lock) in [
        (without, code.to_owned(), own),
        (embassy, code.to_owned() + &tasks, of_pico),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        // With the workspace's profile most dependencies are there already.
        let package = "[workspace]\n[profile.dev]\ndebug = false\nincremental = false\n\
                       [package]\nname = \"board\"\nversion = \"0.1.0\"\nedition = \"2024\"\n";
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        };
        write("Cargo.toml", &format!("{package}{dependencies}"));
        write("src/lib.rs", &code);
        std::fs::copy(root.join(lock), folder.path().join("Cargo.lock")).expect("a copy");
        let manifest = folder.path().join("Cargo.toml");
        let manifest = manifest.to_str().expect("a path");
        let check = ["check", "--target", TARGET, "--manifest-path", manifest];
        cargo(&directory(""), &check).expect("it compiles");
    }
}
