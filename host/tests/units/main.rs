//! The unit tests of those files of both crates that use nothing else of their crate. They are compiled here, a few
//! files in place of the whole libraries and the whole command once more, which are not built for tests.

#![allow(dead_code, unreachable_pub)] // each file is a part of something larger
#![allow(clippy::unwrap_used)]

#[path = "../../compute/src/accuracy/chi_square.rs"]
mod chi_square;
#[path = "../../compute/src/text/date.rs"]
mod date;
#[path = "../../compute/src/files/decode.rs"]
mod decode;
#[path = "../../compute/src/accuracy/improvement.rs"]
mod improvement;
#[path = "../../compute/src/validation/interval.rs"]
mod interval;
#[path = "../../src/cli/length.rs"]
mod length;
#[path = "../../compute/src/files/columns/mapping.rs"]
mod mapping;
#[path = "../../compute/src/campaign/mixing.rs"]
mod mixing;
#[path = "../../compute/src/campaign/quantiles.rs"]
mod quantiles;
#[path = "../../compute/src/files/columns/quantity.rs"]
mod quantity;
#[path = "../../compute/src/accuracy/sampled.rs"]
mod sampled;
#[path = "../../compute/src/text/units.rs"]
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
    for folder in ["src", "compute/src"] {
        tested(Path::new(folder), &mut found);
    }
    assert!(found.len() >= 5, "{found:?}");
    for path in found {
        let line = format!("#[path = \"../../{path}\"]");
        assert!(include_str!("main.rs").contains(&line), "{path}");
    }
}
