//! Where a plan goes, and why there is none.

use super::arguments::PlanArguments;
use crate::cli::failure::Failure;
use crate::cli::paths::is_stream;
use crate::cli::print::print;
use delta_cal_host::files::output;
use delta_cal_host::planning::poses::PlanError;
use delta_cal_host::{InputError, RobotFile};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes the files, and prints the report or what goes to standard output in its place.
pub(super) fn deliver(
    arguments: &PlanArguments,
    csv: &str,
    json: &str,
    report: &str,
) -> Result<(), Failure> {
    let mut files: Vec<(&Path, &str)> = Vec::new();
    for (path, text) in [(&arguments.output, csv), (&arguments.json, json)] {
        let file = path.as_deref().filter(|path| !is_stream(path));
        files.extend(file.map(|path| (path, text)));
    }
    output::write_all(&files)?;
    let streamed = |path: &Option<PathBuf>| path.as_deref().is_some_and(is_stream);
    if streamed(&arguments.output) {
        return print(csv);
    }
    if streamed(&arguments.json) {
        return print(json);
    }
    let mut text = report.to_owned();
    if arguments.output.is_none() {
        let _ = write!(text, "\n{csv}");
    }
    for (path, _) in &files {
        let _ = writeln!(text, "Written: {}", path.display());
    }
    print(&text)
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
