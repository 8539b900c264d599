use crate::cli::paths::{ColumnsArgument, robot_path};
use crate::cli::streaming::StreamingArguments;
use crate::device::Port;
use crate::{CalibrationMethod, Options};
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

const DEVICE_EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  the measurements cannot calibrate this robot (refused), or verify found a
       difference
    2  the command line is wrong
    3  an input file is wrong, or another robot's
    4  a file could not be written
    5  the controller, the link to it or its emulation failed
  130  ended by Ctrl-C

After a refusal, and with exit codes 2, 3, 5 and 130, no output file is written or changed. The controller \
keeps its parameters until --apply or revert asks it for others. If the link breaks after that, or Ctrl-C \
ends the command, the controller may use the others; the error says so, and status shows which are in use. \
The same command may be given again: it changes nothing that is done already.";

const DEVICE_HELP: &str = "\
--port says where the controller is:
  /dev/ttyACM0     a serial port (COM3 on Windows)
  tcp:HOST:PORT    a serial server
  emulate:m4       no board: QEMU emulates a Cortex-M4F with the firmware of
                   firmware-example. Without --flash FILE it forgets at the end
                   what it has stored
  emulate:m7       the same with a Cortex-M7

Examples:
  delta-cal device --port emulate:m4 calibrate --apply
      the built-in example on an emulated controller
  delta-cal device --port /dev/ttyACM0 status
  delta-cal device --port /dev/ttyACM0 parameters --nominal --output robot.toml
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv --apply
  delta-cal device --port /dev/ttyACM0 revert";

const CALIBRATE_HELP: &str = "\
This command sends the samples; the controller solves by itself while its control loop runs on; and \
the command shows the result. Tolerance and noise come from ROBOT.toml, whose geometry must be the \
nominal one of the controller (parameters --nominal --output ROBOT.toml). The files are those of \
delta-cal calibrate (see delta-cal calibrate --help). In the report \"before\" means the parameters \
that the controller uses now.

Examples:
  delta-cal device --port emulate:m7 calibrate --apply
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv \\
      --json report.json
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv --gate
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv \\
      --apply --output now.toml";

const APPLY_HELP: &str = "\
CALIBRATED.toml is what delta-cal calibrate wrote with --output: for a calibration that the controller \
cannot do by itself, as one that finds transmissions. The controller stores it as one of its own, and \
revert goes back.

Examples:
  delta-cal device --port /dev/ttyACM0 apply calibrated.toml
  delta-cal device --port emulate:m4 apply calibrated.toml";

const PARAMETERS_HELP: &str = "\
The controller knows only its geometry. [joints], [tolerance] and [noise] come from ROBOT.toml. \
Without ROBOT.toml, correct [joints] in the file that this command writes.

Examples:
  delta-cal device --port /dev/ttyACM0 parameters
  delta-cal device --port /dev/ttyACM0 parameters --nominal --output robot.toml
  delta-cal device --port /dev/ttyACM0 parameters robot.toml --output now.toml";

const REVERT_HELP: &str = "\
Given again, revert changes nothing: a calibration that was rejected does not come back. To use it \
after all, apply it again with calibrate --apply.

Examples:
  delta-cal device --port /dev/ttyACM0 revert
  delta-cal device --port /dev/ttyACM0 revert --nominal";

const VERIFY_HELP: &str = "\
Controller and computer solve the same samples, and the command compares every bit of the \
parameters, their covariance, the residual, the condition and so on. The controller applies nothing.

Examples:
  delta-cal device --port emulate:m4 verify
  delta-cal device --port /dev/ttyACM0 verify robot.toml samples.csv";

#[derive(Debug, Args)]
#[command(after_help = format!("{DEVICE_HELP}\n\n{DEVICE_EXIT_CODES}"))]
pub(crate) struct DeviceArguments {
    #[command(flatten)]
    pub(super) link: LinkArguments,
    #[command(subcommand)]
    pub(super) command: DeviceCommand,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "The controller")]
pub(crate) struct LinkArguments {
    /// Where the controller is: /dev/ttyACM0, tcp:HOST:PORT, emulate:m4 or emulate:m7
    #[arg(long, global = true, value_name = "PORT")]
    pub(super) port: Option<Port>,
    /// Bits per second on a serial port [default: 115200]
    #[arg(long, global = true, value_name = "RATE")]
    pub(super) baud: Option<u32>,
    /// emulate: only: this firmware, and not the one built from firmware-example. It runs with
    /// semihosting, so that it can read and write your files: use only firmware that you trust
    #[arg(long, global = true, value_name = "ELF")]
    pub(super) firmware: Option<PathBuf>,
    /// emulate: only: let the firmware compute in f64, to compare (emulated at eight times the pace)
    #[arg(long, global = true)]
    pub(super) double: bool,
    /// emulate: only: keep the controller's flash in this file from run to run
    #[arg(long, global = true, value_name = "FILE")]
    pub(super) flash: Option<PathBuf>,
    /// emulate: only: print the firmware's log to standard error (needs defmt-print)
    #[arg(long, global = true)]
    pub(super) log: bool,
}

#[derive(Debug, Subcommand)]
pub(super) enum DeviceCommand {
    /// Send measurements, let the controller calibrate its robot, and show the result
    #[command(after_help = format!("{CALIBRATE_HELP}\n\n{DEVICE_EXIT_CODES}"))]
    Calibrate(CalibrateArguments),
    /// Let the controller use the robot of a file that was calibrated on this computer
    #[command(after_help = format!("{APPLY_HELP}\n\n{DEVICE_EXIT_CODES}"))]
    Apply(ApplyArguments),
    /// Show what the controller is doing, and the state of its control loop and its link
    Status(StatusArguments),
    /// Write the geometry that the controller uses as a robot file
    #[command(after_help = format!("{PARAMETERS_HELP}\n\n{DEVICE_EXIT_CODES}"))]
    Parameters(ParametersArguments),
    /// Go back to the parameters before the last --apply, or to the nominal ones
    #[command(after_help = format!("{REVERT_HELP}\n\n{DEVICE_EXIT_CODES}"))]
    Revert(RevertArguments),
    /// Solve the same samples on the controller and here, and compare the bits
    #[command(after_help = format!("{VERIFY_HELP}\n\n{DEVICE_EXIT_CODES}"))]
    Verify(VerifyArguments),
}

#[derive(Debug, Args)]
pub(super) struct Files {
    /// The nominal robot of the controller. Without files the command uses the built-in example
    #[arg(value_name = "ROBOT.toml", requires = "samples", value_parser = robot_path())]
    pub(super) robot: Option<PathBuf>,
    /// Joint angles and measured positions; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    pub(super) samples: Option<PathBuf>,
    #[command(flatten)]
    pub(super) columns: ColumnsArgument,
    /// How the controller estimates the parameters: joint fits all 24 together, ikm fits each arm by
    /// itself with a third of the work
    #[arg(long, value_enum, default_value_t = EstimatorArgument::Joint)]
    pub(super) method: EstimatorArgument,
    #[command(flatten)]
    pub(super) streaming: StreamingArguments,
    /// Do not use the robot file as a start value (needs 12 samples), and accept any geometry
    #[arg(long)]
    pub(super) no_guess: bool,
}

/// The methods of a controller. Without a help text each, which would spread out all options.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum EstimatorArgument {
    Joint,
    Ikm,
}

impl Files {
    pub(super) fn options(&self) -> Options {
        Options {
            method: match self.method {
                EstimatorArgument::Joint => CalibrationMethod::Joint,
                EstimatorArgument::Ikm => CalibrationMethod::Ikm,
            },
            streaming: self.streaming.streaming(),
            no_guess: self.no_guess,
            ..Options::default()
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct CalibrateArguments {
    #[command(flatten)]
    pub(super) files: Files,
    /// Store the result in the controller and let its control loop use it
    #[arg(long)]
    pub(super) apply: bool,
    /// Write the calibrated robot to this file, replacing a file that exists, or with - to standard
    /// output in place of the table
    #[arg(long, value_name = "CALIBRATED.toml")]
    pub(super) output: Option<PathBuf>,
    /// Write the report as JSON to this file, or with - to standard output in place of the table
    #[arg(long, value_name = "REPORT.json")]
    pub(super) json: Option<PathBuf>,
    /// Write the report with figures to this HTML file, which opens in any browser, or with - to
    /// standard output
    #[arg(long, value_name = "REPORT.html")]
    pub(super) report: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct ApplyArguments {
    /// The robot after calibration
    #[arg(value_name = "CALIBRATED.toml", value_parser = robot_path())]
    pub(super) robot: PathBuf,
    /// Write the parameters that are then in use as JSON to this file, or with - to standard output
    #[arg(long, value_name = "REPORT.json")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct StatusArguments {
    /// Write the report as JSON to this file, or with - to standard output in place of the text
    #[arg(long, value_name = "REPORT.json")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct ParametersArguments {
    /// The robot file from which to take [joints], [tolerance] and [noise]
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    pub(super) robot: Option<PathBuf>,
    /// Write the nominal geometry of the controller instead of the geometry that it uses
    #[arg(long)]
    pub(super) nominal: bool,
    /// Write to this file instead of standard output, replacing a file that exists
    #[arg(long, value_name = "ROBOT.toml")]
    pub(super) output: Option<PathBuf>,
    /// Write the parameters as JSON to this file, or with - to standard output in place of TOML
    #[arg(long, value_name = "REPORT.json")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct RevertArguments {
    /// Go back to the nominal geometry of the controller, whatever was applied since
    #[arg(long)]
    pub(super) nominal: bool,
    /// Write the parameters that are then in use as JSON to this file, or with - to standard output
    #[arg(long, value_name = "REPORT.json")]
    pub(super) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct VerifyArguments {
    #[command(flatten)]
    pub(super) files: Files,
    /// Write the report as JSON to this file, or with - to standard output in place of the text
    #[arg(long, value_name = "REPORT.json")]
    pub(super) json: Option<PathBuf>,
}
