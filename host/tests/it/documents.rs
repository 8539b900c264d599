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

/// What a page shows in order.
enum Block<'a> {
    /// A file with this name.
    File(&'a str, &'a str),
    /// Commands after `$ `, and what they print; `…` matches anything and line breaks do not matter.
    Console(&'a str),
    /// Commands that must succeed.
    Commands(&'a str),
}

/// The blocks of a page that the test makes or runs. Commands that need a board, a compiler or minutes are not run.
fn blocks(page: &str) -> Vec<Block<'_>> {
    let fenced = page.split("\n```").skip(1).step_by(2);
    let of = |block| {
        let (head, text) = str::split_once(block, '\n')?;
        let needs_more = |line: &str| {
            let own = ["cp ", "delta-cal "];
            !own.iter().any(|own| line.starts_with(own))
                || line.starts_with("delta-cal device")
                || line.starts_with("delta-cal simulate")
        };
        match head.split_once(' ') {
            Some((_, name)) => Some(Block::File(name, text)),
            None if head == "console" => Some(Block::Console(text)),
            None if head == "sh" && !text.lines().any(needs_more) => Some(Block::Commands(text)),
            None => None,
        }
    };
    fenced.filter_map(of).collect()
}

fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Whether the commands succeed, and their standard output followed by their standard error.
fn run(folder: &Folder, commands: &str) -> (bool, String) {
    let program = Path::new(env!("CARGO_BIN_EXE_delta-cal"));
    let path = std::env::var("PATH").unwrap();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    let run = Command::new("sh")
        .args(["-ec", commands])
        .env("PATH", path)
        .current_dir(folder.path("."))
        .output()
        .unwrap();
    let mut text = String::from_utf8(run.stdout).unwrap();
    text.push_str(&String::from_utf8(run.stderr).unwrap());
    (run.status.success(), text)
}

/// A reader who follows a page from an empty folder finds what it shows. A page that names `host/examples` has them
/// there as `examples`.
#[test]
fn documents_show_what_the_commands_print() {
    let (mut compared, mut wrong) = (0, String::new());
    for (page, text) in pages() {
        let folder = Folder::new();
        if text.contains("(../host/examples)") {
            let examples = root().join("host/examples");
            std::os::unix::fs::symlink(examples, folder.path("examples")).unwrap();
        }
        // Figures of the prose are those of a block.
        let fenced = text.split("\n```").skip(1).step_by(2);
        let shown: Vec<_> = fenced.flat_map(str::split_whitespace).collect();
        for (end, _) in text.match_indices("<!--shown-->") {
            let figure = text[..end].rsplit([' ', '\n']).next().unwrap();
            if !shown.iter().any(|own| own.starts_with(figure)) {
                writeln!(wrong, "{page}: no block shows {figure}").unwrap();
            }
        }
        for block in blocks(&text) {
            match block {
                Block::File(name, text) => {
                    folder.write(name, text);
                }
                Block::Commands(commands) => {
                    let (succeeded, printed) = run(&folder, commands);
                    if !succeeded {
                        writeln!(wrong, "{page}: {commands}\n{printed}\n").unwrap();
                    }
                }
                Block::Console(block) => {
                    for part in block.trim_start_matches("$ ").split("\n$ ") {
                        let (command, shown) = part.split_once('\n').unwrap_or((part, ""));
                        let (_, printed) = run(&folder, command);
                        let printed = words(&printed);
                        let mut rest = printed.as_str();
                        for part in shown.split('…').map(words) {
                            match rest.split_once(&part) {
                                Some((_, after)) => rest = after,
                                None => writeln!(wrong, "{page} shows\n{part}\nof\n{printed}\n")
                                    .unwrap(),
                            }
                        }
                        compared += 1;
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(compared >= 40, "{compared}");
}

/// The anchor that a heading gets.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept
        .chars()
        .filter(|own| own.is_alphanumeric() || "_- ".contains(*own));
    kept.map(|own| if own == ' ' { '-' } else { own }).collect()
}

/// Links between pages lead to a file and a heading.
#[test]
fn links_lead_somewhere() {
    let mut wrong = String::new();
    for (page, text) in pages() {
        let prose: String = text.split("\n```").step_by(2).collect();
        for link in prose.split("](").skip(1) {
            let link = link.split(')').next().unwrap();
            if link.starts_with("http") || link.ends_with("/releases") {
                continue;
            }
            let (path, heading) = link.split_once('#').unwrap_or((link, ""));
            let own = Path::new(&page);
            let target = match path {
                "" => own.to_owned(),
                path => own.parent().unwrap().join(path),
            };
            let held = target.exists()
                && (heading.is_empty() || {
                    let text = std::fs::read_to_string(&target).unwrap();
                    let mut headings = text.lines().filter(|own| own.starts_with('#'));
                    headings.any(|own| anchor(own.trim_start_matches('#')) == heading)
                });
            if !held {
                writeln!(wrong, "{page}: {link}").unwrap();
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// What is generated is not counted.
#[test]
fn documents_are_short() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.lines().count() <= 120);
    let architecture = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let pages = pages()
        .into_iter()
        .map(|(_, text)| text)
        .chain([architecture]);
    let own = |text: String| {
        let written = text.split("<!-- generated -->").next().unwrap();
        written.split_whitespace().count()
    };
    let words: usize = pages.map(own).sum();
    assert!(words <= 30_000, "{words}");
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
