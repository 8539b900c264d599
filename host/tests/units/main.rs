//! The unit tests of those files that use nothing else of their crate. They are compiled here, a few files
//! in place of the whole library and the whole command once more, which are not built for tests.

#![allow(dead_code, unreachable_pub)] // each file is a part of something larger
#![allow(clippy::unwrap_used)]

#[path = "../../src/accuracy/chi_square.rs"]
mod chi_square;
#[path = "../../src/text/date.rs"]
mod date;
#[path = "../../src/files/decode.rs"]
mod decode;
#[path = "../../src/accuracy/improvement.rs"]
mod improvement;
#[path = "../../src/cli/length.rs"]
mod length;
#[path = "../../src/files/columns/mapping.rs"]
mod mapping;
#[path = "../../src/campaign/mixing.rs"]
mod mixing;
#[path = "../../src/campaign/quantiles.rs"]
mod quantiles;
#[path = "../../src/files/columns/quantity.rs"]
mod quantity;
#[path = "../../src/accuracy/sampled.rs"]
mod sampled;
#[path = "../../src/text/units.rs"]
mod units;

use std::fs;
use std::path::Path;

mod accuracy {
    pub(crate) use super::chi_square;
}

/// Every file that holds tests, below a folder.
fn tested(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            tested(&path, found);
        } else if fs::read_to_string(&path).unwrap().contains("#[test]") {
            found.push(path.to_str().unwrap().replace('\\', "/"));
        }
    }
}

#[test]
fn every_file_with_tests_is_compiled_here() {
    let mut found = Vec::new();
    tested(Path::new("src"), &mut found);
    assert!(found.len() >= 5, "{found:?}");
    for path in found {
        let line = format!("#[path = \"../../{path}\"]");
        assert!(include_str!("main.rs").contains(&line), "{path}");
    }
}
