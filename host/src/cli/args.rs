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
With 1, 2 and 3 no output file is written or changed.";

const KINEMATICS_EXIT_CODES: &str = "\
Exit codes:
  0  done: every row is computed
  2  the command line is wrong
  3  an input file is wrong, or a row has no solution
  4  the output could not be written
With 2 and 3 no output file is written or changed.";

const EXAMPLES: &str = "\
The rows are in the order in which they were measured where that matters. With --gate each is tested
against what the rows before and the stated [tolerance] predict, and left out if it is 4.7 sigma off or
more; eight such rows in a row mean that the robot has changed, and are refused. With --held-out K
every K-th row is kept from the fit and must agree with it, or there is no result; then all rows
count. With --forget N a row counts N/(N+1) times as much as the next, for a robot that warms up: the
result lags N rows behind. --gate and --held-out do the same as the functions of the same name in firmware.

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
  [nominal]                # or three [[arm]] with dx_mm, dy_mm, dz_mm, theta_deg, alpha_deg,
  base_radius_mm = 194     #   la_x_mm, la_y_mm, lb_mm
  platform_radius_mm = 30
  upper_arm_mm = 260
  forearm_mm = 480
  [joints]
  min_deg = -60
  max_deg = 90
  [tolerance]              # optional: one sigma of each parameter about nominal. With it, fewer
  length_mm = 0.5          #   than 8 samples will do, and few samples cannot make the robot worse
  angle_deg = 0.2
  [noise]                  # optional: one sigma of a measurement. Weights the samples and tells
  position_mm = 0.02       #   whether the residual is credible
  joint_deg = 0.002

SAMPLES.csv (or q1_rad..., x_m...; any order; # begins a comment; columns whose name begins with _,
such as _point or _time, are not looked at):
  q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,_point
  10.0,20.0,30.0,41.151,25.265,-338.742,P1

With --frame sensor the robot's frame is the one that best fits ROBOT.toml to the measured points,
and a cyclic exchange of the joint columns (q2,q3,q1 for q1,q2,q3) cannot be detected: a Delta has
threefold symmetry.

Without a [tolerance], a result further from ROBOT.toml than 10 % of the forearm or 10 degrees is
refused, unless --no-guess says that ROBOT.toml is no guess.

With --loss huber or tukey up to 40 % of the rows may be wrong: a reflector that slipped, a joint
that was still moving, a digit. The fit starts from the rows that agree best (16 are needed), takes
the scale of the residuals from their median, and does not count what is 4.7 scales off; the report
names those rows with their residual in sigma. A file that is wrong as a whole is refused as ever.

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
The input has the columns q1_deg,q2_deg,q3_deg (or q1_rad...), the output
q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm. A samples file will do as input; its positions are not used.
If one row has no solution, nothing is written.

Examples:
  delta-cal forward robot.toml angles.csv
  printf 'q1_deg,q2_deg,q3_deg\\n10,20,30\\n' | delta-cal forward robot.toml";

const INVERSE_HELP: &str = "\
The input has the columns x_mm,y_mm,z_mm (or x_m...), the output
q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm. A samples file will do as input; its angles are not used.
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
    /// Choose the poses that are best to measure, and say what to expect of them
    #[command(after_help = plan::HELP)]
    Plan(PlanArguments),
    /// Check whether samples determine the robot, and which poses to add
    #[command(after_help = check::HELP)]
    Check(CheckArguments),
    /// Calibrate many simulated robots, to learn what a calibration will be worth
    #[command(after_help = simulate::help())]
    Simulate(SimulateArguments),
    /// Run every simulation of the paper, and set its numbers beside this program's
    #[command(after_help = reproduce::HELP)]
    Reproduce(ReproduceArguments),
    /// Compute where the robot gets: boundary, volume, cylinders, singularities, influence of errors
    Workspace(WorkspaceArguments),
    /// Calibrate a controller that calibrates itself, over its serial link
    Device(DeviceArguments),
}

#[derive(Debug, Args)]
pub(crate) struct CalibrateArguments {
    /// The robot before calibration; without files the built-in example is calibrated
    #[arg(value_name = "ROBOT.toml", requires = "samples", value_parser = robot_path())]
    pub(crate) robot: Option<PathBuf>,
    /// Joint angles and measured positions; - is standard input
    #[arg(value_name = "SAMPLES.csv")]
    pub(crate) samples: Option<PathBuf>,
    /// How the parameters are estimated
    #[arg(long, value_enum, default_value_t = MethodArgument::Ikm)]
    pub(crate) method: MethodArgument,
    /// How the equations are solved
    #[arg(long, value_enum, default_value_t = SolverArgument::Lm)]
    pub(crate) solver: SolverArgument,
    /// How a sample that disagrees with the others counts
    #[arg(long, value_enum, default_value_t = LossArgument::Squared)]
    pub(crate) loss: LossArgument,
    /// Test each sample, in the file's order, against those before it, and leave out what disagrees
    #[arg(long)]
    pub(crate) gate: bool,
    /// Hold every K-th sample out of the fit, and refuse a calibration that disagrees with them
    #[arg(long, value_name = "K", value_parser = held_out(), conflicts_with_all = ["gate", "forget"])]
    pub(crate) held_out: Option<NonZeroU32>,
    /// Let samples fade, with a memory of N samples: the robot as it is at the file's end
    #[arg(long, value_name = "N")]
    pub(crate) forget: Option<NonZeroU32>,
    /// The frame of the measured positions
    #[arg(long, value_enum, default_value_t = FrameArgument::Base)]
    pub(crate) frame: FrameArgument,
    /// The robot file is no guess: start without one (needs 12 samples) and accept any geometry
    #[arg(long)]
    pub(crate) no_guess: bool,
    /// Write the calibrated robot to this file; a file that exists is replaced
    #[arg(long, value_name = "CALIBRATED.toml")]
    pub(crate) output: Option<PathBuf>,
    /// Write the report as JSON to this file; with - to standard output in place of the table, where a
    /// refusal is told as well
    #[arg(long, value_name = "REPORT.json")]
    pub(crate) json: Option<PathBuf>,
    /// Write the report with figures to this file: HTML that opens in any browser
    #[arg(long, value_name = "REPORT.html")]
    pub(crate) report: Option<PathBuf>,
    /// Allow --output to replace ROBOT.toml itself
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct KinematicsArguments {
    /// The robot
    #[arg(value_name = "ROBOT.toml", value_parser = robot_path())]
    pub(crate) robot: PathBuf,
    /// The rows to compute; standard input without it, or with -
    #[arg(value_name = "FILE.csv")]
    pub(crate) file: Option<PathBuf>,
    /// Write to this file in place of standard output; a file that exists is replaced
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum MethodArgument {
    /// Each arm by itself, from the closure of its kinematic chain
    Ikm,
    /// All 24 parameters at once, from the distances between measured and computed positions
    Fkm,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum SolverArgument {
    /// Levenberg–Marquardt: damped, converges
    Lm,
    /// Gauss–Newton: full steps, can diverge and then says so
    Gn,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum LossArgument {
    /// As all others: least squares, spoilt by a single wrong row
    Squared,
    /// Less, the more it disagrees, and not at all if it is wrong; wrong rows are named
    Huber,
    /// As huber, falling off smoothly
    Tukey,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum FrameArgument {
    /// The robot's own
    Base,
    /// The sensor's, wherever it stands; the frame is found and reported
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
                SolverArgument::Lm => delta_cal::calibration::Solver::LevenbergMarquardt,
                SolverArgument::Gn => delta_cal::calibration::Solver::GaussNewton,
            },
            frame: match self.frame {
                FrameArgument::Base => Frame::Base,
                FrameArgument::Sensor => Frame::Sensor,
            },
            loss: match self.loss {
                LossArgument::Squared => None,
                LossArgument::Huber => Some(delta_cal::robust::Loss::Huber),
                LossArgument::Tukey => Some(delta_cal::robust::Loss::Tukey),
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
