//! The options of `delta-cal calibrate`.

use crate::cli::choices::{FrameArgument, LossArgument, MethodArgument, SolverArgument};
use crate::cli::paths::robot_path;
use clap::builder::TypedValueParser;
use clap::{Args, value_parser};
use delta_cal_host::{Options, Streaming};
use std::num::NonZeroU32;
use std::path::PathBuf;

pub(crate) const HELP: &str = "\
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

fn held_out() -> impl TypedValueParser<Value = NonZeroU32> {
    value_parser!(u32).range(2..).try_map(NonZeroU32::try_from)
}

impl CalibrateArguments {
    pub(crate) fn options(&self) -> Options {
        Options {
            method: self.method.method(),
            solver: self.solver.solver(),
            frame: self.frame.frame(),
            loss: self.loss.loss(),
            streaming: Streaming {
                gate: self.gate,
                held_out: self.held_out,
                forget: self.forget,
            },
            no_guess: self.no_guess,
        }
    }
}
