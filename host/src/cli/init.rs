//! `delta-cal init`.

use super::failure::Failure;
use super::paths::is_stream;
use super::print::print;
use crate::files::output;
use crate::files::robot_file::Draft;
use clap::{Args, ValueEnum};
use delta_cal::robot::Drive;
use std::io::IsTerminal;
use std::path::PathBuf;

pub(crate) const HELP: &str = "\
Without the lengths the program asks for them, and for everything else that no option states; an \
empty answer takes the value in brackets. It does not replace a file that exists.

The robot file has a comment beside every number. Edit it: three [[arm]] tables take the place of [nominal] \
for a robot whose arms differ (delta-cal calibrate --help).

Examples:
  delta-cal init
  delta-cal init --base-radius 194 --platform-radius 30 \\
      --upper-arm 260 --forearm 480
  delta-cal init --kind linear --tower-radius 140 --forearm 330 \\
      --travel-min 100 --travel-max 600 --output printer.toml
  delta-cal plan robot.toml --count 12 --output poses.csv
      what to do next

Exit codes:
  0  the file is written
  2  the command line is wrong, or the answers end too early
  3  there is no such robot: a length or an angle is not possible
  4  the file exists, or could not be written";

/// What moves the elbows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Motors turn the upper arms
    Rotary,
    /// Carriages run along towers, as in most printers
    Linear,
}

#[derive(Debug, Args)]
pub(crate) struct InitArguments {
    /// What moves the elbows
    #[arg(long, value_enum, default_value = "rotary")]
    kind: Kind,
    /// From the z axis to the axis of a motor
    #[arg(long, value_name = "MM")]
    base_radius: Option<f64>,
    /// From the platform's centre to a forearm's joint
    #[arg(long, value_name = "MM")]
    platform_radius: Option<f64>,
    /// From the motor's axis to the elbow
    #[arg(long, value_name = "MM")]
    upper_arm: Option<f64>,
    /// From the elbow or the carriage to the platform
    #[arg(long, value_name = "MM")]
    forearm: Option<f64>,
    /// The smallest joint angle: 0 with the upper arm level, positive downwards. -60 without this option
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    joint_min: Option<f64>,
    /// The largest joint angle. 90 without this option
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    joint_max: Option<f64>,
    /// With --kind linear: from the centre to a tower, less the platform's radius
    #[arg(long, value_name = "MM")]
    tower_radius: Option<f64>,
    /// With --kind linear: the lowest travel of a carriage
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    travel_min: Option<f64>,
    /// With --kind linear: the highest travel of a carriage
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    travel_max: Option<f64>,
    /// One sigma of every length as the robot was made. 0.5 without this option
    #[arg(long, value_name = "MM")]
    length_tolerance: Option<f64>,
    /// One sigma of every angle as the robot was made. 0.2 without this option; of a tower's lean 0.17
    #[arg(long, value_name = "DEGREES")]
    angle_tolerance: Option<f64>,
    /// With --kind linear: one sigma of a carriage's travel, as a part of it. 0.001 without this option
    #[arg(long, value_name = "PART")]
    scale_tolerance: Option<f64>,
    /// With --kind linear: one sigma of the end stops. 5 without this option
    #[arg(long, value_name = "MM")]
    zero_tolerance: Option<f64>,
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
    let (drive, known, others) = arguments.known();
    if let Some((name, _)) = others.iter().find(|(_, given)| *given) {
        return Err(Failure::Usage {
            cause: format!("{name} is no option of such a robot"),
            remedy: "leave it out, or give the other --kind".to_owned(),
        });
    }
    let lengths_known = known.iter().take(LENGTHS).all(Option::is_some);
    let draft = if lengths_known || !std::io::stdin().is_terminal() {
        Draft::usual(drive, &known).map_err(|missing| Failure::Usage {
            cause: format!("nothing states this: {missing}"),
            remedy: match drive {
                Drive::Rotary => {
                    "give --base-radius, --platform-radius, --upper-arm and --forearm (or --kind linear and its \
                     lengths), or run the command in a terminal, where it asks"
                }
                Drive::Linear => {
                    "give --tower-radius, --forearm, --travel-min and --travel-max, or run the command in a \
                     terminal, where it asks"
                }
            }
            .to_owned(),
        })?
    } else {
        if drive == Drive::Rotary {
            anstream::eprintln!(
                "Motors turn the arms of this robot. If carriages run along towers: --kind linear"
            );
        }
        let answers = std::io::stdin().lock();
        Draft::ask(drive, &known, answers, anstream::stderr()).map_err(|_| Failure::Usage {
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

/// The first numbers of either file, which have no usual value.
const LENGTHS: usize = 4;

/// An option's name, and whether it was given.
type Given = (&'static str, bool);

impl InitArguments {
    /// The numbers of the file that are known, in their order, and the options of the other kind of robot.
    fn known(&self) -> (Drive, Vec<Option<f64>>, Vec<Given>) {
        let rotary = [
            ("--base-radius", self.base_radius),
            ("--platform-radius", self.platform_radius),
            ("--upper-arm", self.upper_arm),
            ("--joint-min", self.joint_min),
            ("--joint-max", self.joint_max),
        ];
        let linear = [
            ("--tower-radius", self.tower_radius),
            ("--travel-min", self.travel_min),
            ("--travel-max", self.travel_max),
            ("--scale-tolerance", self.scale_tolerance),
            ("--zero-tolerance", self.zero_tolerance),
        ];
        let given = |options: [(&'static str, Option<f64>); 5]| {
            let options = options.into_iter();
            options
                .map(|(name, value)| (name, value.is_some()))
                .collect()
        };
        match self.kind {
            Kind::Rotary => (
                Drive::Rotary,
                vec![
                    self.base_radius,
                    self.platform_radius,
                    self.upper_arm,
                    self.forearm,
                    self.joint_min,
                    self.joint_max,
                    self.length_tolerance,
                    self.angle_tolerance,
                ],
                given(linear),
            ),
            Kind::Linear => (
                Drive::Linear,
                vec![
                    self.tower_radius,
                    self.forearm,
                    self.travel_min,
                    self.travel_max,
                    self.length_tolerance,
                    self.angle_tolerance,
                    self.scale_tolerance,
                    self.zero_tolerance,
                ],
                given(rotary),
            ),
        }
    }
}
