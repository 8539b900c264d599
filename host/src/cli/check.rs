//! `delta-cal check`.

use super::choices::{FrameArgument, MethodArgument};
use super::failure::Failure;
use super::outputs::deliver;
use super::paths::{ColumnsArgument, read, refuse_same, robot_path};
use super::progress::Waiting;
use crate::planning::measurements::{CheckRequest, MeasurementCheck};
use crate::planning::observability::Observability;
use crate::planning::poses::{PlanRequest, Region, next_poses};
use crate::render::json;
use crate::report::check::{json as check_json, measurements, table};
use crate::{InputText, MeasurementsToCheck, ObservationsToCheck, PosesToCheck, RobotFile};
use clap::Args;
use std::path::PathBuf;

pub(crate) const HELP: &str = "\
The program looks only at the joint angles, so SAMPLES.csv may hold measured positions in any frame, \
or the poses of delta-cal plan. Rows that hold no measurement yet count like the others, and the \
program names their lines. It assumes the [noise] of ROBOT.toml, or 0.02 mm and 0.002 \
degrees if none is stated. It ignores the [tolerance], except when it proposes poses to add.

Of heights, distances and single coordinates (see delta-cal calibrate --help) the program says which \
position error a calibration is expected to leave of what the [tolerance] allows, what stays unknown \
with the remedy that costs least, and which measurements with the same instruments would help most. \
It fits the file to find the instruments; where nothing is measured yet it puts them where delta-cal \
plan does.

Observability indices, of the singular values s1 >= ... >= sL of the weighted Jacobian of n poses \
(for files with x, y and z in every row and nothing else):
  O1  (s1 ... sL)^(1/L) / sqrt(n)  volume of the confidence region
                                   (Borm and Menq 1989, 1991)
  O2  sL / s1                      inverse of the condition
                                   (Driels and Pathre 1990)
  O3  sL                           the combination of parameters known worst
                                   (Nahvi, Hollerbach and Hayward 1994)
  O4  sL^2 / s1                    noise amplification index
                                   (Nahvi and Hollerbach 1996)
  O5  1 / (1/s1 + ... + 1/sL)      (Sun and Hollerbach 2008)

A larger index is better. The indices compare sets of poses for the same robot only.

The leverage of a sample says how many parameters the sample decides (total), and how much the fit \
follows that one of its residuals which the other samples check least (largest, from 0 to 1; at 1 \
nothing shows an error of it).

Examples:
  delta-cal check robot.toml samples.csv
  delta-cal check robot.toml samples.csv --add 8 --within r=200,z=-600..-300
  delta-cal check robot.toml samples.csv --json - | jq .determined
  delta-cal check robot.toml touches.csv --add 6

Exit codes:
  0  the samples determine every parameter; heights, distances and single
     coordinates: a calibration is expected to halve the position error
  1  they do not: without a [tolerance] a calibration would be refused, and
     with one the tolerance would decide the rest
  2  the command line is wrong
  3  an input file is wrong, or the robot cannot reach a sample's joint angles
  4  a file could not be written";

#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    /// The robot before calibration
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// Joint angles and positions; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    samples: PathBuf,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The method with which the robot will be calibrated
    #[arg(long, value_enum, default_value_t = MethodArgument::Joint)]
    method: MethodArgument,
    /// The frame of the coordinates, if rows hold less than x, y and z
    #[arg(long, value_enum, default_value_t = FrameArgument::Base)]
    frame: FrameArgument,
    /// The number of poses or measurements to propose in addition
    #[arg(long, value_name = "N", default_value_t = 4, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(0..=100))]
    add: u16,
    /// Propose only poses within this box or cylinder, as delta-cal plan does
    #[arg(long, value_name = "BOX|CYLINDER")]
    within: Option<Region>,
    /// Write the check as JSON to this file, or with - to standard output in place of the report
    #[arg(long, value_name = "CHECK.json")]
    json: Option<PathBuf>,
}

pub(crate) fn run(arguments: &CheckArguments) -> Result<(), Failure> {
    let json_file = arguments.json.as_deref();
    for other in [
        ("the robot file", &arguments.robot),
        ("the samples file", &arguments.samples),
    ] {
        let other = (other.0, Some(other.1.as_path()));
        refuse_same("--json", json_file, other, "give the output another name")?;
    }
    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    let text = read(&arguments.samples, &arguments.columns)?;
    match MeasurementsToCheck::read(&text, &robot)? {
        MeasurementsToCheck::Positions(poses) => positions(arguments, &robot, &poses),
        MeasurementsToCheck::Observations(samples) => observations(arguments, &robot, &samples),
    }
}

/// x, y and z in every row.
fn positions(
    arguments: &CheckArguments,
    robot: &RobotFile,
    poses: &PosesToCheck,
) -> Result<(), Failure> {
    let PosesToCheck {
        samples,
        unmeasured,
    } = poses;
    let method = arguments.method.method();
    let waiting = Waiting::new("looking for poses to add".to_owned());
    let observability = Observability::new(robot, samples, method)?;
    let request = PlanRequest {
        count: usize::from(arguments.add),
        method,
        region: arguments.within,
        ..PlanRequest::new(robot)
    };
    let next = next_poses(&request, &observability.poses)
        .map_err(|error| super::plan::failure(robot, error))?;
    drop(waiting);
    let report = check_json::report(robot, samples, unmeasured, method, &observability, &next);
    let text = table::render(robot, samples, unmeasured, method, &observability, &next);
    deliver(&[(arguments.json.as_deref(), &json::text(&report))], text)?;
    if observability.determined() {
        return Ok(());
    }
    let more = if next.poses.is_empty() {
        "measure more poses, at other joint angles"
    } else {
        "measure the proposed poses as well"
    };
    Err(not_determined(
        robot,
        &table::verdict(&observability, samples, unmeasured),
        more,
    ))
}

/// Heights, distances, single coordinates.
fn observations(
    arguments: &CheckArguments,
    robot: &RobotFile,
    samples: &ObservationsToCheck,
) -> Result<(), Failure> {
    if !matches!(arguments.method, MethodArgument::Joint) {
        return Err(Failure::Usage {
            cause: "--method can only be used with files that hold x, y and z in every row and nothing else"
                .to_owned(),
            remedy: "leave out the option".to_owned(),
        });
    }
    let request = CheckRequest {
        frame: arguments.frame.frame(),
        add: usize::from(arguments.add),
        region: arguments.within,
    };
    let waiting = Waiting::new("looking for measurements to add".to_owned());
    let check = MeasurementCheck::new(robot, samples, request)?;
    drop(waiting);
    let unmeasured = &samples.unmeasured;
    let report = measurements::json(&check, unmeasured);
    let text = measurements::text(&check, unmeasured);
    deliver(&[(arguments.json.as_deref(), &json::text(&report))], text)?;
    if check.worthwhile() {
        return Ok(());
    }
    let more = if check.next.is_empty() {
        "measure more, at other joint angles or with another instrument"
    } else {
        "take the proposed measurements as well"
    };
    Err(not_determined(
        robot,
        &measurements::obstacle(&check, unmeasured),
        more,
    ))
}

fn not_determined(robot: &RobotFile, cause: &str, more: &str) -> Failure {
    // It stands behind "refused: ", and is a sentence in the report.
    let mut letters = cause.chars();
    let first = letters.next().map(|letter| letter.to_ascii_lowercase());
    let cause = first.into_iter().chain(letters).collect();
    let remedy = if robot.tolerance.is_some() {
        format!("{more}; without them the [tolerance] decides what the samples leave open")
    } else {
        format!("{more}, or state a [tolerance]")
    };
    Failure::NotDetermined { cause, remedy }
}
