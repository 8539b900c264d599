//! Where a plan goes, and why there is none.

use super::arguments::PlanArguments;
use crate::cli::failure::Failure;
use crate::cli::outputs;
use crate::planning::poses::PlanError;
use crate::{InputError, RobotFile};

/// Writes the files, and prints the report or what goes to standard output in its place. Without a file the poses are part of
/// the report.
pub(super) fn deliver(
    arguments: &PlanArguments,
    csv: &str,
    json: &str,
    report: &str,
) -> Result<(), Failure> {
    let (output, json_file) = (arguments.output.as_deref(), arguments.json.as_deref());
    let text = match output {
        Some(_) => report.to_owned(),
        None => format!("{report}\n{csv}"),
    };
    outputs::deliver(&[(output, csv), (json_file, json)], text)
}

/// Each cause has its exit code.
pub(crate) fn failure(robot: &RobotFile, error: PlanError) -> Failure {
    let remedy = error.remedy();
    match error {
        PlanError::NoPose => Failure::from(
            InputError::new(&robot.name, error.to_string())
                .at_key("[joints]")
                .with_remedy(remedy),
        ),
        PlanError::Singular | PlanError::NotDetermined { .. } => Failure::NotDetermined {
            cause: error.to_string(),
            remedy: remedy.to_owned(),
        },
        _ => Failure::Usage {
            cause: error.to_string(),
            remedy: remedy.to_owned(),
        },
    }
}
