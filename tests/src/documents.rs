//! Figures that a document states and a test prints are the same.

use crate::is_long;

/// As [`print_documented`], of a campaign that has a short size: the document states what the long one
/// gives.
///
/// # Panics
/// In the long campaign, if the document does not state it.
#[track_caller]
pub fn print_campaign(page: &str, line: &str) {
    if is_long() {
        print_documented(page, line);
    } else {
        println!("{line}");
    }
}

/// Prints a row or a sentence that a document of this project states; wherever the document breaks
/// its lines.
///
/// # Panics
/// If the document does not state it.
#[track_caller]
pub fn print_documented(page: &str, line: &str) {
    println!("{line}");
    let path = format!("{}/../{page}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).expect("the document is there");
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words(&text).contains(&words(line)),
        "{page} does not state what this test prints: {line}"
    );
}
