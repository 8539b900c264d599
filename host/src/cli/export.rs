//! `delta-cal export`.

use super::failure::Failure;
use super::outputs::{self, deliver};
use super::paths::{ColumnsArgument, is_stream, read, robot_path, same_kind};
use crate::export::case::Case;
use crate::export::choose::{CHOICES, Choice};
use crate::export::corrections::choice::Nodes;
use crate::export::corrections::kind::Kind;
use crate::export::error::ExportError;
use crate::export::frame::Frame;
use crate::export::linear::level::of_heights;
use crate::export::settings::Settings;
use crate::export::wanted::Wanted;
use crate::files::kinematics;
use crate::render::json;
use crate::report::export::{self, Files};
use crate::{InputError, InputText, Options, RobotFile, read_samples};
use clap::Args;
use clap::builder::PossibleValuesParser;
use delta_cal::robot::Drive;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = "\
TARGET is one of:
  klipper           [printer] kinematics: rotary_delta, 14 parameters;
                    with towers kinematics: delta, 10 parameters
  reprapfirmware    M669 K10 and M666, 16 parameters;
                    with towers M665 and M666, 10 parameters
  marlin            robots with towers: M665 and M666, 10 parameters
  b-and-r           B&R mapp Motion, Delta/3AxesDeltaA, 18 parameters
  linuxcnc          rotarydeltakins with home offsets, 6 parameters
  linuxcnc-component
                    deltacalkins, a kinematics component with all 24 parameters
                    (docs/linuxcnc.md)
  smoothieware      rotary_delta with M206, 7 parameters
  fluidnc, grblhal, ucnc, delta-x, codesys
                    four lengths, of which 3 count
  sdf               a model for simulators, with all 24 parameters
  correction-table  CSV x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,node: corrections on a
                    grid for any controller, of positions or of joint angles

Robots whose elbows are carriages on towers (kind = \"linear\") can be exported for klipper, reprapfirmware, marlin and \
correction-table. Name with --bed the file of their heights above the bed: the exported z = 0 is then the bed.

No controller's own kinematics holds all parameters. The program fits the target's parameters, and a rigid motion, so that \
the calibrated robot is where it is wanted at the joint angles that the controller computes, and states \
what is lost. It writes the controller's lines, with that as their comment. docs/export.md has the conventions of \
each controller.

Examples:
  delta-cal export calibrated.toml --for klipper
  delta-cal export calibrated.toml --for klipper --output delta.cfg
  delta-cal export calibrated.toml --for reprapfirmware --home-deg -52.5
  delta-cal export calibrated.toml --for linuxcnc-component --output robot.hal
  delta-cal export calibrated.toml --for sdf --output robot.sdf
  delta-cal export calibrated.toml --for marlin --bed samples.csv \\
      --home-mm 720.9,720.6,721.2
  delta-cal export calibrated.toml --for correction-table --nominal robot.toml
  delta-cal export calibrated.toml --for correction-table --nominal robot.toml \\
      --corrections joint --limit 0.1 --positions work.csv

Exit codes:
  0  done
  2  the command line is wrong
  3  an input file is wrong, the target cannot hold this robot, or no correction
     table keeps to --limit
  4  a file could not be written

With exit codes 2 and 3 no output file is written or changed.";

#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ExportArguments {
    /// The calibrated robot
    #[arg(value_name = "CALIBRATED.toml", value_parser = robot_path())]
    robot: PathBuf,
    /// What to export for; the targets are listed below
    #[arg(long = "for", value_name = "TARGET", value_parser = PossibleValuesParser::new(CHOICES.map(|(name, _)| name)), hide_possible_values = true)]
    target: String,
    /// The robot before its calibration, to state what not calibrating would mean, and as the kinematics that a
    /// correction table corrects [default: the symmetric robot nearest to the calibrated one]
    #[arg(long, value_name = "ROBOT.toml", value_parser = robot_path())]
    nominal: Option<PathBuf>,
    /// Fit and state the loss at these positions, x_mm,y_mm,z_mm in the calibrated robot's frame [default:
    /// positions spread over the workspace]
    #[arg(long, value_name = "FILE.csv")]
    positions: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// The joint angles at which the arms are at their end stops, as in the robot file: one for all arms, or
    /// three [default: the smallest whole degrees at which all three can be, elbows out]
    #[arg(long, value_name = "Q[,Q,Q]", value_delimiter = ',', value_parser = number, allow_negative_numbers = true, allow_hyphen_values = true)]
    home_deg: Option<Vec<f64>>,
    /// With towers: the travels at which the carriages are at their end stops, one for all or three; delta-cal
    /// import states them [default: the largest travel of the robot file]
    #[arg(long, value_name = "S[,S,S]", value_delimiter = ',', value_parser = number, allow_negative_numbers = true, allow_hyphen_values = true)]
    home_mm: Option<Vec<f64>>,
    /// With towers: the samples file whose heights were measured above the bed, which becomes z = 0 and level
    #[arg(long, value_name = "SAMPLES.csv")]
    bed: Option<PathBuf>,
    /// The height of the robot's origin above the controller's z = 0, where the controller holds a height
    /// [default: the least whole number with which no position is below 0]
    #[arg(long, value_name = "MM", value_parser = length)]
    height: Option<f64>,
    /// The platform's radius, for controllers that hold it beside the base's; only the difference counts
    #[arg(long, value_name = "MM", default_value_t = 25.0, value_parser = length)]
    platform_radius: f64,
    /// Of a correction table: what to correct, the commanded position or the joint angles [default: position]
    #[arg(long, value_name = "WHAT", value_parser = PossibleValuesParser::new(["position", "joint"]))]
    corrections: Option<String>,
    /// Of a correction table: the distance between its nodes [default: 25]
    #[arg(long, value_name = "MM", value_parser = length)]
    spacing: Option<f64>,
    /// Of a correction table: choose the distance between its nodes so that interpolation leaves at most this error
    #[arg(long, value_name = "MM", value_parser = length, conflicts_with = "spacing")]
    limit: Option<f64>,
    /// Write the lines to this file instead of standard output, replacing a file that exists
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write parameters, frame and loss as JSON to this file, or with - to standard output in place of
    /// the lines
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("it is not a finite number".to_owned()),
    }
}

/// A length above 0, mm.
fn length(text: &str) -> Result<f64, String> {
    match number(text)? {
        value if value > 0.0 => Ok(value),
        _ => Err("it must be above 0, in mm".to_owned()),
    }
}

pub(crate) fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    check_paths(arguments)?;
    let choice = CHOICES
        .into_iter()
        .find(|(name, _)| *name == arguments.target)
        .map_or(Choice::Sdf, |(_, choice)| choice);
    check_table(arguments, choice)?;
    let text = InputText::from_file(&arguments.robot)?;
    let robot = RobotFile::read(&text)?;
    let nominal = match &arguments.nominal {
        Some(path) => Some(RobotFile::read(&InputText::from_file(path)?)?),
        None => None,
    };
    if let Some(nominal) = &nominal {
        same_kind("--nominal", &robot, nominal)?;
    }
    let home = home(arguments, robot.robot.drive())?;
    let (corrections, nodes) = corrections(arguments);
    let level = level(arguments, &robot)?;
    let wanted = match &arguments.positions {
        Some(path) => {
            let poses = kinematics::inverse(&robot, &read(path, &arguments.columns)?)?;
            Wanted::of(poses.into_iter().map(|pose| pose.position).collect())
        }
        None => Wanted::in_workspace(&robot),
    };
    let case = Case {
        robot: &robot,
        nominal: nominal.as_ref(),
        wanted: &wanted,
        settings: Settings {
            height: arguments.height,
            home,
            platform_radius: arguments.platform_radius,
            corrections,
            nodes,
            level,
        },
    };
    let export = case
        .export(choice)
        .map_err(|error| failure(&text, arguments.positions.as_deref(), &error))?;
    let positions = arguments.positions.as_ref();
    let positions = positions.map(|path| path.display().to_string());
    let files = Files {
        robot: &robot.name,
        nominal: nominal.as_ref().map(|robot| robot.name.as_str()),
        positions: positions.as_deref(),
    };
    let lines = export::text(&export, &files);
    let json = json::text(&export::json(&export, &files));
    let (output, json_path) = (arguments.output.as_deref(), arguments.json.as_deref());
    let output = match output {
        // The lines are the report.
        None if !json_path.is_some_and(is_stream) => Some(Path::new("-")),
        output => output,
    };
    deliver(
        &[(output, &lines), (json_path, &json)],
        export::summary(&export, &files).join("\n") + "\n\n",
    )
}

fn check_paths(arguments: &ExportArguments) -> Result<(), Failure> {
    let (output, json) = (arguments.output.as_deref(), arguments.json.as_deref());
    let inputs = [
        ("the robot file", Some(arguments.robot.as_path())),
        ("the nominal robot", arguments.nominal.as_deref()),
        ("the positions", arguments.positions.as_deref()),
        ("the heights", arguments.bed.as_deref()),
    ];
    outputs::check(&inputs, &[("--output", output), ("--json", json)])
}

/// The end stops: radians, or mm of travel.
fn home(arguments: &ExportArguments, drive: Drive) -> Result<Option<[f64; 3]>, Failure> {
    let (own, other, of_whom) = match drive {
        Drive::Rotary => (
            (
                "--home-deg",
                &arguments.home_deg,
                "-52.5",
                "-52.5,-52.1,-52.8",
            ),
            ("--home-mm", &arguments.home_mm),
            "motors turn the arms of this robot, and it has no travels",
        ),
        Drive::Linear => (
            ("--home-mm", &arguments.home_mm, "721", "720.9,720.6,721.2"),
            ("--home-deg", &arguments.home_deg),
            "carriages drive this robot, and it has no joint angles",
        ),
    };
    let (option, values, one, three) = own;
    if other.1.is_some() {
        return Err(Failure::Usage {
            cause: format!("{} cannot be used: {of_whom}", other.0),
            remedy: format!("write for example {option} {three}"),
        });
    }
    let unit = |value: f64| match drive {
        Drive::Rotary => value.to_radians(),
        Drive::Linear => value,
    };
    Ok(match values.as_deref() {
        None => None,
        Some([all]) => Some([unit(*all); 3]),
        Some([first, second, third]) => Some([*first, *second, *third].map(unit)),
        Some(_) => {
            let what = match drive {
                Drive::Rotary => "angle",
                Drive::Linear => "travel",
            };
            return Err(Failure::Usage {
                cause: format!("{option} needs one {what}, or three"),
                remedy: format!("write for example {option} {one} or {option} {three}"),
            });
        }
    })
}

/// The options of a correction table are of no use to other targets.
fn check_table(arguments: &ExportArguments, choice: Choice) -> Result<(), Failure> {
    if matches!(choice, Choice::CorrectionTable) {
        return Ok(());
    }
    let stated = [
        ("--corrections", arguments.corrections.is_some()),
        ("--spacing", arguments.spacing.is_some()),
        ("--limit", arguments.limit.is_some()),
    ];
    match stated.into_iter().find(|(_, stated)| *stated) {
        None => Ok(()),
        Some((option, _)) => Err(Failure::Usage {
            cause: format!(
                "{option} cannot be used with --for {}, which has no correction table",
                arguments.target
            ),
            remedy: format!("leave out {option}, or write --for correction-table"),
        }),
    }
}

/// What a table corrects, and where its nodes are.
fn corrections(arguments: &ExportArguments) -> (Kind, Nodes) {
    let kind = match arguments.corrections.as_deref() {
        Some("joint") => Kind::Joint,
        _ => Kind::Position,
    };
    let nodes = match (arguments.limit, arguments.spacing) {
        (Some(limit), _) => Nodes::Limit(limit),
        (None, Some(spacing)) => Nodes::Spacing(spacing),
        (None, None) => Settings::default().nodes,
    };
    (kind, nodes)
}

/// The bed that heights were measured above.
fn level(arguments: &ExportArguments, robot: &RobotFile) -> Result<Option<Frame>, Failure> {
    let Some(path) = &arguments.bed else {
        return Ok(None);
    };
    if robot.robot.drive() == Drive::Rotary {
        return Err(Failure::Usage {
            cause: "--bed cannot be used: motors turn the arms of this robot".to_owned(),
            remedy: "leave it out; the fitted rigid motion levels the work frame".to_owned(),
        });
    }
    let samples = read_samples(&InputText::from_table(path)?, robot, &Options::default())
        .map_err(Failure::from)?;
    let found = of_heights(&robot.robot, &samples);
    if found.is_some() {
        return Ok(found);
    }
    let cause = "the file holds fewer than three heights that are not on one line, and these determine no bed";
    let fault = InputError::new(path.display().to_string(), cause);
    Err(fault
        .with_remedy("measure more heights, or leave out --bed")
        .into())
}

/// Which file is at fault, and where.
fn failure(text: &InputText, positions: Option<&Path>, error: &ExportError) -> Failure {
    let of_positions = matches!(
        error,
        ExportError::TooFewPositions { .. } | ExportError::Unreached
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
