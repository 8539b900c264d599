//! The text of an input file, with its name for messages.

use crate::files::columns::ColumnMapping;
use crate::files::decode::{NotText, decode, is_no_text};
use crate::files::input_error::InputError;
use crate::files::text_on_disk::{Long, TextOnDisk, with_newlines};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::io::{Read, Seek, Write as _};
use std::path::Path;

/// No file of a robot or a campaign is nearly as large.
const LARGEST_SETTINGS: u64 = 1 << 20;
/// A table of some 70 million rows.
const LARGEST_TABLE: u64 = 4 << 30;
/// What is no text shows this in so many bytes.
const START: u64 = 1 << 16;

/// A longer text of a table that may have any number of rows is read block by block.
const LONG: u64 = 1 << 24;

/// A file's name and text: without byte order mark, lines ended by `\n`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputText {
    name: String,
    /// All of it, or the first lines of a text on disk.
    text: String,
    on_disk: Option<TextOnDisk>,
    many_rows: bool,
    sha256: String,
    columns: ColumnMapping,
}

impl InputText {
    /// A text that is already in memory.
    pub fn new(name: impl Into<String>, text: &str) -> Self {
        let sha256 = digits(Sha256::new_with_prefix(text.as_bytes()));
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self::of(name.into(), text.to_owned(), sha256)
    }

    fn of(name: String, text: String, sha256: String) -> Self {
        Self {
            name,
            text: with_newlines(text),
            on_disk: None,
            many_rows: false,
            sha256,
            columns: ColumnMapping::default(),
        }
    }

    /// Reads the file of a robot or a campaign.
    ///
    /// # Errors
    /// A file that cannot be read, is larger than such a file is, or is no text.
    pub fn from_file(path: &Path) -> Result<Self, InputError> {
        Self::open(path, |name, file| {
            let mut bytes = Vec::new();
            file.take(LARGEST_SETTINGS + 1)
                .read_to_end(&mut bytes)
                .map_err(|error| unreadable(name, &error))?;
            if bytes.len() as u64 > LARGEST_SETTINGS {
                return Err(InputError::new(
                    name,
                    "the file is larger than 1 MB, and no robot file or campaign is",
                )
                .with_remedy(
                    "check the name: a robot file is a short text, see delta-cal calibrate --help",
                ));
            }
            Self::from_bytes(name.to_owned(), bytes)
        })
    }

    /// Reads a table: samples, joint angles, positions.
    ///
    /// # Errors
    /// A file that cannot be read, is larger than 4 GB, or is no text.
    pub fn from_table(path: &Path) -> Result<Self, InputError> {
        Self::open(path, |name, file| Self::from_reader(name, file))
    }

    /// Reads a table that may have any number of rows: a long text is read block by block, and of many rows most are
    /// kept in a temporary file.
    ///
    /// # Errors
    /// As [`from_table`](Self::from_table); a temporary file that cannot be written.
    pub fn from_long_table(path: &Path) -> Result<Self, InputError> {
        Self::open(path, |name, file| {
            let length = match file.metadata() {
                Ok(metadata) if metadata.is_file() => metadata.len(),
                _ => 0,
            };
            match length {
                _ if length > LARGEST_TABLE => Err(too_large(name)),
                _ if length > LONG => Self::on_disk(name, file),
                _ => Self::from_long_reader(name, file),
            }
        })
    }

    /// The same to the end of a stream, standard input for one.
    ///
    /// # Errors
    /// As [`from_long_table`](Self::from_long_table).
    pub fn from_long_reader(name: &str, mut reader: impl Read) -> Result<Self, InputError> {
        let bytes = start(name, &mut reader, LONG + 1)?;
        if bytes.len() as u64 <= LONG || is_no_text(&bytes[..4096]) {
            let text = Self::from_bytes(name.to_owned(), bytes)?;
            return Ok(text.with_many_rows());
        }
        let kept = || -> std::io::Result<_> {
            let mut file = tempfile::tempfile()?;
            file.write_all(&bytes)?;
            let more = LARGEST_TABLE + 1 - bytes.len() as u64;
            let copied = std::io::copy(&mut reader.take(more), &mut file)?;
            file.rewind()?;
            Ok((file, copied < more))
        };
        let (file, whole) = kept().map_err(|error| {
            InputError::new(
                name,
                format!("it cannot be kept in a temporary file: {error}"),
            )
            .with_remedy(
                "make room in the folder for temporary files, or choose another one with the \
                 environment variable TMPDIR",
            )
        })?;
        if !whole {
            return Err(too_large(name));
        }
        Self::on_disk(name, file)
    }

    fn on_disk(name: &str, file: std::fs::File) -> Result<Self, InputError> {
        let unreadable = |error: std::io::Error| unreadable(name, &error);
        let again = file.try_clone().map_err(unreadable)?;
        match TextOnDisk::scan(file).map_err(unreadable)? {
            Long::Text(text, sha256) => Ok(Self {
                name: name.to_owned(),
                text: text.start().map_err(unreadable)?,
                on_disk: Some(text),
                many_rows: true,
                sha256: digits(sha256),
                columns: ColumnMapping::default(),
            }),
            Long::Utf16 => {
                let mut file = again;
                file.rewind().map_err(unreadable)?;
                Ok(Self::from_reader(name, file)?.with_many_rows())
            }
            Long::NotText => Err(not_text(name, &NotText::Control)),
        }
    }

    fn with_many_rows(mut self) -> Self {
        self.many_rows = true;
        self
    }

    fn open(
        path: &Path,
        read: impl FnOnce(&str, std::fs::File) -> Result<Self, InputError>,
    ) -> Result<Self, InputError> {
        let name = path.display().to_string();
        match std::fs::File::open(path) {
            Ok(file) => read(&name, file),
            Err(error) => Err(unreadable(&name, &error)),
        }
    }

    /// Reads a table to the end of a stream, standard input for one.
    ///
    /// # Errors
    /// A stream that cannot be read, is longer than 4 GB, or is no text.
    pub fn from_reader(name: impl Into<String>, mut reader: impl Read) -> Result<Self, InputError> {
        let name = name.into();
        let bytes = start(&name, &mut reader, LARGEST_TABLE + 1)?;
        if bytes.len() as u64 > LARGEST_TABLE {
            return Err(too_large(&name));
        }
        Self::from_bytes(name, bytes)
    }

    fn from_bytes(name: String, bytes: Vec<u8>) -> Result<Self, InputError> {
        let sha256 = digits(Sha256::new_with_prefix(&bytes));
        match decode(bytes) {
            Ok(text) => Ok(Self::of(name, text, sha256)),
            Err(cause) => Err(not_text(&name, &cause)),
        }
    }

    /// With what its columns hold, where their names do not say it.
    #[must_use]
    pub fn with_columns(mut self, columns: ColumnMapping) -> Self {
        self.columns = columns;
        self
    }

    /// What its columns are said to hold.
    pub(crate) const fn columns(&self) -> &ColumnMapping {
        &self.columns
    }

    /// The name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text; of one that is read block by block the first block.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether of many rows most are kept in a temporary file.
    pub(crate) const fn has_many_rows(&self) -> bool {
        self.many_rows
    }

    /// The text in blocks of whole lines, of which [`text`](Self::text) is the first.
    pub(crate) fn each_block<E: From<InputError>>(
        &self,
        mut take: impl FnMut(&str) -> Result<(), E>,
    ) -> Result<(), E> {
        let Some(text) = &self.on_disk else {
            return take(&self.text);
        };
        let taken = text.each_block(|block| take(block).map_err(Stop::Taken));
        taken.map_err(|stop| match stop {
            Stop::Unreadable(error) => unreadable(&self.name, &error).into(),
            Stop::Taken(error) => error,
        })
    }

    /// SHA-256 of the file's bytes as they are, in hexadecimal digits: what `sha256sum` prints.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// The line, counted from 1, that holds the byte at `offset`.
    pub fn line_at(&self, offset: usize) -> u64 {
        let bytes = self.text.as_bytes();
        let before = &bytes[..offset.min(bytes.len())];
        1 + before
            .iter()
            .map(|byte| u64::from(*byte == b'\n'))
            .sum::<u64>()
    }
}

/// Why a text was not read to its end.
enum Stop<E> {
    Unreadable(std::io::Error),
    Taken(E),
}

impl<E> From<std::io::Error> for Stop<E> {
    fn from(error: std::io::Error) -> Self {
        Self::Unreadable(error)
    }
}

/// So many bytes of a stream, or less if it is no text; it may never end.
fn start(name: &str, reader: &mut impl Read, most: u64) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    for until in [START, most] {
        let more = until - bytes.len() as u64;
        let mut part = reader.by_ref().take(more);
        part.read_to_end(&mut bytes)
            .map_err(|error| unreadable(name, &error))?;
        if is_no_text(&bytes[..bytes.len().min(4096)]) {
            break;
        }
    }
    Ok(bytes)
}

fn digits(sha256: Sha256) -> String {
    let mut text = String::with_capacity(64);
    for byte in sha256.finalize() {
        let _ = write!(text, "{byte:02x}");
    }
    text
}

fn too_large(name: &str) -> InputError {
    InputError::new(name, "the file is larger than 4 GB")
        .with_remedy("give fewer rows: a robot needs some hundred")
}

fn not_text(name: &str, cause: &NotText) -> InputError {
    let spreadsheet = Path::new(name)
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let remedy = if spreadsheet {
        "save it as plain text in UTF-8 (in a spreadsheet: CSV UTF-8)"
    } else {
        "save it as plain text in UTF-8"
    };
    let error = match cause {
        NotText::Control => InputError::new(name, "is not a text file"),
        NotText::DamagedUtf16(line) => {
            InputError::new(name, "the UTF-16 text has half a character").at_line(*line)
        }
    };
    error.with_remedy(remedy)
}

fn unreadable(name: &str, error: &std::io::Error) -> InputError {
    InputError::new(name, format!("cannot be read: {error}"))
        .with_remedy("check the file's name and its permissions")
}
