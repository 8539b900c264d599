//! Why a command failed, and its exit code.

use crate::device::DeviceError;
use crate::{CalibrateError, InputError};
use anstyle::{AnsiColor, Style};
use std::io::Write;
use std::process::ExitCode;

const ERROR: Style = AnsiColor::Red.on_default().bold();
const HELP: Style = AnsiColor::Cyan.on_default().bold();

/// One message on standard error, and an exit code.
#[derive(Debug)]
pub(crate) struct Failure {
    code: u8,
    cause: String,
    /// The faulty line as it stands in the file.
    excerpt: Option<String>,
    diagnosis: Option<String>,
    /// What to do next; may be empty.
    remedy: String,
}

impl Failure {
    fn new(code: u8, cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            code,
            cause: cause.into(),
            excerpt: None,
            diagnosis: None,
            remedy: remedy.into(),
        }
    }

    /// The measurements cannot calibrate the robot.
    pub(crate) fn refused(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(1, cause, remedy)
    }

    /// An invalid command line.
    pub(crate) fn usage(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(2, cause, remedy)
    }

    /// A file could not be written.
    pub(crate) fn output(cause: impl Into<String>) -> Self {
        let remedy =
            "give another name, or check that the folder exists, is writable and has space";
        Self::new(4, cause, remedy)
    }

    /// A failure of the controller or of the link to it.
    pub(crate) fn device(cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(5, cause, remedy)
    }

    /// A limit that is not met, or not shown to be met.
    pub(crate) fn not_passed(cause: impl Into<String>) -> Self {
        Self::new(6, cause, "")
    }

    /// Prints the message and returns the exit code.
    pub(crate) fn report(self) -> ExitCode {
        let kind = match self.code {
            1 => "refused",
            6 => "not passed",
            _ => "error",
        };
        let mut stderr = anstream::stderr().lock();
        let _ = writeln!(stderr, "{ERROR}{kind}:{ERROR:#} {}", self.cause);
        if let Some(excerpt) = self.excerpt {
            let _ = writeln!(stderr, "{excerpt}");
        }
        if let Some(diagnosis) = self.diagnosis {
            let _ = writeln!(stderr, "{HELP}diagnosis:{HELP:#} {diagnosis}");
        }
        if !self.remedy.is_empty() {
            let _ = writeln!(stderr, "{HELP}help:{HELP:#} {}", self.remedy);
        }
        ExitCode::from(self.code)
    }
}

impl From<CalibrateError> for Failure {
    fn from(error: CalibrateError) -> Self {
        let (code, excerpt) = match &error {
            CalibrateError::Refused(_) => (1, None),
            CalibrateError::Input(error) => (3, error.excerpt.as_deref().map(str::to_owned)),
        };
        Self {
            excerpt,
            diagnosis: error.diagnosis().map(ToString::to_string),
            ..Self::new(code, error.to_string(), error.remedy().unwrap_or_default())
        }
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        CalibrateError::from(error).into()
    }
}

impl From<DeviceError> for Failure {
    fn from(error: DeviceError) -> Self {
        Self::device(error.to_string(), error.remedy())
    }
}
