//! `delta-cal plan`.

use super::choices::MethodArgument;
use super::failure::Failure;
use super::paths::{is_stream, refuse_same, robot_path};
use super::print::print;
use super::progress::Waiting;
use clap::{ArgGroup, Args, ValueEnum};
use delta_cal_host::files::{kinematics, output};
use delta_cal_host::planning::poses::{
    Criterion, LEAST_POSES, MOST_POSES, PlanError, PlanRequest, PosePlan, PosesNeeded, Region,
    plan, poses_needed,
};
use delta_cal_host::render::json;
use delta_cal_host::report::plan;
use delta_cal_host::{InputError, InputText, RobotFile, SamplesFile};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;

pub(crate) const HELP: &str = "\
POSES.csv has the columns of a samples file and holds the positions of the nominal robot. Drive to \
the joint angles of each row, measure, and write the measured position over x_mm,y_mm,z_mm. Once the \
file holds measured positions, the program replaces it only with --force.

The program plans for the [noise] and [tolerance] of ROBOT.toml. Without a [noise] it assumes 0.02 mm \
and 0.002 degrees; without a [tolerance] it assumes that nothing is known of the parameters \
beforehand.

--within takes a box x=-100..100,y=-100..100,z=-500..-400 or a cylinder about the z axis \
r=200,z=-500..-400, in mm in the robot's frame; z is negative below the base.

Examples:
  delta-cal plan robot.toml --count 12 --output poses.csv
  delta-cal plan robot.toml --accuracy 0.05mm --output poses.csv
  delta-cal plan robot.toml --count 20 --within r=150,z=-500..-350
  delta-cal plan robot.toml --count 12 --output - | delta-cal check robot.toml -

Exit codes:
  0  done
  1  no poses within these limits determine the robot
  2  the command line is wrong: fewer than 8 poses, a region outside the
     workspace, measured positions in POSES.csv
  3  the robot file is wrong, or its limits exclude everything
  4  a file could not be written

With exit codes 1, 2 and 3 no output file is written or changed.";

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("poses").args(["count", "accuracy"]).required(true).multiple(true))]
pub(crate) struct PlanArguments {
    /// The robot as it is known before the measurement
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// The number of poses to measure, 8 to 500; without it the program takes as many as --accuracy
    /// needs
    #[arg(long, value_name = "N", value_parser = whole_number, allow_negative_numbers = true)]
    count: Option<usize>,
    /// Choose only poses within this box or cylinder, such as x=-100..100,y=-100..100,z=-500..-400
    /// or r=200,z=-500..-400
    #[arg(long, value_name = "BOX|CYLINDER")]
    within: Option<Region>,
    /// Also say how many poses reduce one sigma of the position over the workspace (or over the box
    /// or cylinder) to this length: a number with nm, um, mm, cm or m; without a unit it is in mm
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    accuracy: Option<Accuracy>,
    /// What the chosen poses minimise
    #[arg(long, value_enum, default_value_t = CriterionArgument::A)]
    criterion: CriterionArgument,
    /// The method with which the robot will be calibrated
    #[arg(long, value_enum, default_value_t = MethodArgument::Ikm)]
    method: MethodArgument,
    /// The seed of the random numbers; the same seed gives the same poses
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the poses to this file, or with - to standard output in place of the report
    #[arg(long, value_name = "POSES.csv")]
    output: Option<PathBuf>,
    /// Write the plan as JSON to this file, or with - to standard output in place of the report
    #[arg(long, value_name = "PLAN.json")]
    json: Option<PathBuf>,
    /// Replace POSES.csv even if it holds measured positions
    #[arg(long)]
    force: bool,
}

fn whole_number(text: &str) -> Result<usize, String> {
    text.parse()
        .map_err(|_| format!("a whole number is needed, {LEAST_POSES} to {MOST_POSES}"))
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum CriterionArgument {
    /// The mean square of the parameter error, angles times the upper arm's length
    A,
    /// The volume of the parameters' confidence region
    D,
}

/// Planned positions are read back to the nominal ones within this, mm; measured ones are not.
const WRITTEN: f64 = 1e-5;

/// Units of a length in mm; the last one ends the others. The micro sign has two code points.
const UNITS: [(&str, f64); 7] = [
    ("nm", 1e-6),
    ("um", 1e-3),
    ("\u{b5}m", 1e-3),
    ("\u{3bc}m", 1e-3),
    ("mm", 1.0),
    ("cm", 10.0),
    ("m", 1e3),
];

/// A length on the command line, mm.
#[derive(Debug, Clone, Copy)]
struct Accuracy(f64);

impl FromStr for Accuracy {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, factor) = UNITS
            .into_iter()
            .find_map(|(unit, factor)| Some((text.strip_suffix(unit)?, factor)))
            .unwrap_or((text, 1.0));
        match number.trim().parse::<f64>() {
            Ok(value) if value > 0.0 && (value * factor).is_finite() => Ok(Self(value * factor)),
            _ => Err(
                "a length greater than 0 is needed, in nm, um, mm, cm or m, as 0.05mm or 50um"
                    .to_owned(),
            ),
        }
    }
}

pub(crate) fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    if let (Some(path), false) = (&arguments.output, arguments.force) {
        keep_measurements(path, &robot)?;
    }
    let mut request = PlanRequest {
        count: arguments.count.unwrap_or(LEAST_POSES),
        method: arguments.method.method(),
        criterion: match arguments.criterion {
            CriterionArgument::A => Criterion::A,
            CriterionArgument::D => Criterion::D,
        },
        region: arguments.within,
        seed: arguments.seed,
        ..PlanRequest::new(&robot)
    };
    let needed = match arguments.accuracy {
        Some(Accuracy(accuracy)) => Some(needed(&request, accuracy)?),
        None => None,
    };
    if let (None, Some(needed)) = (arguments.count, &needed) {
        request.count = needed.rms;
        if needed.rms > MOST_POSES {
            return Err(too_accurate(needed));
        }
    }
    let waiting = Waiting::new(format!("planning {} poses", request.count));
    let planned = plan(&request).map_err(|error| failure(&robot, error))?;
    drop(waiting);
    write(arguments, &request, &planned, needed.as_ref())
}

fn needed(request: &PlanRequest<'_>, accuracy: f64) -> Result<PosesNeeded, Failure> {
    let _waiting = Waiting::new(format!("how many poses reach {accuracy} mm"));
    poses_needed(request, accuracy).map_err(|error| failure(request.robot, error))
}

fn too_accurate(needed: &PosesNeeded) -> Failure {
    Failure::Usage {
        cause: format!(
            "to know the position to {} mm (one sigma) takes about {} poses, more than \
             {MOST_POSES}",
            needed.accuracy, needed.rms
        ),
        remedy: "ask for less accuracy, give the number of poses with --count, or measure with \
                 less noise and state that [noise] in the robot file"
            .to_owned(),
    }
}

/// A file of planned poses becomes one of measured ones by hand: what is in it then is not written
/// over.
fn keep_measurements(path: &Path, robot: &RobotFile) -> Result<(), Failure> {
    if is_stream(path) || !path.is_file() {
        return Ok(());
    }
    let replaceable =
        |text: InputText| text.text().trim().is_empty() || holds_nominal_positions(&text, robot);
    if InputText::from_file(path).is_ok_and(replaceable) {
        return Ok(());
    }
    Err(Failure::Usage {
        cause: format!(
            "--output {} exists and is not a plan for this robot: it may hold measured positions",
            path.display()
        ),
        remedy: "give the output another name, or --force to replace the file".to_owned(),
    })
}

fn holds_nominal_positions(text: &InputText, robot: &RobotFile) -> bool {
    SamplesFile::read(text, &robot.limits).is_ok_and(|samples| {
        samples.rows.iter().all(|row| {
            let nominal = robot.robot.forward(&row.value.joints);
            nominal.is_ok_and(|x| (x - row.value.position).norm() <= WRITTEN)
        })
    })
}

fn write(
    arguments: &PlanArguments,
    request: &PlanRequest<'_>,
    planned: &PosePlan,
    needed: Option<&PosesNeeded>,
) -> Result<(), Failure> {
    let csv = kinematics::to_csv(&planned.poses);
    let json = json::text(&plan::json::report(request, planned, needed));
    let mut files: Vec<(&Path, &str)> = Vec::new();
    for (path, text) in [(&arguments.output, &csv), (&arguments.json, &json)] {
        let file = path.as_deref().filter(|path| !is_stream(path));
        files.extend(file.map(|path| (path, text.as_str())));
    }
    output::write_all(&files)?;
    let streamed = |path: &Option<PathBuf>| path.as_deref().is_some_and(is_stream);
    if streamed(&arguments.output) {
        return print(&csv);
    }
    if streamed(&arguments.json) {
        return print(&json);
    }
    let mut text = plan::table::render(request, planned, needed);
    if arguments.output.is_none() {
        let _ = write!(text, "\n{csv}");
    }
    for (path, _) in &files {
        let _ = writeln!(text, "Written: {}", path.display());
    }
    print(&text)
}

fn check_paths(arguments: &PlanArguments) -> Result<(), Failure> {
    let robot = ("the robot file", Some(arguments.robot.as_path()));
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    let remedy = "give the output another name";
    refuse_same("--output", output, robot, remedy)?;
    refuse_same("--json", json, robot, remedy)?;
    refuse_same("--json", json, ("--output", output), remedy)?;
    if [output, json]
        .into_iter()
        .all(|path| path.is_some_and(is_stream))
    {
        return Err(Failure::Usage {
            cause: "--output and --json cannot both be standard output".to_owned(),
            remedy: "give one of them the name of a file".to_owned(),
        });
    }
    Ok(())
}

/// Each cause has its exit code.
pub(super) fn failure(robot: &RobotFile, error: PlanError) -> Failure {
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

#[cfg(test)]
mod tests {
    use super::Accuracy;

    #[test]
    fn an_accuracy_is_the_same_in_every_unit() {
        for written in [
            "0.05",
            "0.05mm",
            " 50um",
            "50 \u{b5}m",
            "50\u{3bc}m",
            "5e4nm",
            "0.005cm",
            "5e-5m",
        ] {
            let found = written.parse().map(|Accuracy(length)| length);
            // Two roundings.
            assert!(
                found.is_ok_and(|length| (length - 0.05).abs() < 1e-16),
                "{written}"
            );
        }
        for written in [
            "", "mm", "0", "-1mm", "5kg", "0,05mm", "nan", "inf", "1e308m", "5 m m",
        ] {
            assert!(written.parse::<Accuracy>().is_err(), "{written}");
        }
    }
}
