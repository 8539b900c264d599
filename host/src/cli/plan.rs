//! `delta-cal plan`.

mod arguments;
mod deliver;
mod instruments;
mod measure;

pub(crate) use arguments::PlanArguments;
pub(super) use deliver::failure;

use super::failure::Failure;
use super::length::Length;
use super::outputs;
use super::paths::is_stream;
use super::progress::Waiting;
use crate::files::kinematics;
use crate::files::samples_file::is_unmeasured_plan;
use crate::planning::measurements::{Kind, Wishes};
use crate::planning::poses::{
    Criterion, LEAST_POSES, MOST_POSES, PlanRequest, PosePlan, PosesNeeded, plan, poses_needed,
};
use crate::render::json;
use crate::report::plan;
use crate::{CalibrationMethod, InputText, RobotFile};
use arguments::CriterionArgument;
use deliver::deliver;
use std::path::Path;

pub(crate) const HELP: &str = "\
POSES.csv has the columns of a samples file. Drive to the joint angles of each row, measure, and fill \
in x_mm,y_mm,z_mm. The columns _nominal_x_mm,_nominal_y_mm,_nominal_z_mm say where the nominal robot \
is then; columns that begin with _ are ignored. Once the file holds measurements, the program replaces \
it only with --force.

The program plans for the [noise] and [tolerance] of ROBOT.toml. Without a [noise] it assumes 0.02 mm \
and 0.002 degrees; without a [tolerance] it assumes that nothing is known of the parameters \
beforehand.

With --measure the file has empty columns for heights, distances or single coordinates, and the plan \
minimises the error of relative positions. Further columns that begin with _ say what the nominal \
robot would read, and on which gauge block.

--within takes a box x=-100..100,y=-100..100,z=-500..-400 or a cylinder about the z axis \
r=200,z=-500..-400, in mm in the robot's frame; z is negative below the base.

Examples:
  delta-cal plan robot.toml --count 12 --output poses.csv
  delta-cal plan robot.toml --accuracy 0.05mm --output poses.csv
  delta-cal plan robot.toml --count 20 --within r=150,z=-500..-350
  delta-cal plan robot.toml --count 12 --output - | delta-cal check robot.toml -
  delta-cal plan robot.toml --compare
  delta-cal plan robot.toml --measure plane --count 40 --output touches.csv
  delta-cal plan robot.toml --measure point --length 300 --count 40

Exit codes:
  0  done
  1  no poses within these limits determine the robot
  2  the command line is wrong: fewer than 8 poses, a region outside the
     workspace, measurements in POSES.csv
  3  the robot file is wrong, or its limits exclude everything
  4  a file could not be written

With exit codes 1, 2 and 3 no output file is written or changed.";

pub(crate) fn run(arguments: &PlanArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    let robot = RobotFile::read(&InputText::from_file(&arguments.robot)?)?;
    if let (Some(path), false) = (&arguments.output, arguments.force) {
        keep_measurements(path, &robot)?;
    }
    if arguments.instruments.compare {
        return measure::compare_instruments(arguments, &robot);
    }
    if let Some(kinds) = &arguments.instruments.measure {
        return measure::measure(arguments, &robot, kinds.clone());
    }
    // Positions are observations where transmissions are to be found.
    if robot.transmission.is_some() {
        let other_method = arguments.method.method() != CalibrationMethod::Joint;
        if arguments.accuracy.is_some() || other_method {
            return Err(Failure::Usage {
                cause: "--accuracy and --method cannot be used where transmissions are to be found"
                    .to_owned(),
                remedy: "give --count, or delete transmission_deg in the robot file".to_owned(),
            });
        }
        return measure::measure(arguments, &robot, Wishes::only(Kind::Xyz));
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
        Some(Length(accuracy)) => Some(needed(&request, accuracy)?),
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
    let replaceable = |text: InputText| {
        text.text().trim().is_empty() || is_unmeasured_plan(&text, robot).unwrap_or(false)
    };
    if InputText::from_file(path).is_ok_and(replaceable) {
        return Ok(());
    }
    Err(Failure::Usage {
        cause: format!(
            "--output {} exists and is not a plan in which nothing was measured yet",
            path.display()
        ),
        remedy: "give the output another name, or --force to replace the file".to_owned(),
    })
}

fn write(
    arguments: &PlanArguments,
    request: &PlanRequest<'_>,
    planned: &PosePlan,
    needed: Option<&PosesNeeded>,
) -> Result<(), Failure> {
    let csv = kinematics::to_fill_in(request.robot.robot.drive(), &planned.poses);
    let json = json::text(&plan::json::report(request, planned, needed));
    let report = plan::table::render(request, planned, needed);
    deliver(arguments, &csv, &json, &report)
}

fn check_paths(arguments: &PlanArguments) -> Result<(), Failure> {
    let robot = ("the robot file", Some(arguments.robot.as_path()));
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    outputs::check(&[robot], &[("--output", output), ("--json", json)])
}
