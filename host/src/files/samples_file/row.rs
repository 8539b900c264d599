//! A row of a file.

/// One row of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<T> {
    /// Its line in the file, counted from 1.
    pub line: u64,
    /// What it holds.
    pub value: T,
}
