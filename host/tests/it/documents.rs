//! The documentation shows what the commands really print.

#![cfg(unix)]

use crate::support::Folder;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The README and every page of `docs`.
fn pages() -> Vec<(String, String)> {
    let docs = std::fs::read_dir(root().join("docs")).unwrap();
    let pages = docs.map(|entry| entry.unwrap().path());
    pages
        .filter(|path| path.extension().is_some_and(|end| end == "md"))
        .chain([root().join("README.md")])
        .map(|path| {
            let text = std::fs::read_to_string(&path).unwrap();
            (path.display().to_string(), text)
        })
        .collect()
}

/// The contents of the fenced blocks of one kind.
fn blocks<'a>(page: &'a str, kind: &str) -> Vec<&'a str> {
    let opening = format!("```{kind}\n");
    let mut blocks = Vec::new();
    for part in page.split(&opening).skip(1) {
        blocks.push(part.split("```").next().unwrap());
    }
    blocks
}

fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A folder as the documentation assumes it: the README's robot file, measurements, and the repository's examples.
fn folder(readme: &str) -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", blocks(readme, "toml")[0]);
    std::fs::create_dir(folder.path("host")).unwrap();
    std::os::unix::fs::symlink(root().join("host/examples"), folder.path("host/examples")).unwrap();
    folder
}

/// The standard output of the commands, followed by their standard error.
fn printed(folder: &Folder, commands: &str) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_delta-cal"));
    let path = std::env::var("PATH").unwrap();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    let run = Command::new("sh")
        .args(["-c", commands])
        .env("PATH", path)
        .current_dir(folder.path("."))
        .output()
        .unwrap();
    let mut text = String::from_utf8(run.stdout).unwrap();
    text.push_str(&String::from_utf8(run.stderr).unwrap());
    text
}

/// The commands in every `console` block print what follows them there; `…` matches anything and line breaks do not
/// matter.
#[test]
fn documents_show_what_the_commands_print() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let (mut compared, mut wrong) = (0, String::new());
    for (page, text) in pages() {
        for block in blocks(&text, "console") {
            let folder = folder(&readme);
            let (commands, shown): (Vec<_>, Vec<_>) =
                block.lines().partition(|line| line.starts_with("$ "));
            let commands: Vec<_> = commands.iter().map(|line| &line[2..]).collect();
            let printed = words(&printed(&folder, &commands.join("\n")));
            let mut rest = printed.as_str();
            for part in shown.join("\n").split('…').map(words) {
                match rest.split_once(&part) {
                    Some((_, after)) => rest = after,
                    None => writeln!(wrong, "{page} shows\n{part}\nof\n{printed}\n").unwrap(),
                }
            }
            compared += 1;
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(compared >= 5, "{compared}");
}

/// Every package has the version that the changelog begins with, as have the packages that depend on it.
#[test]
fn versions_agree() {
    let read = |path: &str| std::fs::read_to_string(root().join(path)).unwrap();
    let toml = |path: &str| read(path).parse::<toml::Table>().unwrap();
    let version = env!("CARGO_PKG_VERSION");
    let workspace = &toml("Cargo.toml")["workspace"];
    let mut found = vec![(
        "the workspace".to_owned(),
        workspace["package"]["version"].clone(),
    )];
    for (name, needed) in workspace["dependencies"].as_table().unwrap() {
        if needed.get("path").is_some()
            && let Some(version) = needed.get("version")
        {
            found.push((name.clone(), version.clone()));
        }
    }
    let own = ["firmware-example/boards/pico2", "tests/fuzz/programs"];
    let members = workspace["members"].as_array().unwrap();
    for folder in members.iter().map(|it| it.as_str().unwrap()).chain(own) {
        let version = &toml(&format!("{folder}/Cargo.toml"))["package"]["version"];
        if version.get("workspace").is_none() {
            found.push((folder.to_owned(), version.clone()));
        }
    }
    for (what, found) in &found {
        assert_eq!(found.as_str(), Some(version), "{what}");
    }
    assert!(found.len() >= 6, "{found:?}");
    // maturin takes it from Cargo.toml.
    let python = &toml("bindings/python/pyproject.toml")["project"]["dynamic"];
    assert_eq!(python.as_array().unwrap(), &["version".into()]);
    let changelog = read("CHANGELOG.md");
    let newest = changelog.lines().find_map(|line| line.strip_prefix("## "));
    assert!(newest.unwrap().starts_with(&format!("{version}, ")));
}
