//! Figures that a document states and a test prints are the same.

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
