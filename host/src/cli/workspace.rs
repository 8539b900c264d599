//! `delta-cal workspace`.

use super::failure::Failure;
use super::output::{self, Progress, deliver};
use super::paths::{check, is_stream, robot_path};
use crate::files::length::length;
use crate::report::workspace;
use crate::workspace::{Analysis, Options, WorkspaceError};
use crate::{InputError, InputText, RobotFile};
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/workspace.txt"))]
pub(crate) struct WorkspaceArguments {
    /// The robot
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// Write boundary, mesh, influence and section to this folder, replacing files of these names
    #[arg(long = "output", value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Write the report as JSON to this file; - prints it in place of the text
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
    /// Maximum distance of a computed boundary point from the true boundary
    #[arg(long, alias = "tolerance", value_name = "LENGTH", value_parser = length, default_value = "0.01mm", allow_negative_numbers = true)]
    limit: f64,
    /// Distance between the lines along which the boundary is searched [default: 1/80 of the
    /// longest side]
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_negative_numbers = true)]
    spacing: Option<f64>,
}

pub(crate) fn run(arguments: &WorkspaceArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    let options = Options {
        tolerance: arguments.limit,
        spacing: arguments.spacing,
    };
    let waiting = Progress::spinner("computing the workspace");
    let analysis = Analysis::compute(&robot, &options, &mut |step| waiting.now(step))
        .map_err(|error| failure(&error, &robot.name))?;
    let mut files = vec![(
        arguments.json.clone(),
        workspace::to_json(&analysis).into_bytes(),
    )];
    if let Some(folder) = &arguments.folder {
        waiting.now("files");
        let contents = workspace::files(&analysis).into_iter();
        files.extend(contents.map(|(name, bytes)| (Some(folder.join(name)), bytes)));
        output::make_folder(folder)?;
    }
    drop(waiting);
    let files: Vec<_> = files
        .iter()
        .map(|(path, bytes)| (path.as_deref(), bytes))
        .collect();
    deliver(&files, workspace::to_text(&analysis) + "\n")
}

fn check_paths(arguments: &WorkspaceArguments) -> Result<(), Failure> {
    let folder = arguments.folder.as_deref();
    if folder.is_some_and(is_stream) {
        return Err(Failure::usage(
            "--output needs the name of a folder",
            "use --json - to write to standard output",
        ));
    }
    let files = folder.map(|folder| workspace::NAMES.map(|name| folder.join(name)));
    let files = files
        .iter()
        .flatten()
        .map(|path| ("--output", path.as_path()));
    let json = arguments.json.as_deref().map(|path| ("--json", path));
    let outputs: Vec<_> = files.chain(json).collect();
    check(&[("the robot file", &arguments.robot)], &outputs, None)
}

fn failure(error: &WorkspaceError, robot: &str) -> Failure {
    if matches!(error, WorkspaceError::TooFine { .. }) {
        return Failure::usage(format!("{robot}: {error}"), error.remedy());
    }
    InputError::new(robot, error.to_string())
        .with_remedy(error.remedy())
        .into()
}
