//! The options of `delta-cal calibrate`.

use crate::Options;
use crate::cli::choices::{FrameArgument, LossArgument, MethodArgument, SolverArgument};
use crate::cli::length::Length;
use crate::cli::paths::{ColumnsArgument, robot_path};
use crate::cli::streaming::StreamingArguments;
use clap::Args;
use std::path::{Path, PathBuf};

pub(crate) const HELP: &str = "\
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

Columns may stand in any order, in other units (q1_rad, x_m, x_cm, x_in) and as Q1 [deg] or X (mm). \
Commas, semicolons, tabs or spaces separate them, and decimal commas are read where they are certain. \
A # begins a comment. The program ignores columns whose name begins with _, such as _point, and \
columns such as timestamp or comment. --columns q1_deg=A1,x_mm=X names columns of other names. A row \
that was not measured is an error.

In place of x, y and z a row may hold, and other cells may be empty:
  x_mm alone, or any two of x_mm, y_mm, z_mm          a camera, a gauge
  height_mm, and the name of a plane in column plane  a plate; gauge blocks
  distance_mm, and the name of a point in column point  a ball bar, a wire
  distance_mm, and to_q1_deg,to_q2_deg,to_q3_deg      between two poses
[noise] then states height_mm or distance_mm. The places of planes and points are unknown and are \
found. Without x, y and z the [tolerance] is needed, and heights and distances cannot show that \
joint columns are exchanged. ROBOT.toml may say more: [planes.NAME] z_mm, sigma_mm, tilt_deg; [points.NAME] \
x_mm, y_mm, z_mm, sigma_mm, offset = \"unknown\"; [target] x_mm, y_mm, z_mm, the measured point from the \
platform point.

A robot whose carriages run on towers has kind = \"linear\", tower_radius_mm, forearm_mm and, if the \
towers do not stand at [210, 330, 90], tower_deg in [nominal], min_mm and max_mm in [joints], scale \
and, for the end stops, zero_mm in [tolerance], and joint_mm in [noise]; or [[arm]] tables with dx_mm, \
dy_mm, dz_mm, lean_x_deg, lean_y_deg, scale, lb_mm. Its samples have s1_mm,s2_mm,s3_mm, the travels.

Of more than 10,000 rows the JSON lists those farthest off and others spread evenly, with histograms \
of all (sampled); the HTML page does so from 2,500 rows on.

With --frame sensor the program chooses the robot's frame so that ROBOT.toml fits the measured \
points best. It then cannot detect a cyclic exchange of the joint columns (q2,q3,q1 for q1,q2,q3), \
because a Delta has threefold symmetry.

Without a [tolerance] the program refuses a result that differs from ROBOT.toml by more than 10 % of \
the forearm or by more than 10 degrees. With --no-guess it accepts any geometry.

With --loss huber or tukey the program leaves out wrong rows: a reflector slipped, a joint was still \
moving, a digit was mistyped. The fit starts from the rows that agree best, estimates the scale of \
the residuals from their median, and leaves out every row that is off by 4.7 scales or more; the \
report names these rows with their residual in sigma. At most 40 % of the rows may be wrong, and \
fewer of a short file: 4 of 16 rows, 6 of 20, 8 of 24, 11 of 30; of heights and distances some 4 of \
45, because they say little more than the parameters need. A file that is wrong as a whole is \
refused as without this option.

--gate, --held-out and --forget need the rows in the order in which they were measured. With --gate \
the program compares each row with what the rows before it and the [tolerance] predict, and leaves \
it out if it is off by 4.7 sigma or more. Eight such rows in succession mean that the robot has \
changed, and the calibration is refused. With --held-out K the program fits the robot without every \
K-th row, and refuses the fit if those rows contradict it; if they agree, all rows make the result. \
With --forget N each row counts N/(N+1) times as much as the next one, so that the result follows a \
robot that warms up; it lags N rows behind. Firmware can do the same with StreamCalibrator of the \
Rust library.

With --limit the report says whether the expanded uncertainty of the position, k times the expected \
position error (rms over the workspace), is within the limit: k = 2, or from Student's distribution \
where no [noise] is stated. Of heights, distances and single coordinates it is that of relative \
positions. All output files are written in either case.

ROBOT.toml may also state [robot] name and serial, and [measurement] operator, instrument and date. \
Reports show them, with the SHA-256 of both input files. The environment variable SOURCE_DATE_EPOCH \
sets the date of reports, for tests.

Examples:
  delta-cal calibrate
      the built-in, simulated example
  delta-cal calibrate robot.toml samples.csv --output calibrated.toml
  delta-cal calibrate robot.toml tracker.csv --frame sensor --json report.json
  delta-cal calibrate robot.toml touches.csv --report report.html
  delta-cal calibrate robot.toml samples.csv --loss tukey
  delta-cal calibrate robot.toml samples.csv --gate --forget 50
  delta-cal calibrate robot.toml samples.csv --report report.html
  delta-cal calibrate robot.toml samples.csv --limit 0.1mm --report report.html
  delta-cal calibrate robot.toml samples.csv --json - | jq .position_error_mm";

#[derive(Debug, Args)]
pub(crate) struct CalibrateArguments {
    /// The robot before calibration. Without files the program calibrates its built-in example
    #[arg(value_name = "ROBOT.toml", requires = "samples", value_parser = robot_path())]
    pub(crate) robot: Option<PathBuf>,
    /// Joint angles and what was measured there; - reads standard input
    #[arg(value_name = "SAMPLES.csv")]
    pub(crate) samples: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) columns: ColumnsArgument,
    /// How the parameters are estimated
    #[arg(long, value_enum, default_value_t = MethodArgument::Joint)]
    pub(crate) method: MethodArgument,
    /// How the equations are solved
    #[arg(long, value_enum, default_value_t = SolverArgument::Lm)]
    pub(crate) solver: SolverArgument,
    /// How much a sample counts that disagrees with the others
    #[arg(long, value_enum, default_value_t = LossArgument::Squared)]
    pub(crate) loss: LossArgument,
    #[command(flatten)]
    pub(crate) streaming: StreamingArguments,
    /// The frame of the measured positions
    #[arg(long, value_enum, default_value_t = FrameArgument::Base)]
    pub(crate) frame: FrameArgument,
    /// Do not use the robot file as a start value (needs 12 samples, and a robot file without
    /// [tolerance]), and accept any geometry
    #[arg(long)]
    pub(crate) no_guess: bool,
    /// Accept the calibration only if its expanded uncertainty (k = 2, rms over the workspace) is at most this,
    /// as 0.1mm or 50um; otherwise the exit code is 6
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    limit: Option<Length>,
    /// Write the calibrated robot to this file, replacing a file that exists, or with - to standard
    /// output in place of the table
    #[arg(long, value_name = "CALIBRATED.toml")]
    pub(crate) output: Option<PathBuf>,
    /// Write the report as JSON to this file, or with - to standard output in place of the table; with -
    /// a refusal is written as JSON as well
    #[arg(long, value_name = "REPORT.json")]
    pub(crate) json: Option<PathBuf>,
    /// Write the report with figures to this HTML file, which opens in any browser, or with - to
    /// standard output
    #[arg(long, value_name = "REPORT.html")]
    pub(crate) report: Option<PathBuf>,
    /// Let --output replace ROBOT.toml itself
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
}

impl CalibrateArguments {
    /// mm.
    pub(crate) fn limit(&self) -> Option<f64> {
        self.limit.map(|Length(limit)| limit)
    }

    /// Where the calibrated robot, the JSON and the page go.
    pub(crate) fn outputs<'a>(
        &'a self,
        toml: &'a str,
        json: &'a str,
        page: &'a str,
    ) -> [(Option<&'a Path>, &'a str); 3] {
        [
            (self.output.as_deref(), toml),
            (self.json.as_deref(), json),
            (self.report.as_deref(), page),
        ]
    }

    pub(crate) fn options(&self) -> Options {
        Options {
            method: self.method.method(),
            solver: self.solver.solver(),
            frame: self.frame.frame(),
            loss: self.loss.loss(),
            streaming: self.streaming.streaming(),
            no_guess: self.no_guess,
        }
    }
}
