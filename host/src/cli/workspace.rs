//! `delta-cal workspace`.

use super::failure::Failure;
use super::paths::{ColumnsArgument, is_stream, read, refuse_same, robot_path, same_kind};
use super::print::print;
use crate::files::output;
use crate::render::json;
use crate::report::workspace;
use crate::report::workspace::contents::Contents;
use crate::workspace::{Analysis, BandOptions, Options, WorkspaceError, distances_of_path};
use crate::{InputError, InputText, RobotFile};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::path::{Path, PathBuf};
use std::time::Duration;

const HELP: &str = "\
The program writes to DIR:
  boundary.csv      x_mm,y_mm,z_mm,kind: points of the boundary, and what limits
                    the robot there: joint_minimum_1, joint_maximum_1,
                    forearm_angle_1 (the ball joints), serial_singularity_1
                    (type 1), parallel_singularity_1 (type 2); 1 to 3 is the arm
  boundary.stl      the boundary as a mesh for CAD, in mm
  influence.csv     how far each point moves along its outward normal for each
                    of the 24 parameters, in mm per mm and mm per degree; with
                    --compare also the distance to the other robot's boundary
  band.csv          if ROBOT.toml has a [tolerance]: the scatter of the
                    boundary, as sigma and quantiles
  conditioning.csv  how far the robot is from singularities over the workspace,
                    from 0 (singular) to 1 (best)
  cylinders.csv     the highest upright cylinder of each diameter inside the
                    workspace
  path.csv          with --path: each row's distance from the nearest
                    singularity
  *.svg             slices, maps and a view in space
  report.html       all of this, with a view that can be turned, in one file
                    that opens in any browser

A position is reachable if the forward model leads to it from joint angles within [joints]. The \
program respects the limits of the ball joints if [joints] has forearm_max_deg, the largest angle of \
a forearm out of its arm's plane. The cylinders stand upright about the base's z axis.

PATH.csv has the columns q1_deg,q2_deg,q3_deg (or q1_rad...) or x_mm,y_mm,z_mm (or x_m...). If it has \
both, the program uses the joint angles. It names the rows that are beyond reach.

Examples:
  delta-cal workspace robot.toml
  delta-cal workspace robot.toml --output workspace
  delta-cal workspace robot.toml --compare calibrated.toml --output workspace
  delta-cal workspace robot.toml --path samples.csv
  delta-cal workspace robot.toml --json - | jq .largest_cylinder

Exit codes:
  0  done
  2  the command line is wrong
  3  an input file is wrong, or the workspace is empty
  4  a file could not be written

With exit codes 2 and 3 no output file is written or changed.";

#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct WorkspaceArguments {
    /// The robot
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// Compare with this robot, for example the same robot after its calibration
    #[arg(long, value_name = "CALIBRATED.toml", value_parser = robot_path())]
    compare: Option<PathBuf>,
    /// Write boundary, mesh, figures and report to this folder, replacing files of these names
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Write the figures of the table as JSON to this file, or with - to standard output in place of
    /// the table
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
    /// Compute the distance of each row of this file from the nearest singularity; - reads standard
    /// input
    #[arg(long, value_name = "PATH.csv")]
    path: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The largest distance of a computed boundary point from the true boundary
    #[arg(long, value_name = "MM", default_value_t = 0.01, value_parser = length, allow_negative_numbers = true)]
    tolerance: f64,
    /// The distance between neighbouring lines along which the program searches the boundary
    /// [default: 1/80 of the longest side]
    #[arg(long, value_name = "MM", value_parser = length, allow_negative_numbers = true)]
    spacing: Option<f64>,
    /// The number of robots to draw for the stated tolerance
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    robots: u32,
    /// The seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// A length above 0, mm.
fn length(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "it is not a number".to_owned())?;
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err("it must be a finite number above 0, in mm".to_owned())
    }
}

pub(crate) fn run(arguments: &WorkspaceArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    let other = match &arguments.compare {
        Some(path) => Some(RobotFile::read(&InputText::from_file(path)?)?),
        None => None,
    };
    if let Some(other) = &other {
        same_kind("--compare", &robot, other)?;
    }
    let options = Options {
        tolerance: arguments.tolerance,
        spacing: arguments.spacing,
    };
    let band = BandOptions {
        robots: arguments.robots,
        seed: arguments.seed,
        ..BandOptions::default()
    };
    let bar = Bar::new();
    bar.show("path");
    let path = match &arguments.path {
        Some(path) => Some(distances_of_path(&robot, &read(path, &arguments.columns)?)?),
        None => None,
    };
    let analysis = Analysis::compute(&robot, other.as_ref(), path, &options, &band, &mut |step| {
        bar.show(step);
    })
    .map_err(|(error, of)| failure(&error, &of))?;
    let json_text = json::text(&workspace::json::report(&analysis));
    let mut contents = Contents::default();
    if arguments.output.is_some() {
        bar.show("figures and report");
        contents = Contents::of(&analysis)?;
    }
    bar.finish();
    let json_file = arguments.json.as_deref().filter(|path| !is_stream(path));
    let written = write(
        &contents,
        arguments.output.as_deref(),
        json_file.map(|p| (p, json_text.as_str())),
    )?;
    if arguments.json.is_some() && json_file.is_none() {
        return print(&json_text);
    }
    print(&format!("{}{written}", workspace::table::render(&analysis)))
}

fn check_paths(arguments: &WorkspaceArguments) -> Result<(), Failure> {
    let (json, output) = (arguments.json.as_deref(), arguments.output.as_deref());
    let inputs = [
        ("the robot file", Some(arguments.robot.as_path())),
        ("the robot to compare with", arguments.compare.as_deref()),
        ("the path", arguments.path.as_deref()),
    ];
    if output.is_some_and(is_stream) {
        return Err(Failure::Usage {
            cause: "--output needs the name of a folder".to_owned(),
            remedy: "only --json can write to standard output, as --json -".to_owned(),
        });
    }
    for input in inputs {
        refuse_same("--json", json, input, "give the output another name")?;
        if let Some(folder) = output {
            for name in Contents::names() {
                let remedy = "it would be replaced: give another folder";
                refuse_same("--output", Some(&folder.join(name)), input, remedy)?;
            }
        }
    }
    Ok(())
}

/// Which robot has no workspace, and why.
fn failure(error: &WorkspaceError, of: &str) -> Failure {
    if matches!(error, WorkspaceError::TooFine { .. }) {
        return Failure::Usage {
            cause: format!("{of}: {error}"),
            remedy: error.remedy().to_owned(),
        };
    }
    let error = InputError::new(of, error.to_string()).with_remedy(error.remedy());
    error.into()
}

/// Writes everything and says so.
fn write(
    contents: &Contents,
    folder: Option<&Path>,
    json: Option<(&Path, &str)>,
) -> Result<String, Failure> {
    let mut files: Vec<(PathBuf, &[u8])> = Vec::new();
    if let Some(folder) = folder {
        output::make_folder(folder)?;
        files.extend(
            contents
                .files()
                .map(|(name, bytes)| (folder.join(name), bytes)),
        );
    }
    files.extend(json.map(|(path, text)| (path.to_owned(), text.as_bytes())));
    let borrowed: Vec<_> = files
        .iter()
        .map(|(path, bytes)| (path.as_path(), *bytes))
        .collect();
    output::write_all_bytes(&borrowed)?;
    // A folder's files are named in the help; here it is enough to say where they are.
    let names = folder.into_iter().chain(json.map(|(path, _)| path));
    Ok(names.fold(String::from("\n"), |text, name| {
        text + &format!("Written: {}\n", name.display())
    }))
}

/// What is being computed, on a terminal; nothing elsewhere.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    fn show(&self, step: &'static str) {
        self.0.set_message(step);
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}
