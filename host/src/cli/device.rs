//! `delta-cal device`: its arguments and help.

mod run;

pub(crate) use run::run;

use super::paths::{ColumnsArgument, robot_path};
use crate::Method;
use crate::device::Port;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use std::path::PathBuf;

const DEVICE_HELP: &str = "\
Examples:
  delta-cal device --port /dev/ttyACM0 status
  delta-cal device --port /dev/ttyACM0 parameters --nominal --output robot.toml
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv
  delta-cal device --port tcp:192.168.0.7:4000 apply calibrated.toml
  delta-cal device --port /dev/ttyACM0 revert

The controller keeps its parameters until --apply, apply or revert asks it for others. If the link \
breaks or the command is interrupted after that, status shows which are in use. Repeating a command does no harm.";

const CALIBRATE_HELP: &str = "\
The controller takes the samples and solves while its control loop runs. This computer judges the \
same samples and shows the report of delta-cal calibrate; what it refuses is not sent. ROBOT.toml \
must be the controller's nominal robot, with [tolerance] and [noise]. A controller calibrates from \
complete positions; for all other measurements use delta-cal calibrate, and send the result with \
delta-cal device apply.

Examples:
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv --apply
  delta-cal device --port tcp:127.0.0.1:5555 calibrate
      the built-in example, for the firmware of firmware-example";

const APPLY_HELP: &str = "\
CALIBRATED.toml is what delta-cal calibrate wrote with --output. The controller stores it like a \
calibration of its own.

Examples:
  delta-cal calibrate robot.toml touches.csv --output calibrated.toml
  delta-cal device --port /dev/ttyACM0 apply calibrated.toml";

const PARAMETERS_HELP: &str = "\
The controller knows only its geometry. [joints], [tolerance] and [noise] come from ROBOT.toml; \
without it, correct [joints] in the output.

Examples:
  delta-cal device --port /dev/ttyACM0 parameters --nominal --output robot.toml
  delta-cal device --port /dev/ttyACM0 parameters robot.toml --output now.toml";

#[derive(Debug, Args)]
#[command(after_help = DEVICE_HELP)]
pub(crate) struct DeviceArguments {
    /// Address of the controller: a serial port (/dev/ttyACM0, COM3) or tcp:HOST:PORT
    #[arg(
        long,
        global = true,
        value_name = "PORT",
        help_heading = "The controller"
    )]
    port: Option<Port>,
    /// Bits per second on a serial port [default: 115200]
    #[arg(
        long,
        global = true,
        value_name = "RATE",
        help_heading = "The controller"
    )]
    baud: Option<u32>,
    #[command(subcommand)]
    command: DeviceCommand,
    /// Write the report as JSON to this file, or with - to standard output
    #[arg(long, global = true, value_name = "REPORT.json")]
    json: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum DeviceCommand {
    /// Send samples, let the controller calibrate its robot, and show the result
    #[command(after_help = CALIBRATE_HELP)]
    Calibrate(CalibrateArguments),
    /// Let the controller use a robot that was calibrated on this computer
    #[command(after_help = APPLY_HELP)]
    Apply {
        /// The robot after calibration
        #[arg(value_name = "CALIBRATED.toml", value_parser = robot_path())]
        robot: PathBuf,
    },
    /// Show what the controller is doing, and the state of its control loop and link
    Status,
    /// Write the geometry that the controller uses as a robot file
    #[command(after_help = PARAMETERS_HELP)]
    Parameters(ParametersArguments),
    /// Go back to the parameters before the last change, or to the nominal ones
    Revert {
        /// Go back to the nominal geometry
        #[arg(long)]
        nominal: bool,
    },
}

#[derive(Debug, Args)]
struct CalibrateArguments {
    /// The controller's nominal robot. Without files: the built-in example
    #[arg(value_name = "ROBOT.toml", requires = "samples", value_parser = robot_path())]
    robot: Option<PathBuf>,
    /// Joint angles and measured positions; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    samples: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnsArgument,
    /// joint fits all 24 parameters together; ikm fits each arm by itself with a third of the work
    #[arg(long, value_parser = method(), default_value = "joint")]
    method: Method,
    /// Store the result in the controller and let its control loop use it
    #[arg(long)]
    apply: bool,
}

/// The estimators that a controller offers.
fn method() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(["joint", "ikm"]).map(|name| match name.as_str() {
        "ikm" => Method::Ikm,
        _ => Method::Joint,
    })
}

#[derive(Debug, Args)]
struct ParametersArguments {
    /// The robot file from which to take [joints], [tolerance] and [noise]
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    robot: Option<PathBuf>,
    /// Write the nominal geometry instead of the one in use
    #[arg(long)]
    nominal: bool,
    /// Write to this file instead of standard output
    #[arg(long, value_name = "ROBOT.toml")]
    output: Option<PathBuf>,
}
