use super::output::OutputError;
use crate::device::DeviceError;
use crate::{CalibrateError, InputError};
use anstyle::{AnsiColor, Style};
use std::io::Write;
use std::process::ExitCode;

const ERROR: Style = AnsiColor::Red.on_default().bold();
const HELP: Style = AnsiColor::Cyan.on_default().bold();

/// Why the command did not do what was asked. Each has its exit code.
#[derive(Debug)]
pub(crate) enum Failure {
    Calibrate(CalibrateError),
    /// Poses that do not determine the robot.
    NotDetermined {
        cause: String,
        remedy: String,
    },
    /// A limit that is not met, or not known to be.
    NotPassed(String),
    Usage {
        cause: String,
        remedy: String,
    },
    Output(String),
    /// The controller, or the link to it.
    Device {
        cause: String,
        remedy: String,
    },
    /// By Ctrl-C; the remedy may be empty.
    Interrupted {
        remedy: String,
    },
}

impl From<CalibrateError> for Failure {
    fn from(error: CalibrateError) -> Self {
        Self::Calibrate(error)
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::Calibrate(error.into())
    }
}

impl From<DeviceError> for Failure {
    fn from(error: DeviceError) -> Self {
        Self::Device {
            cause: error.to_string(),
            remedy: error.remedy().to_owned(),
        }
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        Self::Output(error.to_string())
    }
}

impl Failure {
    /// One message on standard error, and the exit code.
    pub(crate) fn report(self) -> ExitCode {
        let excerpt = match &self {
            Self::Calibrate(CalibrateError::Input(error)) => error.excerpt().map(ToOwned::to_owned),
            _ => None,
        };
        let diagnosis = match &self {
            Self::Calibrate(error) => error.diagnosis().map(ToString::to_string),
            _ => None,
        };
        let (code, kind, cause, remedy) = match self {
            Self::Calibrate(error) => {
                let (code, kind) = match &error {
                    CalibrateError::Refused(_) => (1, "refused"),
                    CalibrateError::Input(_) => (3, "error"),
                };
                (
                    code,
                    kind,
                    error.to_string(),
                    error.remedy().unwrap_or_default(),
                )
            }
            Self::NotDetermined { cause, remedy } => (1, "refused", cause, remedy),
            Self::NotPassed(cause) => (6, "not passed", cause, String::new()),
            Self::Usage { cause, remedy } => (2, "error", cause, remedy),
            Self::Output(cause) => {
                let remedy =
                    "give another name, or check that the folder exists, is writable and has space";
                (4, "error", cause, remedy.to_owned())
            }
            Self::Device { cause, remedy } => (5, "error", cause, remedy),
            // As shells do for a process that SIGINT ended.
            Self::Interrupted { remedy } => (130, "error", "interrupted".to_owned(), remedy),
        };
        let mut stderr = anstream::stderr().lock();
        let _ = writeln!(stderr, "{ERROR}{kind}:{ERROR:#} {cause}");
        if let Some(excerpt) = excerpt {
            let _ = writeln!(stderr, "{excerpt}");
        }
        if let Some(diagnosis) = diagnosis {
            let _ = writeln!(stderr, "{HELP}diagnosis:{HELP:#} {diagnosis}");
        }
        if !remedy.is_empty() {
            let _ = writeln!(stderr, "{HELP}help:{HELP:#} {remedy}");
        }
        ExitCode::from(code)
    }
}
