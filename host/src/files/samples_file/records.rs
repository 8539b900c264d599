//! The records of a CSV file, each with its line.

use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::text::words::{count, decimal_comma};
use csv::{ReaderBuilder, StringRecord};

/// Columns whose name begins with this are ignored.
pub(super) const IGNORED: char = '_';

/// Every record with its line, without comments and empty lines.
pub(super) fn records(input: &InputText) -> Result<Vec<(u64, StringRecord)>, InputError> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .from_reader(input.text().as_bytes());
    let mut records = Vec::new();
    let mut record = StringRecord::new();
    let mut lines = Lines::new(input.text());
    loop {
        let start = reader.position().byte();
        let read = reader
            .read_record(&mut record)
            .map_err(|error| InputError::new(input.name(), format!("is not CSV: {error}")))?;
        if !read {
            return Ok(records);
        }
        if record.iter().any(|field| field.contains('\n')) {
            return Err(unclosed_quote(input, start));
        }
        record.trim();
        // The reader's own position of a record is that of the comments before it. The record ends
        // where the reader now stands: at the start of the next line or at the end of the text.
        let line = lines.of_byte_before(reader.position().byte());
        let first = record.get(0).unwrap_or_default();
        let empty = record.len() == 1 && first.is_empty();
        if !(empty || first.starts_with('#')) {
            records.push((line, record.clone()));
        }
    }
}

/// Numbers do not go over several lines: a field that does begins with a quote that is not closed.
/// The record begins in the first line from byte `start` on that is no comment and not empty.
fn unclosed_quote(input: &InputText, start: u64) -> InputError {
    let mut offset = usize::try_from(start).unwrap_or(usize::MAX);
    let rest = input.text().get(offset..).unwrap_or_default();
    for line in rest.split_inclusive('\n') {
        if !(line.trim_end().is_empty() || line.starts_with('#')) {
            break;
        }
        offset += line.len();
    }
    InputError::new(
        input.name(),
        "this line opens a quote \" and does not close it",
    )
    .at_line(input.line_at(offset))
    .with_remedy("delete the quotes: numbers need none")
}

/// Tells a header or row whose fields are separated by something else than commas.
pub(super) fn check_separator(
    input: &InputText,
    line: u64,
    record: &StringRecord,
) -> Result<(), InputError> {
    // The name of an ignored column may hold anything.
    let alone = record.len() == 1;
    let holds = |separator: char| {
        let mut fields = record.iter();
        fields.any(|field| field.contains(separator) && (alone || !field.starts_with(IGNORED)))
    };
    let (name, separator) = if holds(';') {
        ("semicolons", ';')
    } else if holds('\t') {
        ("tabs", '\t')
    } else {
        return Ok(());
    };
    let index = usize::try_from(line).unwrap_or(usize::MAX);
    let decimal_commas = input.text().lines().skip(index - 1).any(|line| {
        line.split(separator)
            .any(|field| decimal_comma(field).is_some())
    });
    let remedy = if decimal_commas {
        "write commas between the fields, and decimal points in place of the decimal commas"
    } else {
        "write commas"
    };
    Err(
        InputError::new(input.name(), format!("the fields are separated by {name}"))
            .at_line(line)
            .with_remedy(remedy),
    )
}

/// A row must have as many fields as the header has columns of these names.
pub(super) fn check_length(
    input: &InputText,
    line: u64,
    record: &StringRecord,
    names: &[&str],
) -> Result<(), InputError> {
    let (found, expected) = (record.len(), names.len());
    if found == expected {
        return Ok(());
    }
    let cause = format!(
        "the row has {} and the header {expected}",
        count(found, "field")
    );
    let fault = InputError::new(input.name(), cause).at_line(line);
    let (name, remedy) = if found < expected {
        (names.get(found), "this is the first column that is missing")
    } else if record.iter().skip(expected).all(str::is_empty) {
        (
            names.last(),
            "the row continues after this column; look for a comma at its end",
        )
    } else {
        (
            names.last(),
            "the row continues after this column; decimal commas have this effect as well",
        )
    };
    Err(match name {
        Some(name) => fault.at_column(*name).with_remedy(remedy),
        None => fault,
    })
}

/// Counts lines once through a text.
struct Lines<'a> {
    text: &'a [u8],
    counted: usize,
    line: u64,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            text: text.as_bytes(),
            counted: 0,
            line: 1,
        }
    }

    /// The line of the byte before `end`; `end` must not decrease from call to call.
    fn of_byte_before(&mut self, end: u64) -> u64 {
        let end = usize::try_from(end).unwrap_or(usize::MAX);
        let to = end.saturating_sub(1).min(self.text.len());
        if let Some(bytes) = self.text.get(self.counted..to) {
            let newlines: u64 = bytes.iter().map(|b| u64::from(*b == b'\n')).sum();
            self.line += newlines;
            self.counted = to;
        }
        self.line
    }
}
