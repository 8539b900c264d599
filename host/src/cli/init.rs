//! `delta-cal init`.

use super::failure::Failure;
use super::paths::is_stream;
use super::print::print;
use crate::files::output;
use crate::files::robot_file::Draft;
use clap::Args;
use std::io::IsTerminal;
use std::path::PathBuf;

pub(crate) const HELP: &str = "\
Without the lengths the program asks for them, and for everything else that no option states; an \
empty answer takes the value in brackets. It does not replace a file that exists.

The robot file has a comment for every key. Edit it: three [[arm]] tables take the place of [nominal] \
for a robot whose arms differ (delta-cal calibrate --help).

Examples:
  delta-cal init
  delta-cal init --base-radius 194 --platform-radius 30 \\
      --upper-arm 260 --forearm 480
  delta-cal init --output delta.toml
  delta-cal plan robot.toml --count 12 --output poses.csv
      what to do next

Exit codes:
  0  the file is written
  2  the command line is wrong, or the answers end too early
  3  there is no such robot: a length or an angle is not possible
  4  the file exists, or could not be written";

#[derive(Debug, Args)]
pub(crate) struct InitArguments {
    /// From the z axis to the axis of a motor
    #[arg(long, value_name = "MM")]
    base_radius: Option<f64>,
    /// From the platform's centre to a forearm's joint
    #[arg(long, value_name = "MM")]
    platform_radius: Option<f64>,
    /// From the motor's axis to the elbow
    #[arg(long, value_name = "MM")]
    upper_arm: Option<f64>,
    /// From the elbow to the platform
    #[arg(long, value_name = "MM")]
    forearm: Option<f64>,
    /// The smallest joint angle: 0 with the upper arm level, positive downwards. -60 without this option
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    joint_min: Option<f64>,
    /// The largest joint angle. 90 without this option
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    joint_max: Option<f64>,
    /// One sigma of every length as the robot was made. 0.5 without this option
    #[arg(long, value_name = "MM")]
    length_tolerance: Option<f64>,
    /// One sigma of every angle as the robot was made. 0.2 without this option
    #[arg(long, value_name = "DEGREES")]
    angle_tolerance: Option<f64>,
    /// Write the robot to this file, or with - to standard output
    #[arg(long, value_name = "ROBOT.toml", default_value = "robot.toml")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &InitArguments) -> Result<(), Failure> {
    let path = &arguments.output;
    if !is_stream(path) && path.exists() {
        return Err(Failure::Output(format!(
            "{}: the file exists, and init replaces none",
            path.display()
        )));
    }
    let known = [
        arguments.base_radius,
        arguments.platform_radius,
        arguments.upper_arm,
        arguments.forearm,
        arguments.joint_min,
        arguments.joint_max,
        arguments.length_tolerance,
        arguments.angle_tolerance,
    ];
    let lengths_known = known.iter().take(4).all(Option::is_some);
    let draft = if lengths_known || !std::io::stdin().is_terminal() {
        Draft::usual(known).map_err(|missing| Failure::Usage {
            cause: format!("nothing states this: {missing}"),
            remedy: "give --base-radius, --platform-radius, --upper-arm and --forearm, or run the \
                     command in a terminal, where it asks"
                .to_owned(),
        })?
    } else {
        let answers = std::io::stdin().lock();
        Draft::ask(known, answers, anstream::stderr()).map_err(|_| Failure::Usage {
            cause: "the answers end too early".to_owned(),
            remedy: "answer every question, or give the lengths as options".to_owned(),
        })?
    };
    let toml = draft.to_toml(&path.display().to_string())?;
    if is_stream(path) {
        return print(&toml);
    }
    output::write_all(&[(path.as_path(), &toml)])?;
    print(&format!(
        "Written: {}\nNext: delta-cal plan {0} --count 12 --output poses.csv\n",
        path.display()
    ))
}
