//! The text of an input file, with its name for messages.

use crate::files::input_error::InputError;
use std::io::Read;
use std::path::Path;

/// A file's name and text: UTF-8, without byte order mark, lines ended by `\n`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputText {
    name: String,
    text: String,
}

impl InputText {
    /// A text that is already in memory.
    pub fn new(name: impl Into<String>, text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self {
            name: name.into(),
            text: text.replace("\r\n", "\n").replace('\r', "\n"),
        }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read or is not UTF-8.
    pub fn from_file(path: &Path) -> Result<Self, InputError> {
        let name = path.display().to_string();
        match std::fs::read(path) {
            Ok(bytes) => Self::from_bytes(name, &bytes),
            Err(error) => Err(unreadable(name, &error)),
        }
    }

    /// Reads to the end of a stream, standard input for one.
    ///
    /// # Errors
    /// A stream that cannot be read or is not UTF-8.
    pub fn from_reader(name: impl Into<String>, mut reader: impl Read) -> Result<Self, InputError> {
        let name = name.into();
        let mut bytes = Vec::new();
        match reader.read_to_end(&mut bytes) {
            Ok(_) => Self::from_bytes(name, &bytes),
            Err(error) => Err(unreadable(name, &error)),
        }
    }

    fn from_bytes(name: String, bytes: &[u8]) -> Result<Self, InputError> {
        let spreadsheet = Path::new(&name)
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
        let remedy = if spreadsheet {
            "save it as plain text in UTF-8 (in a spreadsheet: CSV UTF-8)"
        } else {
            "save it as plain text in UTF-8"
        };
        if bytes.contains(&0) {
            return Err(InputError::new(name, "is not a text file").with_remedy(remedy));
        }
        match std::str::from_utf8(bytes) {
            Ok(text) => Ok(Self::new(name, text)),
            Err(error) => {
                let before = &bytes[..error.valid_up_to()];
                Err(InputError::new(name, "the file is not UTF-8 text")
                    .at_line(1 + count_newlines(before))
                    .with_remedy(remedy))
            }
        }
    }

    /// The name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The line, counted from 1, that holds the byte at `offset`.
    pub fn line_at(&self, offset: usize) -> u64 {
        let bytes = self.text.as_bytes();
        1 + count_newlines(&bytes[..offset.min(bytes.len())])
    }
}

fn unreadable(name: String, error: &std::io::Error) -> InputError {
    InputError::new(name, format!("cannot be read: {error}"))
        .with_remedy("check the file's name and its permissions")
}

fn count_newlines(bytes: &[u8]) -> u64 {
    bytes.iter().map(|byte| u64::from(*byte == b'\n')).sum()
}
