//! The text of an input file, with its name for messages.

use crate::files::columns::ColumnMapping;
use crate::files::decode::{NotText, decode, is_no_text};
use crate::files::input_error::InputError;
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::io::Read;
use std::path::Path;

/// No file of a robot or a campaign is nearly as large.
const LARGEST_SETTINGS: u64 = 1 << 20;
/// A table of some 70 million rows.
const LARGEST_TABLE: u64 = 4 << 30;
/// What is no text shows this in so many bytes.
const START: u64 = 1 << 16;

/// A file's name and text: without byte order mark, lines ended by `\n`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputText {
    name: String,
    text: String,
    sha256: String,
    columns: ColumnMapping,
}

impl InputText {
    /// A text that is already in memory.
    pub fn new(name: impl Into<String>, text: &str) -> Self {
        let sha256 = sha256(text.as_bytes());
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self::of(name.into(), text.to_owned(), sha256)
    }

    fn of(name: String, mut text: String, sha256: String) -> Self {
        if text.contains('\r') {
            text = text.replace("\r\n", "\n").replace('\r', "\n");
        }
        Self {
            name,
            text,
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
        let mut bytes = Vec::new();
        for until in [START, LARGEST_TABLE + 1] {
            let more = until - bytes.len() as u64;
            let mut part = reader.by_ref().take(more);
            part.read_to_end(&mut bytes)
                .map_err(|error| unreadable(&name, &error))?;
            // Also where the whole would never end.
            if is_no_text(&bytes[..bytes.len().min(4096)]) {
                break;
            }
        }
        if bytes.len() as u64 > LARGEST_TABLE {
            return Err(InputError::new(name, "the file is larger than 4 GB")
                .with_remedy("give fewer rows: a robot needs some hundred"));
        }
        Self::from_bytes(name, bytes)
    }

    fn from_bytes(name: String, bytes: Vec<u8>) -> Result<Self, InputError> {
        let spreadsheet = Path::new(&name)
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
        let remedy = if spreadsheet {
            "save it as plain text in UTF-8 (in a spreadsheet: CSV UTF-8)"
        } else {
            "save it as plain text in UTF-8"
        };
        let sha256 = sha256(&bytes);
        match decode(bytes) {
            Ok(text) => Ok(Self::of(name, text, sha256)),
            Err(NotText::Control) => {
                Err(InputError::new(name, "is not a text file").with_remedy(remedy))
            }
            Err(NotText::DamagedUtf16(line)) => Err(InputError::new(
                name,
                "the UTF-16 text has half a character",
            )
            .at_line(line)
            .with_remedy(remedy)),
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

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
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

fn sha256(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(64);
    for byte in Sha256::digest(bytes) {
        let _ = write!(text, "{byte:02x}");
    }
    text
}

fn unreadable(name: &str, error: &std::io::Error) -> InputError {
    InputError::new(name, format!("cannot be read: {error}"))
        .with_remedy("check the file's name and its permissions")
}
