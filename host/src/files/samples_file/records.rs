//! The header and the records of a table, each with its line, however its fields are separated.

use crate::files::columns::ColumnName;
use crate::files::input::{InputError, InputText};
use csv::{ReaderBuilder, StringRecord};
use std::borrow::Cow;

/// Columns whose name begins with this are ignored.
pub(super) const IGNORED: char = '_';

/// What may separate fields; several spaces are one.
const SEPARATORS: [(u8, &str); 4] = [
    (b',', "commas"),
    (b';', "semicolons"),
    (b'\t', "tabs"),
    (b' ', "spaces"),
];

/// A header names at least so many columns that are known.
const LEAST_COLUMNS: usize = 3;
/// Lines above the header that are looked at.
const MOST_ABOVE: usize = 100;

/// The records below a header.
pub(super) struct Records<'a> {
    input: &'a InputText,
    /// The line of the header.
    pub(super) header_line: u64,
    /// Its fields.
    pub(super) header: Vec<String>,
    separator: u8,
    /// Where it ends.
    below: usize,
}

impl<'a> Records<'a> {
    /// `None` if the file has nothing but comments. What an instrument writes above the header is skipped: the first line
    /// is no header then, and exactly one of the lines below it is.
    pub(super) fn new(input: &'a InputText) -> Option<Self> {
        let mut end = 0;
        let lines = (1..)
            .zip(input.text().split_inclusive('\n'))
            .map(|(number, line)| {
                end += line.len();
                (number, line, end)
            });
        let written = |line: &str| !(line.trim().is_empty() || line.trim_start().starts_with('#'));
        let mut lines = lines.filter(|(_, line, _)| written(line));
        let first = lines.next()?;
        let (header_line, header, below) = if is_header(input, first.1) {
            first
        } else {
            let mut others = lines
                .take(MOST_ABOVE)
                .filter(|(_, line, _)| is_header(input, line));
            match (others.next(), others.next()) {
                (Some(only), None) => only,
                _ => first,
            }
        };
        let separator = separator(input, header);
        Some(Self {
            input,
            header_line,
            header: fields(header, separator),
            separator,
            below,
        })
    }

    pub(super) const fn input(&self) -> &'a InputText {
        self.input
    }

    /// What stands between two fields.
    pub(super) fn separator(&self) -> char {
        self.separator.into()
    }

    /// Every record with its line, without comments and empty lines.
    pub(super) fn each(
        &self,
        mut take: impl FnMut(u64, &StringRecord) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        let first_line = self.header_line + 1;
        let below = self.input.text().get(self.below..).unwrap_or_default();
        let block = match self.separator {
            b' ' => below
                .split_inclusive('\n')
                .map(with_single_spaces)
                .collect::<String>()
                .into(),
            _ => Cow::Borrowed(below),
        };
        let text = block.as_bytes();
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(self.separator)
            .comment(Some(b'#'))
            .from_reader(text);
        let mut record = StringRecord::new();
        let mut lines = Lines {
            text,
            counted: 0,
            line: first_line,
        };
        loop {
            let start = reader.position().byte();
            let read = reader.read_record(&mut record).map_err(|error| {
                InputError::new(self.input.name(), format!("is not CSV: {error}"))
            })?;
            if !read {
                return Ok(());
            }
            if record.as_slice().contains('\n') {
                return Err(self.unclosed_quote(&block, first_line, start));
            }
            // The reader's own position of a record is that of the comments before it. The record ends
            // where the reader now stands: at the start of the next line or at the end of the text.
            let line = lines.of_byte_before(reader.position().byte());
            let comment = || {
                record
                    .get(0)
                    .unwrap_or_default()
                    .trim_start()
                    .starts_with('#')
            };
            let empty = || record.iter().all(|field| field.trim().is_empty());
            let first = record.as_slice().as_bytes().first();
            let number = first.is_some_and(|byte| byte.is_ascii_digit() || *byte == b'-');
            if number || !(comment() || empty()) {
                take(line, &record)?;
            }
        }
    }

    /// Numbers do not go over several lines: a field that does begins with a quote that is not closed.
    /// The record begins in the first line from byte `start` on that is no comment and not empty.
    fn unclosed_quote(&self, block: &str, first_line: u64, start: u64) -> InputError {
        let start = usize::try_from(start).unwrap_or(usize::MAX);
        let (before, rest) = block.split_at_checked(start).unwrap_or_default();
        let blank = |line: &&str| line.trim_end().is_empty() || line.starts_with('#');
        let lines = before.matches('\n').count() + rest.split('\n').take_while(blank).count();
        let cause = "this line opens a quote \" and does not close it";
        InputError::new(self.input.name(), cause)
            .at_line(first_line + lines as u64)
            .with_remedy("delete the quotes: numbers need none")
    }

    /// What other than the header's separates the fields of a row, if that is plain.
    pub(super) fn separated_otherwise(&self, record: &StringRecord) -> Option<String> {
        if record.len() > 1 {
            return None;
        }
        let is_own = |(separator, _): &&(u8, &str)| *separator == self.separator;
        let (_, header) = SEPARATORS.iter().find(is_own)?;
        let (_, row) = SEPARATORS.iter().find(|other| {
            !is_own(other) && record.as_slice().trim().contains(char::from(other.0))
        })?;
        Some(format!(
            "the fields of this row are separated by {row}, those of the header by {header}"
        ))
    }
}

/// Whether a line names columns: three or more that are recognised or that `--columns` names.
fn is_header(input: &InputText, line: &str) -> bool {
    let fields = fields(line, separator(input, line));
    let known = |field: &&String| {
        input.columns().of_column(field).is_some() || ColumnName::recognise(field).is_some()
    };
    fields.iter().filter(known).count() >= LEAST_COLUMNS
}

/// By which most columns of the header are recognised; otherwise the one that separates anything.
fn separator(input: &InputText, header: &str) -> u8 {
    let recognised = |separator: u8| {
        let fields = fields(header, separator);
        let known = fields.iter().filter(|field| {
            input.columns().of_column(field).is_some() || ColumnName::recognise(field).is_some()
        });
        known.count()
    };
    let [comma, others @ ..] = SEPARATORS.map(|(separator, _)| separator);
    let mut best = (comma, recognised(comma));
    for separator in others {
        let found = recognised(separator);
        if found > best.1 {
            best = (separator, found);
        }
    }
    if best.1 > 0 {
        return best.0;
    }
    let separates = |separator: &u8| fields(header, *separator).len() > 1;
    [b';', b'\t', comma, b' ']
        .into_iter()
        .find(separates)
        .unwrap_or(comma)
}

fn fields(header: &str, separator: u8) -> Vec<String> {
    let line = match separator {
        b' ' => Cow::Owned(with_single_spaces(header)),
        _ => Cow::Borrowed(header),
    };
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(separator)
        .from_reader(line.as_bytes());
    let mut record = StringRecord::new();
    // What was text before is text now.
    let _ = reader.read_record(&mut record);
    let mut fields: Vec<String> = Vec::with_capacity(record.len());
    for field in &record {
        match fields.last_mut() {
            // `q1 [deg]` is one name.
            Some(last) if separator == b' ' && field.starts_with(['[', '(']) => {
                last.push(' ');
                last.push_str(field);
            }
            _ => fields.push(field.trim().to_owned()),
        }
    }
    fields
}

/// Fields that any number of spaces and tabs separate, with one space between them.
fn with_single_spaces(line: &str) -> String {
    let mut text = line.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.ends_with('\n') {
        text.push('\n');
    }
    text
}

/// Counts lines once through a text.
struct Lines<'a> {
    text: &'a [u8],
    counted: usize,
    line: u64,
}

impl Lines<'_> {
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
