use crate::files::input_error::InputError;
use crate::files::output::OutputError;
use std::error::Error;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a campaign did not come to its end.
#[derive(Debug)]
#[non_exhaustive]
pub enum CampaignError {
    /// The campaign file, or the robot file that it names.
    Input(InputError),
    /// A file could not be read or written.
    File {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A small file could not be written.
    Output(OutputError),
    /// What is in a folder does not fit.
    Folder {
        /// Which folder.
        path: PathBuf,
        /// What is wrong with it.
        cause: String,
        /// What to do next.
        remedy: String,
    },
    /// The threads could not be started.
    Threads(String),
    /// Ctrl-C; what is finished is kept.
    Interrupted {
        /// Robots that are finished, of all scenarios.
        finished: u64,
        /// How many there are to be.
        robots: u64,
    },
}

impl CampaignError {
    pub(super) fn file(path: &Path, error: impl Into<io::Error>) -> Self {
        Self::File {
            path: path.to_owned(),
            error: error.into(),
        }
    }

    pub(super) fn folder(path: &Path, cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Folder {
            path: path.to_owned(),
            cause: cause.into(),
            remedy: remedy.into(),
        }
    }
}

impl fmt::Display for CampaignError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(formatter),
            Self::File { path, error } => write!(formatter, "{}: {error}", path.display()),
            Self::Output(error) => error.fmt(formatter),
            Self::Folder { path, cause, .. } => write!(formatter, "{}: {cause}", path.display()),
            Self::Threads(cause) => write!(formatter, "the threads cannot be started: {cause}"),
            Self::Interrupted { finished, robots } => {
                write!(
                    formatter,
                    "interrupted; {finished} of {robots} robots are finished"
                )
            }
        }
    }
}

impl Error for CampaignError {}

impl From<InputError> for CampaignError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<OutputError> for CampaignError {
    fn from(error: OutputError) -> Self {
        Self::Output(error)
    }
}
