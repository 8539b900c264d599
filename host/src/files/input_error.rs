//! What is wrong with an input file, where, and what to do about it.

use std::error::Error;
use std::fmt;

/// One fault in an input file. Displayed as `file:line: column x_mm: cause`, in one line.
#[derive(Debug, Clone, PartialEq)]
pub struct InputError {
    file: Box<str>,
    line: Option<u64>,
    place: Option<Place>,
    cause: Box<str>,
    excerpt: Option<Box<str>>,
    remedy: Option<Box<str>>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Place {
    Column(Box<str>),
    Key(Box<str>),
}

impl InputError {
    /// A fault of the file as a whole.
    pub fn new(file: impl Into<String>, cause: impl Into<String>) -> Self {
        Self {
            file: file.into().into(),
            line: None,
            place: None,
            cause: cause.into().into(),
            excerpt: None,
            remedy: None,
        }
    }

    /// A file that cannot be read.
    pub(crate) fn unreadable(file: &str, error: &std::io::Error) -> Self {
        Self::new(file, format!("cannot be read: {error}"))
            .with_remedy("check the file's name and its permissions")
    }

    pub(super) fn file(&self) -> &str {
        &self.file
    }

    /// The line at fault, counted from 1.
    #[must_use]
    pub fn at_line(mut self, line: u64) -> Self {
        self.line = Some(line);
        self
    }

    /// The CSV column at fault.
    #[must_use]
    pub fn at_column(mut self, column: impl Into<String>) -> Self {
        self.place = Some(Place::Column(column.into().into()));
        self
    }

    /// The TOML key at fault.
    #[must_use]
    pub fn at_key(mut self, key: impl Into<String>) -> Self {
        self.place = Some(Place::Key(key.into().into()));
        self
    }

    /// The line at fault as it stands in the file, with the place marked.
    #[must_use]
    pub(crate) fn with_excerpt(mut self, excerpt: String) -> Self {
        self.excerpt = Some(excerpt.into());
        self
    }

    /// What to do next.
    #[must_use]
    pub fn with_remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into().into());
        self
    }

    /// The line at fault, if it is one.
    pub fn line(&self) -> Option<u64> {
        self.line
    }

    /// The line at fault as it stands in the file, with the place marked: several lines.
    pub fn excerpt(&self) -> Option<&str> {
        self.excerpt.as_deref()
    }

    /// What to do next, if that is not plain from the cause.
    pub fn remedy(&self) -> Option<&str> {
        self.remedy.as_deref()
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:", self.file)?;
        if let Some(line) = self.line {
            write!(formatter, "{line}:")?;
        }
        match &self.place {
            Some(Place::Column(name)) => write!(formatter, " column {name}:")?,
            Some(Place::Key(name)) => write!(formatter, " {name}:")?,
            None => {}
        }
        write!(formatter, " {}", self.cause)
    }
}

impl Error for InputError {}
