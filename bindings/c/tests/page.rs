//! `docs/c.md` states what the library is made of.

#![allow(clippy::unwrap_used)]

use delta_cal_c::{kind, status};

fn page() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/c.md")).unwrap()
}

/// Every row is a line of the page.
fn assert_states(rows: &[String]) {
    let page = page();
    let missing: Vec<&str> = rows
        .iter()
        .map(String::as_str)
        .filter(|row| !page.lines().any(|line| line == *row))
        .collect();
    assert!(
        missing.is_empty(),
        "docs/c.md does not state\n{}",
        missing.join("\n")
    );
}

#[test]
fn the_page_states_the_size_of_every_object() {
    let row = |name: &str, [single, double]: [usize; 2]| {
        format!("| `delta_cal_{name}` | {single} | {double} |")
    };
    let mut rows: Vec<String> = kind::ALL
        .iter()
        .map(|kind| row(kind.in_c, kind.scalars.map(|(_, size, _)| size)))
        .collect();
    rows.push(row(
        "observation_row",
        [kind::OBSERVATION_ROW_F32, kind::OBSERVATION_ROW_F64],
    ));
    assert_states(&rows);
}

#[test]
fn the_page_states_every_status() {
    let rows: Vec<String> = status::ALL
        .iter()
        .map(|(name, number)| {
            let text = status::text(*number).to_string_lossy().trim().to_owned();
            format!("| {number} | `DELTA_CAL_{name}` | {text} |")
        })
        .collect();
    assert_states(&rows);
}
