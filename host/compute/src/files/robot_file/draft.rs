//! A robot file for somebody who has none: every key with what it means.

use super::RobotFile;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::text::numbers::rounded;
use std::fmt::Write as _;
use std::io::{self, BufRead, Write};

/// What a first robot file states. Lengths in mm, angles in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draft {
    /// From the z axis to the axis of a motor.
    pub base_radius: f64,
    /// From the platform's centre to a forearm's joint.
    pub platform_radius: f64,
    /// From the motor's axis to the elbow.
    pub upper_arm: f64,
    /// From the elbow to the platform.
    pub forearm: f64,
    /// The smallest and the largest joint angle; 0 with the upper arm level, positive downwards.
    pub joints: (f64, f64),
    /// One σ of every length and of every angle as the robot was made.
    pub tolerance: (f64, f64),
}

/// What is asked of a draft, in this order, and the answer to an empty line.
struct Question {
    text: &'static str,
    usual: Option<f64>,
}

const fn question(text: &'static str, usual: Option<f64>) -> Question {
    Question { text, usual }
}

const QUESTIONS: [Question; 8] = [
    question("Distance from the z axis to a motor's axis, mm", None),
    question(
        "Distance from the platform's centre to a forearm's joint, mm",
        None,
    ),
    question("Length of the upper arms, mm", None),
    question("Length of the forearms, mm", None),
    question(
        "Smallest joint angle, degrees (0: upper arm level, positive: downwards)",
        Some(-60.0),
    ),
    question("Largest joint angle, degrees", Some(90.0)),
    question(
        "Tolerance of every length as the robot was made, one sigma, mm",
        Some(0.5),
    ),
    question("Tolerance of every angle, one sigma, degrees", Some(0.2)),
];

impl Draft {
    /// Asks for what is not known yet: the numbers of this type in their order.
    ///
    /// # Errors
    /// An answer cannot be read, or the input ends.
    pub fn ask(
        known: [Option<f64>; 8],
        mut answers: impl BufRead,
        mut to: impl Write,
    ) -> io::Result<Self> {
        let mut values = [0.0; 8];
        for ((value, known), question) in values.iter_mut().zip(known).zip(QUESTIONS) {
            *value = match known {
                Some(known) => known,
                None => question.answer(&mut answers, &mut to)?,
            };
        }
        Ok(Self::of(values))
    }

    /// Of what is known, the usual for the rest; what is missing has no usual value.
    ///
    /// # Errors
    /// What is missing, in words.
    pub fn usual(known: [Option<f64>; 8]) -> Result<Self, &'static str> {
        let mut values = [0.0; 8];
        for ((value, known), question) in values.iter_mut().zip(known).zip(QUESTIONS) {
            *value = known.or(question.usual).ok_or(question.text)?;
        }
        Ok(Self::of(values))
    }

    fn of([base, platform, upper, forearm, least, most, length, angle]: [f64; 8]) -> Self {
        Self {
            base_radius: base,
            platform_radius: platform,
            upper_arm: upper,
            forearm,
            joints: (least, most),
            tolerance: (length, angle),
        }
    }

    /// The file's text, as a person would write it.
    ///
    /// # Errors
    /// What [`RobotFile::read`] finds wrong with it.
    pub fn to_toml(&self, name: &str) -> Result<String, InputError> {
        let mut text = String::from(
            "# A Delta robot as it was drawn. delta-cal calibrate finds what it is really like.\n",
        );
        let mut section = |head: &str, lines: &[(&str, f64, &str)]| {
            let _ = write!(text, "\n{head}\n");
            for (key, value, meaning) in lines {
                let entry = format!("{key} = {}", rounded(*value));
                let _ = writeln!(text, "{entry:<26} # {meaning}");
            }
        };
        section(
            "[nominal]",
            &[
                (
                    "base_radius_mm",
                    self.base_radius,
                    "from the z axis to the axis of a motor",
                ),
                (
                    "platform_radius_mm",
                    self.platform_radius,
                    "from the platform's centre to a forearm's joint",
                ),
                (
                    "upper_arm_mm",
                    self.upper_arm,
                    "from the motor's axis to the elbow",
                ),
                ("forearm_mm", self.forearm, "from the elbow to the platform"),
            ],
        );
        section(
            "[joints]                   # 0: the upper arm is level; positive: it points downwards",
            &[
                ("min_deg", self.joints.0, "the smallest joint angle"),
                ("max_deg", self.joints.1, "the largest"),
            ],
        );
        section(
            "[tolerance]                # one sigma of each parameter as the robot was made",
            &[
                (
                    "length_mm",
                    self.tolerance.0,
                    "of the eight parameters of an arm the lengths",
                ),
                ("angle_deg", self.tolerance.1, "and the angles"),
            ],
        );
        text.push_str(NOISE);
        RobotFile::read(&InputText::new(name, &text))?;
        Ok(text)
    }
}

const NOISE: &str = "
[noise]                    # one sigma of a measurement: repeat one pose ten times to learn it
position_mm = 0.02         # of x, y and z: a laser tracker
joint_deg = 0.002          # of a joint angle: an encoder on a geared joint
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

impl Question {
    fn answer(&self, answers: &mut impl BufRead, to: &mut impl Write) -> io::Result<f64> {
        loop {
            match self.usual {
                Some(usual) => write!(to, "{} [{usual}]: ", self.text)?,
                None => write!(to, "{}: ", self.text)?,
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
