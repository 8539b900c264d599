//! The documentation: rustdoc without warnings, and the links and code blocks of every page.

mod page;

use crate::check::{Check, root};
use crate::features::EVERYTHING;
use page::Page;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

pub(crate) fn check(check: &mut Check) {
    pages(check);
    check.command(&format!(
        "env RUSTDOCFLAGS=-Dwarnings cargo doc --quiet --no-deps {EVERYTHING}"
    ));
}

/// Links and code blocks alone.
pub(crate) fn pages(check: &mut Check) {
    let root = root();
    let mut files = Vec::new();
    collect(&root, Path::new(""), &mut files);
    let pages: BTreeMap<PathBuf, Page> = files
        .into_iter()
        .filter_map(|file| {
            let text = fs::read_to_string(root.join(&file)).ok()?;
            Some((file, Page::read(&text)))
        })
        .collect();
    let exists = |path: &Path| root.join(path).exists();
    let faults = faults(&pages, &exists);
    let links: usize = pages.values().map(|page| page.links.len()).sum();
    println!("{} pages, {links} links", pages.len());
    if pages.is_empty() {
        check.fail("no page is found".to_owned());
    }
    for fault in faults {
        check.fail(fault);
    }
}

/// All `.md` files below a folder, but those of builds and hidden ones.
fn collect(root: &Path, folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(root.join(folder)).into_iter().flatten();
    for entry in entries.flatten() {
        let path = folder.join(entry.file_name());
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        let built = root.join(&path).join("CACHEDIR.TAG").exists();
        if hidden || built {
            continue;
        }
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            collect(root, &path, files);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            files.push(path);
        }
    }
}

/// What is wrong in which line of which page.
fn faults(pages: &BTreeMap<PathBuf, Page>, exists: &dyn Fn(&Path) -> bool) -> Vec<String> {
    let mut faults = Vec::new();
    for (file, page) in pages {
        let mut note = |line: usize, what: &str| {
            faults.push(format!("{}:{line}: {what}", file.display()));
        };
        for (line, what) in &page.faults {
            note(*line, what);
        }
        for (line, target) in &page.links {
            let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = match path {
                "" => file.clone(),
                path => normal(&file.parent().unwrap_or(Path::new("")).join(path)),
            };
            if !exists(&path) {
                note(*line, &format!("{target} leads nowhere"));
            } else if !anchor.is_empty()
                && let Some(other) = pages.get(&path)
                && !other.anchors.contains(anchor)
            {
                note(*line, &format!("{target}: no heading of that name"));
            }
        }
    }
    faults
}

/// Without `..`, as far as the path itself says where that leads.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            std::path::Component::CurDir => {}
            std::path::Component::ParentDir => {
                if !normal.pop() {
                    normal.push("..");
                }
            }
            other => normal.push(other),
        }
    }
    normal
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults_of(files: &[(&str, &str)]) -> Vec<String> {
        let pages = files
            .iter()
            .map(|(name, text)| (PathBuf::from(name), Page::read(text)))
            .collect();
        let exists = |path: &Path| files.iter().any(|(name, _)| Path::new(name) == path);
        faults(&pages, &exists)
    }

    #[test]
    fn links_lead_to_files_and_headings() {
        let method = (
            "docs/method.md",
            "# The *method*: `f(x)`\n\n## Twice\n\n## Twice\n",
        );
        let good = "[a](docs/method.md) [b](docs/method.md#the-method-fx) [c](#here)\n\
                    [d](docs/method.md#twice-1) [e](https://example.org/x#y)\n\n# Here\n";
        assert_eq!(faults_of(&[("README.md", good), method]), [""; 0]);
        let back = ("docs/back.md", "[up](../README.md#here)\n");
        assert_eq!(faults_of(&[("README.md", good), method, back]), [""; 0]);
        let bad = "\n[a\nb](docs/none.md)\n![c](#there)\n[d]: docs/method.md#thrice\n";
        assert_eq!(
            faults_of(&[("README.md", bad), method]),
            [
                "README.md:3: docs/none.md leads nowhere",
                "README.md:4: #there: no heading of that name",
                "README.md:5: docs/method.md#thrice: no heading of that name",
            ]
        );
    }

    #[test]
    fn what_stands_in_code_is_neither_link_nor_heading() {
        let text = "`[a](b)` and [c](#d)\n\n```sh\n# d\n[e](f)\n```\n";
        assert_eq!(
            faults_of(&[("README.md", text)]),
            ["README.md:1: #d: no heading of that name"]
        );
    }

    #[test]
    fn every_block_is_closed_and_says_what_it_holds() {
        let open = "```sh\nls\n\n## Swallowed\n\n```text\nx\n```\n";
        assert_eq!(
            faults_of(&[("a.md", open)]),
            ["a.md:1: the code block is not closed before line 6"]
        );
        assert_eq!(
            faults_of(&[("a.md", "~~~~toml\n~~~\n```\n")]),
            ["a.md:1: the code block is not closed"]
        );
        assert_eq!(
            faults_of(&[("a.md", "```shell\n```\n\n```\n```\n\n```rust,no_run\n```\n")]),
            [
                "a.md:1: \"shell\" is no known kind of code block",
                "a.md:4: \"\" is no known kind of code block",
            ]
        );
    }
}
