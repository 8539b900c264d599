//! Input files: their text in any encoding, their name for messages, and faults with place and remedy.

use super::columns::ColumnMapping;
use crate::halt;
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::error::Error;
use std::fmt::{self, Write};
use std::io::{self, Read};
use std::ops::{Range, RangeInclusive};
use std::path::Path;
use std::sync::Arc;

/// Size limit of robot and campaign files, far above any real one.
const LARGEST_SETTINGS: u64 = 1 << 20;
/// Size limit of a table: some 70 million rows.
const LARGEST_TABLE: u64 = 4 << 30;
/// Most letters of a cause or a remedy.
const LONGEST: usize = 2000;
/// Binary data is recognised within this many bytes.
const START: u64 = 1 << 16;

/// Bytes that are read before a look whether to stop: some milliseconds.
const AT_ONCE: usize = 1 << 20;

/// The cells of a column that is in memory.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// NaN where nothing was measured.
    Numbers(Vec<f64>),
    /// Empty where nothing is said.
    Words(Vec<String>),
}

impl Cells {
    pub(crate) fn text(&self, row: usize) -> Option<Cow<'_, str>> {
        match self {
            Self::Numbers(all) => all.get(row).map(|own| format!("{own:?}").into()),
            Self::Words(all) => all.get(row).map(Into::into),
        }
    }

    pub(crate) fn count(&self) -> usize {
        match self {
            Self::Numbers(all) => all.len(),
            Self::Words(all) => all.len(),
        }
    }
}

/// A file's name and text, without byte order mark and with lines ending in `\n`; or a table's header and its columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InputText {
    name: String,
    text: String,
    /// The columns, if they are not in the text; the first row is that of line 2.
    cells: Option<Arc<[Cells]>>,
    sha256: String,
    columns: ColumnMapping,
    /// The lines whose rows are to be used, if not all.
    lines: Option<RangeInclusive<u64>>,
    /// A second file for the same samples.
    beside: Option<Box<InputText>>,
}

impl InputText {
    /// Wraps text that is already in memory.
    pub fn new(name: impl Into<String>, text: &str) -> Self {
        let without_mark = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self::of(name.into(), without_mark, text.as_bytes())
    }

    /// Decodes the bytes of a file: UTF-8, UTF-16, or a single-byte encoding.
    ///
    /// # Errors
    /// The bytes are not text.
    pub fn from_bytes(name: impl Into<String>, bytes: &[u8]) -> Result<Self, InputError> {
        let name = name.into();
        match decode(bytes) {
            Ok(text) => Ok(Self::of(name, &text, bytes)),
            Err(cause) => Err(cause.in_file(&name)),
        }
    }

    /// Reads a table to the end of a stream.
    ///
    /// # Errors
    /// The stream cannot be read, is longer than 4 GB, or is not text.
    pub fn from_reader(name: impl Into<String>, reader: impl Read) -> Result<Self, InputError> {
        let larger = InputError::new(name, "the file is larger than 4 GB")
            .with_remedy("split it: a few hundred rows are enough to calibrate a robot");
        Self::limited(reader, LARGEST_TABLE, larger)
    }

    /// Reads a robot or campaign file to the end of a stream.
    ///
    /// # Errors
    /// The stream cannot be read, is too large for such a file, or is not text.
    pub fn of_settings(name: impl Into<String>, reader: impl Read) -> Result<Self, InputError> {
        let cause = "the file is larger than 1 MB: not a robot file or campaign file";
        let larger = InputError::new(name, cause)
            .with_remedy("check the name: a robot file is a short text, see delta-cal init");
        Self::limited(reader, LARGEST_SETTINGS, larger)
    }

    fn limited(reader: impl Read, most: u64, larger: InputError) -> Result<Self, InputError> {
        let bytes =
            read(reader, most).map_err(|error| InputError::unreadable(&larger.file, &error))?;
        if bytes.len() as u64 > most {
            return Err(larger);
        }
        Self::from_bytes(larger.file, &bytes)
    }

    /// A table of columns of the same length, by their names as a samples file has them.
    pub fn of_columns(name: impl Into<String>, columns: Vec<(String, Cells)>) -> Self {
        let (names, cells): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        let text = names.join(",") + "\n";
        let mut digest = Sha256::new();
        digest.update(&text);
        for own in &cells {
            match own {
                Cells::Numbers(all) => all.iter().for_each(|own| digest.update(own.to_le_bytes())),
                Cells::Words(all) => all.iter().for_each(|own| digest.update(own.clone() + "\n")),
            }
        }
        Self {
            cells: Some(cells.into()),
            sha256: hexadecimal(&digest.finalize()),
            ..Self::of(name.into(), &text, &[])
        }
    }

    fn of(name: String, text: &str, bytes: &[u8]) -> Self {
        let mut digest = Sha256::new();
        for part in bytes.chunks(AT_ONCE) {
            halt::check();
            digest.update(part);
        }
        Self {
            name,
            text: text.replace("\r\n", "\n").replace('\r', "\n"),
            sha256: hexadecimal(&digest.finalize()),
            ..Self::default()
        }
    }

    /// Samples in one file; or the joints, and what was measured in a second file.
    #[must_use]
    pub fn joined(self, second: Option<Self>) -> Self {
        match second {
            None => self,
            Some(mut second) => {
                second.beside = Some(Box::new(self));
                second
            }
        }
    }

    /// The second file for the same samples.
    pub fn beside(&self) -> Option<&Self> {
        self.beside.as_deref()
    }

    /// Adds the meaning of columns whose names do not state it.
    #[must_use]
    pub fn with_columns(mut self, columns: ColumnMapping) -> Self {
        self.columns = columns;
        self
    }

    /// Restricts the rows to those of these lines.
    #[must_use]
    pub fn with_lines(mut self, lines: RangeInclusive<u64>) -> Self {
        self.lines = Some(lines);
        self
    }

    /// The lines whose rows are to be used, if not all.
    pub(crate) const fn lines(&self) -> Option<&RangeInclusive<u64>> {
        self.lines.as_ref()
    }

    /// The columns, if they are not in the text.
    pub(crate) fn cells(&self) -> Option<&[Cells]> {
        self.cells.as_deref()
    }

    pub(crate) const fn columns(&self) -> &ColumnMapping {
        &self.columns
    }

    /// The name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether this is a robot file, by its ending or by a section that every robot file has.
    pub fn is_robot(&self) -> bool {
        let mut lines = self.text.lines();
        let is_toml = Path::new(&self.name)
            .extension()
            .is_some_and(|own| own == "toml");
        is_toml || lines.any(|line| line.trim_start().starts_with("[joints]"))
    }

    /// SHA-256 of the file's original bytes, in hexadecimal, as `sha256sum` prints it; of columns that of header and numbers.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The line, counted from 1, containing the byte at `offset`.
    pub fn line_at(&self, offset: usize) -> u64 {
        let before = self.text.as_bytes().iter().take(offset);
        1 + before.map(|byte| u64::from(*byte == b'\n')).sum::<u64>()
    }

    /// A fault at these bytes, with its line number and the line with the bytes marked.
    pub(crate) fn fault_at(&self, span: Range<usize>, cause: impl Into<String>) -> InputError {
        let (line, text) = (self.line_at(span.start), self.text.as_str());
        let before = text.get(..span.start).unwrap_or(text);
        let begin = before.rfind('\n').map_or(0, |newline| newline + 1);
        let shown = text.get(begin..).and_then(|rest| rest.lines().next());
        let shown = shown.unwrap_or_default();
        let end = span.end.clamp(span.start, begin + shown.len());
        let letters = |from, to| text.get(from..to).map_or(0, |part| part.chars().count());
        let (left, width) = (letters(begin, span.start), letters(span.start, end).max(1));
        let margin = " ".repeat(line.to_string().len());
        let marks = format!("{:left$}{}", "", "^".repeat(width));
        if shown.len() > LONGEST {
            return InputError::new(&self.name, cause).at_line(line);
        }
        let excerpt = format!("{margin} |\n{line} | {shown}\n{margin} | {marks}");
        InputError {
            excerpt: Some(excerpt.into()),
            ..InputError::new(&self.name, cause).at_line(line)
        }
    }
}

fn hexadecimal(digest: &[u8]) -> String {
    let mut digits = String::with_capacity(64);
    for byte in digest {
        let _ = write!(digits, "{byte:02x}");
    }
    digits
}

/// Reads at most one byte more than `most`, and only the start of binary data, which may never end.
fn read(mut reader: impl Read, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.by_ref().take(START).read_to_end(&mut bytes)?;
    let start = &bytes[..bytes.len() & !1];
    if !matches!(decode(start), Err(NotText::Control)) {
        let more = (most + 1).saturating_sub(START);
        reader.take(more).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

/// The reason why bytes are not text.
#[derive(Debug, Clone, PartialEq, Eq)]
enum NotText {
    /// A control character, as in programs and images.
    Control,
    /// UTF-16 with an incomplete character in this line.
    Damaged(u64),
}

impl NotText {
    fn in_file(&self, name: &str) -> InputError {
        let error = match self {
            Self::Control => InputError::new(name, "is not a text file"),
            Self::Damaged(line) => {
                InputError::new(name, "the UTF-16 text is damaged here").at_line(*line)
            }
        };
        error.with_remedy("save it as plain text in UTF-8 (in a spreadsheet: CSV UTF-8)")
    }
}

/// Bytes that are neither UTF-8 nor UTF-16 are read as Windows-1252: numbers and units are the same in all single-byte
/// encodings.
fn decode(bytes: &[u8]) -> Result<String, NotText> {
    halt::check();
    let text = match bytes {
        [0xff, 0xfe, wide @ ..] => from_utf16(wide, u16::from_le_bytes)?,
        [0xfe, 0xff, wide @ ..] => from_utf16(wide, u16::from_be_bytes)?,
        [first, 0, ..] if *first != 0 => from_utf16(bytes, u16::from_le_bytes)?,
        [0, second, ..] if *second != 0 => from_utf16(bytes, u16::from_be_bytes)?,
        _ => {
            let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            match std::str::from_utf8(bytes) {
                Ok(text) => text.to_owned(),
                Err(_) => bytes.iter().copied().map(in_windows_1252).collect(),
            }
        }
    };
    halt::check();
    if text.contains(is_control) {
        return Err(NotText::Control);
    }
    Ok(text)
}

fn is_control(letter: char) -> bool {
    letter < ' ' && !matches!(letter, '\t' | '\n' | '\r' | '\u{c}')
}

fn from_utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<String, NotText> {
    let (pairs, rest) = bytes.as_chunks();
    let letters = char::decode_utf16(pairs.iter().copied().map(unit));
    let mut text: String = letters
        .map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect();
    if !rest.is_empty() {
        text.push(char::REPLACEMENT_CHARACTER);
    }
    match text.split_once(char::REPLACEMENT_CHARACTER) {
        Some(_) if text.contains(is_control) => Err(NotText::Control),
        Some((before, _)) => Err(NotText::Damaged(1 + before.matches('\n').count() as u64)),
        None => Ok(text),
    }
}

/// Unicode has the same values, except for bytes 80 to 9F (hexadecimal).
fn in_windows_1252(byte: u8) -> char {
    const OTHERS: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž',
        '\u{8f}', '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}',
        'ž', 'Ÿ',
    ];
    let other = byte
        .checked_sub(0x80)
        .and_then(|place| OTHERS.get(usize::from(place)));
    other.copied().unwrap_or(char::from(byte))
}

/// One fault in an input file. Displayed as `file:line: column x_mm: cause`, on one line.
#[derive(Debug, Clone, PartialEq)]
pub struct InputError {
    /// The name of the file at fault.
    pub file: Box<str>,
    /// The line at fault, counted from 1, if there is one.
    pub line: Option<u64>,
    /// The column or key at fault.
    place: Option<Box<str>>,
    cause: Box<str>,
    /// The faulty line as it stands in the file, with the place marked: several lines.
    pub excerpt: Option<Box<str>>,
    /// What to do next, unless the cause makes it obvious.
    pub remedy: Option<Box<str>>,
}

impl InputError {
    /// A fault of the whole file.
    pub fn new(file: impl Into<String>, cause: impl Into<String>) -> Self {
        Self {
            file: file.into().into(),
            line: None,
            place: None,
            cause: readable(&cause.into()),
            excerpt: None,
            remedy: None,
        }
    }

    /// A file that cannot be read.
    pub(crate) fn unreadable(file: &str, error: &std::io::Error) -> Self {
        Self::new(file, format!("cannot be read: {error}"))
            .with_remedy("check the file's name and its permissions")
    }

    /// The line at fault, counted from 1.
    #[must_use]
    pub fn at_line(mut self, line: u64) -> Self {
        self.line = Some(line);
        self
    }

    /// The CSV column at fault.
    #[must_use]
    pub fn at_column(mut self, column: impl fmt::Display) -> Self {
        self.place = Some(readable(&format!("column {column}")));
        self
    }

    /// The TOML key at fault.
    #[must_use]
    pub fn at_key(mut self, key: impl Into<String>) -> Self {
        self.place = Some(key.into().into());
        self
    }

    /// Adds what to do next.
    #[must_use]
    pub fn with_remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(readable(&remedy.into()));
        self
    }
}

/// A text that quotes a file with damaged or endless lines: in one line, without its middle.
fn readable(text: &str) -> Box<str> {
    let text = text.replace(['\n', '\r'], " ");
    if text.chars().nth(LONGEST).is_none() {
        return text.into();
    }
    let end: Vec<_> = text.chars().rev().take(LONGEST / 4).collect();
    let start = text.chars().take(LONGEST / 2);
    let shown = start.chain(" … ".chars()).chain(end.into_iter().rev());
    shown.collect::<String>().into()
}

impl fmt::Display for InputError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:", self.file)?;
        if let Some(line) = self.line {
            write!(formatter, "{line}:")?;
        }
        if let Some(place) = &self.place {
            write!(formatter, " {place}:")?;
        }
        write!(formatter, " {}", self.cause)
    }
}

impl Error for InputError {}

#[cfg(test)]
mod tests {
    use super::{InputText, NotText, decode};

    #[test]
    fn what_is_no_unicode_is_windows_1252() {
        assert_eq!(decode(b"\x93a\x94 5 \x80").as_deref(), Ok("“a” 5 €"));
        for bytes in [&b"\0\0"[..], b"a\0\0\0", b"ab\0", b"\x89PNG\x1a", b"\0"] {
            assert_eq!(decode(bytes), Err(NotText::Control), "{bytes:x?}");
        }
    }

    #[test]
    fn a_stream_that_is_no_text_is_not_read_to_its_end() {
        let error = InputText::from_reader("zeros", std::io::repeat(0)).unwrap_err();
        assert_eq!(error.to_string(), "zeros: is not a text file");
    }

    #[test]
    fn a_fault_shows_its_place() {
        let input = InputText::new("robot.toml", "# ä\nlength = ä 5\n");
        let error = input.fault_at(14..16, "no number");
        assert_eq!(error.to_string(), "robot.toml:2: no number");
        let shown = "  |\n2 | length = ä 5\n  |          ^";
        assert_eq!(error.excerpt.as_deref(), Some(shown));
    }
}
