//! `delta-cal export`.

use super::failure::Failure;
use super::output::{deliver, or_stream};
use super::paths::{ColumnsArgument, read, robot_path};
use crate::export::error::ExportError;
use crate::export::geometry::Frame;
use crate::export::positions::{Wanted, bed};
use crate::export::{Case, Settings, names, target};
use crate::files::{kinematics, length::length};
use crate::text::joint;
use crate::{InputError, InputText, Options, RobotFile, read_samples};
use clap::Args;
use clap::builder::PossibleValuesParser;
use delta_cal::robot::Drive;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = include_str!("help/export.txt"))]
pub(crate) struct ExportArguments {
    /// The calibrated robot
    #[arg(value_name = "CALIBRATED.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// The target, one of those listed below
    #[arg(long = "for", value_name = "TARGET", value_parser = PossibleValuesParser::new(names()), hide_possible_values = true)]
    target: String,
    /// For a correction table: the robot that the controller computes with [default: the nearest symmetric robot]
    #[arg(long, value_name = "ROBOT.toml", value_parser = robot_path())]
    nominal: Option<PathBuf>,
    /// Positions to fit at, x_mm,y_mm,z_mm in the robot's frame [default: all over the workspace]
    #[arg(long, value_name = "FILE.csv")]
    positions: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The joints at the end stops, degrees or mm of travel: one for all arms, or three [default: the
    /// smallest angle or the largest travel that all can have]
    #[arg(
        long,
        value_name = "Q[,Q,Q]",
        value_delimiter = ',',
        value_parser = angle,
        allow_negative_numbers = true,
        allow_hyphen_values = true
    )]
    home: Option<Vec<f64>>,
    /// With towers: the samples file with the heights of the bed, which becomes z = 0
    #[arg(long, value_name = "SAMPLES.csv")]
    bed: Option<PathBuf>,
    /// Height of the robot's origin above the controller's z = 0 [default: the smallest whole number
    /// of mm with no position below 0]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    height: Option<f64>,
    /// The platform's radius [default: that of the robot file, or 25 mm]
    #[arg(long, alias = "platform-radius", value_name = "LENGTH", value_parser = length)]
    radius: Option<f64>,
    /// The unit of a LinuxCNC machine
    #[arg(long, value_parser = ["mm", "inch"], default_value = "mm")]
    unit: String,
    /// Largest error between the nodes of a correction table [default: nodes 25 mm apart]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    limit: Option<f64>,
    /// Write the lines to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write parameters, frame and loss as JSON; - is standard output
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
}

pub(crate) fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    let (output, json_path) = (arguments.output.as_deref(), arguments.json.as_deref());
    let inches = arguments.unit == "inch";
    for (given, option, target) in [
        (arguments.limit.is_some(), "--limit", "correction-table"),
        (inches, "--unit inch", "linuxcnc"),
    ] {
        if given && arguments.target != target {
            return Err(Failure::usage(
                format!("{option} cannot be used with --for {}", arguments.target),
                format!("use it with --for {target}"),
            ));
        }
    }
    let robot_file = |path: &Path| RobotFile::read(&InputText::from_file(path)?);
    let input = InputText::from_file(&arguments.robot)?;
    let robot = RobotFile::read(&input)?;
    let nominal = arguments.nominal.as_deref().map(robot_file).transpose()?;
    let drive = robot.robot.drive();
    if let Some(nominal) = nominal.as_ref().filter(|own| own.robot.drive() != drive) {
        let cause = format!("one of this robot and that of {} has towers", robot.name);
        let error = InputError::new(&nominal.name, cause);
        let remedy = "give with --nominal the same robot as it was before its calibration";
        return Err(error.with_remedy(remedy).into());
    }
    let settings = Settings {
        height: arguments.height,
        home: home(arguments, drive)?,
        platform_radius: arguments.radius,
        inches,
        limit: arguments.limit,
        level: level(arguments, &robot)?,
        ..Settings::default()
    };
    let wanted = match &arguments.positions {
        Some(path) => {
            let poses = kinematics::inverse(
                &robot,
                &robot.platform_point(),
                &read(path, &arguments.columns)?,
            )?;
            let positions = poses.into_iter().map(|pose| pose.position);
            Wanted::of(path.display().to_string(), positions.collect())
        }
        None => Wanted::in_workspace(&robot),
    };
    let case = Case {
        robot: &robot,
        nominal: nominal.as_ref(),
        wanted: &wanted,
        settings,
    };
    let found = target(&arguments.target, drive);
    let export = found.and_then(|target| case.export(target));
    let export = export.map_err(|error| failure(&input, arguments.positions.as_deref(), &error))?;
    let output = or_stream(output, json_path);
    deliver(
        &[(output, &export.to_text()), (json_path, &export.to_json())],
        export.summary() + "\n",
    )
}

fn angle(text: &str) -> Result<f64, &'static str> {
    text.parse()
        .map_err(|_| "a number without its unit is needed: degrees, or mm of travel")
}

/// The joints at the end stops: radians, or mm of travel.
fn home(arguments: &ExportArguments, drive: Drive) -> Result<Option<[f64; 3]>, Failure> {
    let home = match arguments.home.as_deref() {
        None => return Ok(None),
        Some([all]) => [*all; 3],
        Some([first, second, third]) => [*first, *second, *third],
        Some(_) => [f64::NAN; 3],
    };
    if home.iter().all(|joint| joint.is_finite()) {
        return Ok(Some(home.map(|own| joint::inwards(drive, own))));
    }
    let (what, example) = match drive {
        Drive::Rotary => ("joint angle in degrees", "-52.5,-52.1,-52.8"),
        Drive::Linear => ("travel in mm", "720.9,720.6,721.2"),
    };
    Err(Failure::usage(
        format!("--home takes one {what}, or three"),
        format!("write for example --home {example}"),
    ))
}

/// The bed above which heights were measured.
fn level(arguments: &ExportArguments, robot: &RobotFile) -> Result<Option<Frame>, Failure> {
    let Some(path) = &arguments.bed else {
        return Ok(None);
    };
    if robot.robot.drive() == Drive::Rotary {
        return Err(Failure::usage(
            "--bed can only be used with towers",
            "leave it out; the fitted rigid motion levels the work frame",
        ));
    }
    let input = InputText::from_table(path)?;
    let samples = read_samples(&input, robot, &Options::default()).map_err(Failure::from)?;
    Ok(Some(bed(&robot.robot, &samples)?))
}

/// The error, with the file at fault and the place in it.
fn failure(text: &InputText, positions: Option<&Path>, error: &ExportError) -> Failure {
    let of_positions = matches!(
        error,
        ExportError::TooFewPositions(_) | ExportError::Unreached
    );
    let name = match positions {
        Some(path) if of_positions => path.display().to_string(),
        _ => text.name().to_owned(),
    };
    let mut fault = InputError::new(name, error.to_string()).with_remedy(error.remedy());
    if let ExportError::CannotHold { arm, key, .. } = error {
        let lines = text.text().lines().zip(1..);
        let mut own = lines.filter(|(line, _)| line.trim_start().starts_with(key));
        if let Some((_, line)) = own.nth(arm.index()) {
            fault = fault.at_line(line);
        }
        fault = fault.at_key(*key);
    }
    fault.into()
}
