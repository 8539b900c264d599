//! No cycle between the files or between the folders of any crate, and no file of tests that none compiles.
//!
//! File A depends on file B where A names an item that B defines: in a `use`, or in a path anywhere
//! else. A re-export is followed to the file that defines the item. Of a file with child modules, the
//! front door of its folder, `mod child;` and the re-export of its own children's items
//! (`pub use child::Item`, also `pub(crate)`) are no dependencies; everything else is: a front door with
//! code of its own that uses a child, while the child uses what the front door defines, is a cycle.
//! What is compiled for tests alone (`#[cfg(test)]`) does not count; a module for tests alone in files of its
//! own is looked at by itself.
//!
//! Beside the single files, whole folders must not depend on each other in a cycle: of each module the
//! children, each with everything below it, and its own file.

mod crates;
mod cycles;
mod modules;
mod source;

use crate::check::{Check, root};
use crates::roots;
use cycles::{of_files, of_folders};
use modules::Crate;
use std::collections::BTreeSet;
use std::path::Path;

pub(crate) fn check(check: &mut Check) {
    let root = root();
    let roots = match roots(&root) {
        Ok(roots) => roots,
        Err(error) => return check.fail(error),
    };
    let read = |path: &Path| std::fs::read_to_string(root.join(path)).ok();
    // Several test programs share files.
    let mut reported = BTreeSet::new();
    let (mut files, mut edges) = (BTreeSet::new(), 0);
    for path in &roots.files {
        let found = match Crate::read(path, &read) {
            Ok(found) => found,
            Err(error) => {
                check.fail(error);
                continue;
            }
        };
        let tests = match found.read_tests(&read) {
            Ok(tests) => tests,
            Err(error) => {
                check.fail(error);
                continue;
            }
        };
        for part in std::iter::once(&found).chain(&tests) {
            files.extend(part.files().map(Path::to_owned));
            edges += part.edges().len();
            for cycle in of_files(part).into_iter().chain(of_folders(part)) {
                if reported.insert(cycle.members.clone()) {
                    check.fail(cycle.to_string());
                }
            }
        }
    }
    for file in roots.left_out(&root, &files) {
        let file = file.display();
        check.fail(format!("{file} is a module of no test program"));
    }
    println!("{} files, {edges} dependencies between them", files.len());
}
