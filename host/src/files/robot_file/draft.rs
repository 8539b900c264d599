//! A robot file for somebody who has none: every key with what it means.

use super::RobotFile;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::text::numbers::rounded;
use delta_cal::robot::Drive;
use std::fmt::Write as _;
use std::io::{self, BufRead, Write};

/// What a first robot file states. Lengths in mm, angles in degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    drive: Drive,
    /// Of every entry, in their order.
    values: Vec<f64>,
}

/// A forearm below this was not stated in mm.
const LEAST_FOREARM: f64 = 10.0;

/// A number of the file.
#[derive(Debug, Clone, Copy)]
struct Entry {
    key: &'static str,
    /// What stands beside the key.
    meaning: &'static str,
    /// What is asked.
    question: &'static str,
    /// The answer to an empty line.
    usual: Option<f64>,
}

const fn entry(
    key: &'static str,
    usual: Option<f64>,
    meaning: &'static str,
    question: &'static str,
) -> Entry {
    Entry {
        key,
        meaning,
        question,
        usual,
    }
}

/// A table of the file: its heading, and its numbers.
type Section = (&'static str, &'static [Entry]);

const ROTARY: [Section; 3] = [
    (
        "[nominal]",
        &[
            entry(
                "base_radius_mm",
                None,
                "from the z axis to the axis of a motor",
                "Distance from the z axis to a motor's axis, mm",
            ),
            entry(
                "platform_radius_mm",
                None,
                "from the platform's centre to a forearm's joint",
                "Distance from the platform's centre to a forearm's joint, mm",
            ),
            entry(
                "upper_arm_mm",
                None,
                "from the motor's axis to the elbow",
                "Length of the upper arms, mm",
            ),
            entry(
                "forearm_mm",
                None,
                "from the elbow to the platform",
                "Length of the forearms, mm",
            ),
        ],
    ),
    (
        "[joints]                   # 0: the upper arm is level; positive: it points downwards",
        &[
            entry(
                "min_deg",
                Some(-60.0),
                "the smallest joint angle",
                "Smallest joint angle, degrees (0: upper arm level, positive: downwards)",
            ),
            entry(
                "max_deg",
                Some(90.0),
                "the largest",
                "Largest joint angle, degrees",
            ),
        ],
    ),
    (
        "[tolerance]                # one sigma of each parameter as the robot was made",
        &[
            entry(
                "length_mm",
                Some(0.5),
                "of the eight parameters of an arm the lengths",
                "Tolerance of every length as the robot was made, one sigma, mm",
            ),
            entry(
                "angle_deg",
                Some(0.2),
                "and the angles",
                "Tolerance of every angle, one sigma, degrees",
            ),
        ],
    ),
];

const LINEAR: [Section; 3] = [
    (
        "[nominal]\nkind = \"linear\"            # carriages that run along towers",
        &[
            entry(
                "tower_radius_mm",
                None,
                "from the centre to a tower, less the platform's radius",
                "Distance from the centre to a tower, less the platform's radius (\"delta radius\"), mm",
            ),
            entry(
                "forearm_mm",
                None,
                "the rods, from the carriage to the platform",
                "Length of the rods, mm",
            ),
        ],
    ),
    (
        "[joints]                   # travel of the carriages, upwards",
        &[
            entry(
                "min_mm",
                None,
                "the lowest",
                "Lowest travel of a carriage, mm",
            ),
            entry(
                "max_mm",
                None,
                "the highest",
                "Highest travel of a carriage, mm",
            ),
        ],
    ),
    (
        "[tolerance]                # one sigma of each parameter as the machine was built",
        &[
            entry(
                "length_mm",
                Some(0.5),
                "of the rods, and of where a tower stands",
                "Tolerance of every length as the machine was built, one sigma, mm",
            ),
            entry(
                "angle_deg",
                Some(0.17),
                "by which a tower leans",
                "Tolerance of a tower's lean, one sigma, degrees",
            ),
            entry(
                "scale",
                Some(0.001),
                "of a carriage's travel, as a part of it",
                "Tolerance of a carriage's travel, one sigma, as a part of it",
            ),
            entry(
                "zero_mm",
                Some(5.0),
                "of the end stops",
                "Tolerance of the end stops, one sigma, mm",
            ),
        ],
    ),
];

const fn sections(drive: Drive) -> &'static [Section; 3] {
    match drive {
        Drive::Rotary => &ROTARY,
        Drive::Linear => &LINEAR,
    }
}

fn entries(drive: Drive) -> impl Iterator<Item = Entry> {
    let sections = sections(drive).iter();
    sections.flat_map(|(_, entries)| entries.iter().copied())
}

impl Draft {
    /// Asks for what is not known yet: the numbers of the file in their order.
    ///
    /// # Errors
    /// An answer cannot be read, or the input ends.
    pub fn ask(
        drive: Drive,
        known: &[Option<f64>],
        mut answers: impl BufRead,
        mut to: impl Write,
    ) -> io::Result<Self> {
        let mut values = Vec::new();
        for (entry, known) in entries(drive).zip(known) {
            values.push(match known {
                Some(known) => *known,
                None => entry.answer(&mut answers, &mut to)?,
            });
        }
        Ok(Self { drive, values })
    }

    /// Of what is known, the usual for the rest; what is missing has no usual value.
    ///
    /// # Errors
    /// What is missing, in words.
    pub fn usual(drive: Drive, known: &[Option<f64>]) -> Result<Self, &'static str> {
        let values = entries(drive)
            .zip(known)
            .map(|(entry, known)| known.or(entry.usual).ok_or(entry.question));
        let values = values.collect::<Result<_, _>>()?;
        Ok(Self { drive, values })
    }

    /// The file's text, as a person would write it.
    ///
    /// # Errors
    /// What [`RobotFile::read`] finds wrong with it.
    pub fn to_toml(&self, name: &str) -> Result<String, InputError> {
        let mut text = String::from(
            "# A Delta robot as it was drawn. delta-cal calibrate finds what it is really like.\n",
        );
        let mut values = self.values.iter();
        for (head, entries) in sections(self.drive) {
            let _ = write!(text, "\n{head}\n");
            for (entry, value) in entries.iter().zip(values.by_ref()) {
                let line = format!("{} = {}", entry.key, rounded(*value));
                let _ = writeln!(text, "{line:<26} # {}", entry.meaning);
            }
        }
        let joint = match self.drive {
            Drive::Rotary => {
                "joint_deg = 0.002          # of a joint angle: an encoder on a geared joint"
            }
            Drive::Linear => "joint_mm = 0.01            # of a carriage's travel",
        };
        let _ = write!(text, "{NOISE}{joint}\n{REST}");
        let robot = RobotFile::read(&InputText::new(name, &text))?.robot;
        let forearm = robot
            .arms()
            .iter()
            .map(delta_cal::robot::Arm::lb)
            .fold(0.0, f64::max);
        if forearm < LEAST_FOREARM {
            let cause = format!(
                "the forearms would be {} mm long: the lengths seem to be in metres",
                rounded(forearm)
            );
            return Err(InputError::new(name, cause)
                .with_remedy("give all lengths in mm, as 480 and not 0.480"));
        }
        Ok(text)
    }
}

const NOISE: &str = "
[noise]                    # one sigma of a measurement: repeat one pose ten times to learn it
position_mm = 0.02         # of x, y and z: a laser tracker
";
const REST: &str = "\
# height_mm = 0.02         # of a height above a plate: a dial gauge
# distance_mm = 0.05       # of a distance: a calliper or a wire sensor

# [target]                 # the measured point from the platform point: a reflector, a tip
# x_mm = 0
# y_mm = 0
# z_mm = -40

# [robot]                  # for reports and certificates
# name = \"Packer 3\"
# serial = \"D24-0117\"
# [measurement]
# operator = \"A. Meier\"
# instrument = \"laser tracker\"
# date = 2026-03-14
";

impl Entry {
    fn answer(&self, answers: &mut impl BufRead, to: &mut impl Write) -> io::Result<f64> {
        loop {
            match self.usual {
                Some(usual) => write!(to, "{} [{usual}]: ", self.question)?,
                None => write!(to, "{}: ", self.question)?,
            }
            to.flush()?;
            let mut line = String::new();
            if answers.read_line(&mut line)? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            let line = line.trim().replace(',', ".");
            match (line.is_empty(), self.usual, line.parse::<f64>()) {
                (true, Some(usual), _) => return Ok(usual),
                (false, _, Ok(number)) if number.is_finite() => return Ok(number),
                _ => writeln!(to, "Enter a number.")?,
            }
        }
    }
}
