use anstyle::{AnsiColor, Style};
use delta_cal_host::output::OutputError;
use delta_cal_host::{CalibrateError, InputError, Refused};
use std::io::Write;
use std::process::ExitCode;

const ERROR: Style = AnsiColor::Red.on_default().bold();
const HELP: Style = AnsiColor::Cyan.on_default().bold();

/// Why the command did not do what was asked. Each has its exit code.
#[derive(Debug)]
pub(crate) enum Failure {
    Refused(Refused),
    Usage { cause: String, remedy: String },
    Input(InputError),
    Output(String),
}

impl From<CalibrateError> for Failure {
    fn from(error: CalibrateError) -> Self {
        match error {
            CalibrateError::Input(error) => Self::Input(error),
            CalibrateError::Refused(refused) => Self::Refused(refused),
        }
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::Input(error)
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
        let (code, kind, cause, remedy) = match self {
            Self::Refused(refused) => {
                let remedy = refused.remedy().to_owned();
                (1, "refused", refused.to_string(), remedy)
            }
            Self::Usage { cause, remedy } => (2, "error", cause, remedy),
            Self::Input(error) => {
                let remedy = error.remedy().unwrap_or_default().to_owned();
                (3, "error", error.to_string(), remedy)
            }
            Self::Output(cause) => {
                let remedy =
                    "give another name, or check that the folder exists, is writable and has space";
                (4, "error", cause, remedy.to_owned())
            }
        };
        let mut stderr = anstream::stderr().lock();
        let _ = writeln!(stderr, "{ERROR}{kind}:{ERROR:#} {cause}");
        if !remedy.is_empty() {
            let _ = writeln!(stderr, "{HELP}help:{HELP:#} {remedy}");
        }
        ExitCode::from(code)
    }
}
