use super::check::{self, CheckArguments};
use super::device::DeviceArguments;
use super::paths::robot_path;
use super::plan::{self, PlanArguments};
use super::reproduce::{self, ReproduceArguments};
use super::simulate::{self, SimulateArguments};
use super::workspace::WorkspaceArguments;
use clap::builder::TypedValueParser;
use clap::{Args, Parser, Subcommand, ValueEnum, value_parser};
use delta_cal_host::{CalibrationMethod, Frame, Options, Streaming};
use std::num::NonZeroU32;
use std::path::PathBuf;

const EXIT_CODES: &str = "\
Exit codes:
  0  done: the robot is calibrated, or every row is computed
  1  the measurements cannot calibrate this robot (refused)
  2  the command line is wrong
  3  an input file is wrong
  4  a file could not be written
  5  delta-cal device only: the controller or the link to it failed

With exit codes 1, 2 and 3 no output file is written or changed.";

const KINEMATICS_EXIT_CODES: &str = "\
Exit codes:
  0  done: every row is computed
  2  the command line is wrong
  3  an input file is wrong, or a row has no solution
  4  the output could not be written

With exit codes 2 and 3 no output file is written or changed.";

const EXAMPLES: &str = "\
Examples:
  delta-cal calibrate
      the built-in, simulated example
  delta-cal calibrate robot.toml samples.csv --output calibrated.toml
  delta-cal calibrate robot.toml tracker.csv --frame sensor --json report.json
  delta-cal forward calibrated.toml angles.csv
  delta-cal inverse calibrated.toml < positions.csv > angles.csv
  delta-cal plan robot.toml --count 12 --output poses.csv
  delta-cal check robot.toml samples.csv
  delta-cal simulate
  delta-cal reproduce
  delta-cal workspace robot.toml --output workspace
  delta-cal device --port /dev/ttyACM0 calibrate robot.toml samples.csv --apply";

const CALIBRATE_HELP: &str = "\
ROBOT.toml:
  [nominal]                # or three [[arm]] tables with dx_mm, dy_mm, dz_mm,
  base_radius_mm = 194     #   theta_deg, alpha_deg, la_x_mm, la_y_mm, lb_mm
  platform_radius_mm = 30
  upper_arm_mm = 260
  forearm_mm = 480
  [joints]
  min_deg = -60
  max_deg = 90
  [tolerance]              # optional: one sigma of each parameter about its
  length_mm = 0.5          #   nominal value. With it fewer than 8 samples are
  angle_deg = 0.2          #   enough
  [noise]                  # optional: one sigma of a measurement. It weights
  position_mm = 0.02       #   the samples and tells whether the residuals are
  joint_deg = 0.002        #   credible

SAMPLES.csv:
  q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,_point
  10.0,20.0,30.0,41.151,25.265,-338.742,P1

Columns may stand in any order and in other units (q1_rad..., x_m...). A # begins a comment. The \
program ignores columns whose name begins with _, such as _point or _time.

With --frame sensor the program chooses the robot's frame so that ROBOT.toml fits the measured \
points best. It then cannot detect a cyclic exchange of the joint columns (q2,q3,q1 for q1,q2,q3), \
because a Delta has threefold symmetry.

Without a [tolerance] the program refuses a result that differs from ROBOT.toml by more than 10 % of \
the forearm or by more than 10 degrees. With --no-guess it accepts any geometry.

With --loss huber or tukey the program leaves out wrong rows: a reflector slipped, a joint was still \
moving, a digit was mistyped. The fit starts from the rows that agree best, estimates the scale of \
the residuals from their median, and leaves out every row that is off by 4.7 scales or more; the \
report names these rows with their residual in sigma. At most 40 % of the rows may be wrong, and \
fewer of a short file: 4 of 16 rows, 6 of 20, 8 of 24, 11 of 30. A file that is wrong as a whole is \
refused as without this option.

--gate, --held-out and --forget need the rows in the order in which they were measured. With --gate \
the program compares each row with what the rows before it and the [tolerance] predict, and leaves \
it out if it is off by 4.7 sigma or more. Eight such rows in succession mean that the robot has \
changed, and the calibration is refused. With --held-out K the program fits the robot without every \
K-th row, and refuses the fit if those rows contradict it; if they agree, all rows make the result. \
With --forget N each row counts N/(N+1) times as much as the next one, so that the result follows a \
robot that warms up; it lags N rows behind. Firmware can do the same with the library's functions of \
these names.

Examples:
  delta-cal calibrate
      the built-in, simulated example
  delta-cal calibrate robot.toml samples.csv --output calibrated.toml
  delta-cal calibrate robot.toml tracker.csv --frame sensor --json report.json
  delta-cal calibrate robot.toml samples.csv --loss tukey
  delta-cal calibrate robot.toml samples.csv --gate --forget 50
  delta-cal calibrate robot.toml samples.csv --report report.html
  delta-cal calibrate robot.toml samples.csv --json - | jq .position_error_mm";

const FORWARD_HELP: &str = "\
The input has the columns q1_deg,q2_deg,q3_deg (or q1_rad...), the output \
q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm. The input may be a samples file; its positions are ignored.

If one row has no solution, nothing is written.

Examples:
  delta-cal forward robot.toml angles.csv
  printf 'q1_deg,q2_deg,q3_deg\\n10,20,30\\n' | delta-cal forward robot.toml";

const INVERSE_HELP: &str = "\
The input has the columns x_mm,y_mm,z_mm (or x_m...), the output \
q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm. The input may be a samples file; its angles are ignored.

If one row has no solution within the joint limits, nothing is written.

Examples:
  delta-cal inverse robot.toml positions.csv --output angles.csv
  printf 'x_mm,y_mm,z_mm\\n10,-20,-400\\n' | delta-cal inverse robot.toml";

/// Calibrates Delta robots from measured positions
#[derive(Debug, Parser)]
#[command(name = "delta-cal", version, max_term_width = 100)]
#[command(after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find the robot's 24 geometric parameters from measured positions
    #[command(after_help = format!("{CALIBRATE_HELP}\n\n{EXIT_CODES}"))]
    Calibrate(CalibrateArguments),
    /// Compute where the platform is at given joint angles
    #[command(after_help = format!("{FORWARD_HELP}\n\n{KINEMATICS_EXIT_CODES}"))]
    Forward(KinematicsArguments),
    /// Compute the joint angles at which the platform is at given positions
    #[command(after_help = format!("{INVERSE_HELP}\n\n{KINEMATICS_EXIT_CODES}"))]
    Inverse(KinematicsArguments),
    /// Choose the best poses to measure, and predict the accuracy they give
    #[command(after_help = plan::HELP)]
    Plan(PlanArguments),
    /// Check whether samples determine the robot, and propose poses to add
    #[command(after_help = check::HELP)]
    Check(CheckArguments),
    /// Calibrate many simulated robots, to predict how accurate a calibration will be
    #[command(after_help = simulate::help())]
    Simulate(SimulateArguments),
    /// Run every simulation of the paper, and compare its results with this program's
    #[command(after_help = reproduce::HELP)]
    Reproduce(ReproduceArguments),
    /// Compute the robot's workspace: boundary, volume, cylinders, singularities, effect of errors
    Workspace(WorkspaceArguments),
    /// Let a controller calibrate its robot, over the controller's serial link
    Device(DeviceArguments),
}

#[derive(Debug, Args)]
pub(crate) struct CalibrateArguments {
    /// The robot before calibration. Without files the program calibrates its built-in example
    #[arg(value_name = "ROBOT.toml", requires = "samples", value_parser = robot_path())]
    pub(crate) robot: Option<PathBuf>,
    /// Joint angles and measured positions; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    pub(crate) samples: Option<PathBuf>,
    /// How the parameters are estimated
    #[arg(long, value_enum, default_value_t = MethodArgument::Ikm)]
    pub(crate) method: MethodArgument,
    /// How the equations are solved
    #[arg(long, value_enum, default_value_t = SolverArgument::Lm)]
    pub(crate) solver: SolverArgument,
    /// How much a sample counts that disagrees with the others
    #[arg(long, value_enum, default_value_t = LossArgument::Squared)]
    pub(crate) loss: LossArgument,
    /// Compare each sample with those before it in the file, and leave it out if it disagrees
    #[arg(long)]
    pub(crate) gate: bool,
    /// Fit the robot without every K-th sample, and refuse the fit if those samples contradict it
    #[arg(long, value_name = "K", value_parser = held_out(), conflicts_with_all = ["gate", "forget"])]
    pub(crate) held_out: Option<NonZeroU32>,
    /// Let older samples count less, with a memory of N samples, to find the robot as it is at the
    /// end of the file
    #[arg(long, value_name = "N")]
    pub(crate) forget: Option<NonZeroU32>,
    /// The frame of the measured positions
    #[arg(long, value_enum, default_value_t = FrameArgument::Base)]
    pub(crate) frame: FrameArgument,
    /// Do not use the robot file as a start value (needs 12 samples), and accept any geometry
    #[arg(long)]
    pub(crate) no_guess: bool,
    /// Write the calibrated robot to this file, replacing a file that exists
    #[arg(long, value_name = "CALIBRATED.toml")]
    pub(crate) output: Option<PathBuf>,
    /// Write the report as JSON to this file, or with - to standard output in place of the table; a
    /// refusal is then written there as well
    #[arg(long, value_name = "REPORT.json")]
    pub(crate) json: Option<PathBuf>,
    /// Write the report with figures to this HTML file, which opens in any browser
    #[arg(long, value_name = "REPORT.html")]
    pub(crate) report: Option<PathBuf>,
    /// Let --output replace ROBOT.toml itself
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct KinematicsArguments {
    /// The robot
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    pub(crate) robot: PathBuf,
    /// The rows to compute; without it, or with -, the program reads standard input
    #[arg(value_name = "FILE.csv")]
    pub(crate) file: Option<PathBuf>,
    /// Write to this file instead of standard output, replacing a file that exists
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MethodArgument {
    /// Fit each arm by itself, from the closure of its kinematic chain
    Ikm,
    /// Fit all 24 parameters at once, to the distances between measured and computed positions
    Fkm,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum SolverArgument {
    /// Levenberg–Marquardt: damps steps that would not improve the fit, and converges
    Lm,
    /// Gauss–Newton: takes full steps only; if it diverges, the calibration is refused
    Gn,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum LossArgument {
    /// As much as all others (least squares); a single wrong row spoils the result
    Squared,
    /// Less, the more it disagrees, and nothing beyond 4.7 scales; the report names such rows
    Huber,
    /// Like huber, but the weight falls smoothly to zero
    Tukey,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum FrameArgument {
    /// The robot's own frame
    Base,
    /// The sensor's frame, wherever the sensor stands; the program finds and reports it
    Sensor,
}

fn held_out() -> impl TypedValueParser<Value = NonZeroU32> {
    value_parser!(u32).range(2..).try_map(NonZeroU32::try_from)
}

impl MethodArgument {
    pub(crate) const fn method(self) -> CalibrationMethod {
        match self {
            Self::Ikm => CalibrationMethod::Ikm,
            Self::Fkm => CalibrationMethod::Fkm,
        }
    }
}

impl CalibrateArguments {
    pub(crate) fn options(&self) -> Options {
        Options {
            method: self.method.method(),
            solver: match self.solver {
                SolverArgument::Lm => delta_cal::Method::LevenbergMarquardt,
                SolverArgument::Gn => delta_cal::Method::GaussNewton,
            },
            frame: match self.frame {
                FrameArgument::Base => Frame::Base,
                FrameArgument::Sensor => Frame::Sensor,
            },
            loss: match self.loss {
                LossArgument::Squared => None,
                LossArgument::Huber => Some(delta_cal::Loss::Huber),
                LossArgument::Tukey => Some(delta_cal::Loss::Tukey),
            },
            streaming: Streaming {
                gate: self.gate,
                held_out: self.held_out,
                forget: self.forget,
            },
            no_guess: self.no_guess,
        }
    }
}
