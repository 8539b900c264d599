//! Faults of a samples file as a whole: exchanged columns, a wrong sign, another unit, a mirrored frame. Each fault is
//! undone and the samples compared with the robot of the file; the faults without which they agree clearly better are
//! named. Nothing is ever corrected.

mod evidence;
mod fault;

use crate::files::columns::Unit;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Readings;
use crate::fit::{Frame, Options};
use crate::text::{list, significant};
use evidence::{Evidence, Scored};
use fault::{EXCHANGED, Fault, LengthUnit, UNCHANGED, handedness};
use serde::Serialize;
use std::fmt;

/// No robot has shorter forearms, mm: the file's lengths are then in a larger unit.
const LEAST_FOREARM: f64 = 10.0;

/// Diagnoses the samples, whether or not a calibration accepts them; `None` if the file as a whole is right, or no
/// fault explains it.
pub(crate) fn diagnose(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Option<Diagnosis> {
    let evidence = Evidence::new(robot, readings, options)?;
    let as_they_are = evidence.median(&[]);
    let found = evidence.explanations(as_they_are);
    if found.is_empty() {
        return None;
    }
    Some(Diagnosis {
        as_they_are,
        explanations: found.iter().map(|own| evidence.explanation(own)).collect(),
    })
}

/// Millimetres per unit of the robot file's lengths, if their unit is the fault.
fn of_robot(faults: &[Fault]) -> f64 {
    let lengths = faults.iter().filter_map(|fault| match fault {
        Fault::Length(unit) if unit.robot.is_some() => Some(1.0 / unit.factor),
        _ => None,
    });
    lengths.product()
}

/// Most explanations named; others that are as good are only counted.
const NAMED: usize = 4;

/// Explanations for samples that cannot be right as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Median distance of the measured points from those of the robot file, mm; infinite if the robot does not reach
    /// them or they are in one spot.
    pub as_they_are: f64,
    /// Explanations, best first, all about equally good. At least one.
    pub explanations: Vec<Explanation>,
}

/// A fault, or two together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// The fault in words.
    pub cause: String,
    /// The remedy.
    pub remedy: String,
    /// [`Diagnosis::as_they_are`] without the faults, mm.
    pub without: f64,
    /// The same after a calibration without the faults; `None` if the calibration is refused.
    pub calibrated: Option<f64>,
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [best, others @ ..] = &self.explanations[..] else {
            return Ok(());
        };
        write!(
            formatter,
            "Probably {}. Without it half of the points are within {} mm of the robot file",
            best.cause,
            significant(best.without, 3),
        )?;
        if let Some(calibrated) = best.calibrated {
            let calibrated = significant(calibrated, 3);
            write!(formatter, " ({calibrated} mm after calibration)")?;
        }
        if self.as_they_are.is_finite() {
            write!(
                formatter,
                "; as they are, {} mm. ",
                significant(self.as_they_are, 3)
            )?;
        } else {
            formatter.write_str(". ")?;
        }
        for other in others.iter().take(NAMED - 1) {
            write!(formatter, "Equally likely: {}. ", other.cause)?;
        }
        if let Some(more) = others.len().checked_sub(NAMED - 1).filter(|more| *more > 0) {
            write!(formatter, "{more} more are as likely. ")?;
        }
        formatter.write_str("Nothing was corrected")
    }
}

impl Diagnosis {
    /// The remedies of the first explanation and of the alternatives.
    pub fn remedy(&self) -> String {
        let mut remedies: Vec<_> = Vec::new();
        for explanation in self.explanations.iter().take(NAMED) {
            if !remedies.contains(&explanation.remedy.as_str()) {
                remedies.push(&explanation.remedy);
            }
        }
        remedies.join("; or ")
    }
}

const COORDINATES: [&str; 3] = ["x", "y", "z"];

impl Evidence<'_> {
    fn explanation(&self, scored: &Scored) -> Explanation {
        let faults = &scored.faults;
        // Distances are in the robot file's unit of length: this converts them to mm.
        let unit = if self.is_in_metres() {
            of_robot(faults)
        } else {
            1.0
        };
        let [cause, remedy] = self.upwards(faults).unwrap_or_else(|| {
            let frame = if faults.contains(&Fault::Elsewhere) {
                Frame::Sensor
            } else {
                self.options.frame
            };
            let each: Vec<_> = faults.iter().map(|own| self.words(own, frame)).collect();
            joined(&each, [" and ", ", and "])
        });
        Explanation {
            cause,
            remedy,
            without: unit * scored.median,
            calibrated: self.calibrated(faults).map(|median| unit * median),
        }
    }

    /// Whether the robot is too small for its lengths to be millimetres.
    fn is_in_metres(&self) -> bool {
        self.forearm < LEAST_FOREARM
    }

    /// The fault, "the columns q2_deg and q3_deg are exchanged", and the remedy.
    fn words(&self, fault: &Fault, frame: Frame) -> [String; 2] {
        let (robot, samples) = (&self.robot.name, &self.readings.name);
        match fault {
            Fault::Order(order) => self.order(*order, frame),
            Fault::Reversed(reversed) => {
                let joints = self.joints(*reversed);
                let (cause, or) = if *reversed == [true; 3] {
                    (
                        "all joint angles have the wrong sign".to_owned(),
                        ", or state [convention] joint_positive = \"up\" and the limits in the same sense",
                    )
                } else {
                    (
                        format!("the sign of the joint angles in {joints} is wrong"),
                        "",
                    )
                };
                let remedy = format!(
                    "change the sign of {joints} in {samples} (a positive angle swings the arm towards the \
                     platform){or}"
                );
                [cause, remedy]
            }
            Fault::Angles(columns, radians) => self.angles(*columns, *radians),
            Fault::Axes { order, signs } => self.axes(*order, *signs, frame),
            Fault::Length(unit) => self.length(unit),
            Fault::Arms(first, second) => [
                format!(
                    "in {robot} the upper arms and forearms of arm {} and arm {} are exchanged",
                    first + 1,
                    second + 1
                ),
                format!("exchange la_x_mm, la_y_mm and lb_mm of the two in {robot}"),
            ],
            Fault::Limits => [
                format!("[joints] of {robot} has the other sign"),
                format!(
                    "change the signs of min_deg and max_deg in {robot} (0 is level, a positive angle swings the arm \
                     towards the platform)"
                ),
            ],
            Fault::Shifted { below } => {
                let (stands, write) = if *below {
                    ("below", "higher")
                } else {
                    ("above", "lower")
                };
                [
                    format!("each position stands one row {stands} the joints that it belongs to"),
                    format!(
                        "write each position of {samples} one row {write}, and delete what then stands alone"
                    ),
                ]
            }
            Fault::Elsewhere => [
                "the positions are in another frame than the robot's".to_owned(),
                "use --frame sensor".to_owned(),
            ],
        }
    }

    /// For joints that count upwards in both files.
    fn upwards(&self, faults: &[Fault]) -> Option<[String; 2]> {
        let (robot, samples) = (&self.robot.name, &self.readings.name);
        let both = faults.contains(&Fault::Limits) && faults.contains(&Fault::Reversed([true; 3]));
        both.then(|| {
            [
                format!("all joints count upwards in {samples} and in [joints] of {robot}"),
                format!("state joint_positive = \"up\" in [convention] of {robot}"),
            ]
        })
    }

    fn order(&self, order: [usize; 3], frame: Frame) -> [String; 2] {
        let (robot, samples) = (&self.robot.name, &self.readings.name);
        let column = |joint: usize| format!("q{}{}", joint + 1, self.angle_unit());
        let clockwise = frame == Frame::Sensor && order == EXCHANGED[0];
        let moved: Vec<_> = (0..3).filter(|joint| order[*joint] != *joint).collect();
        let cause = if let [first, second] = moved[..] {
            format!(
                "{}, or arm {} and arm {}, are exchanged{}",
                list(&[column(first), column(second)]),
                first + 1,
                second + 1,
                if clockwise {
                    ", as where the arms are numbered clockwise seen from above"
                } else {
                    ""
                }
            )
        } else {
            format!(
                "the joint columns are exchanged in turn (joints 1, 2, 3 are in {}), or the frame is turned \
                 by 120° about z",
                list(&order.map(column))
            )
        };
        if clockwise {
            let remedy = format!(
                "state azimuth_deg = [0, 240, 120] in [nominal] of {robot}, or exchange the names of q2 and q3 in {samples}"
            );
            return [cause, remedy];
        }
        let mut joints = [0; 3];
        for (joint, column) in order.iter().enumerate() {
            joints[*column] = joint;
        }
        let remedy = format!(
            "change {} in the header of {samples} to {}, or number the arms of {robot} as the columns are",
            [0, 1, 2].map(column).join(","),
            joints.map(column).join(",")
        );
        [cause, remedy]
    }

    fn angles(&self, columns: [bool; 3], radians: bool) -> [String; 2] {
        let samples = &self.readings.name;
        let (are, says, named) = if radians {
            ("radians", "degrees", "q1_rad,q2_rad,q3_rad")
        } else {
            ("degrees", "radians", "q1_deg,q2_deg,q3_deg")
        };
        let header = if self.readings.in_degrees == radians {
            format!(", and the header says {says}")
        } else {
            String::new()
        };
        let cause = format!(
            "the joint angles in {} are {are}{header}",
            self.joints(columns)
        );
        let remedy = if columns == [true; 3] {
            format!("name the columns of {samples} {named}")
        } else {
            format!("correct the unit (_deg or _rad) in the header of {samples}")
        };
        [cause, remedy]
    }

    fn axes(&self, order: [usize; 3], signs: [f64; 3], frame: Frame) -> [String; 2] {
        let samples = &self.readings.name;
        if frame == Frame::Sensor {
            return [
                "the sensor's frame is mirrored (left-handed), as if a coordinate had the wrong sign or two were \
                 exchanged, if the arms are numbered counter-clockwise"
                    .to_owned(),
                format!("export {samples} in a right-handed frame"),
            ];
        }
        let mirrored = handedness(order, signs) < 0.0;
        let hand = if mirrored {
            "the frame is mirrored (left-handed)"
        } else {
            "the frame is turned"
        };
        let of_sign = |wrong: bool| {
            let named = COORDINATES.iter().zip(signs);
            let named = named.filter(move |(_, sign)| (*sign < 0.0) == wrong);
            named
                .map(|(name, _)| (*name).to_owned())
                .collect::<Vec<_>>()
        };
        let (wrong, right) = (list(&of_sign(true)), of_sign(false));
        let cause = if order != UNCHANGED {
            format!(
                "the robot's x, y, z are {} of the positions, so {hand}",
                signed(order, signs)
            )
        } else if mirrored {
            let has = if right.len() == 2 { "has" } else { "have" };
            format!("{wrong} {has} the wrong sign, so {hand}")
        } else {
            let about = list(&right);
            let how = if about == "z" { "" } else { ", upside down" };
            format!(
                "{wrong} have the wrong sign, so the frame is turned by half a turn about {about}{how}"
            )
        };
        let remedy = format!(
            "state the positions of {samples} in the robot's frame: x, y, z are its {}",
            signed(order, signs)
        );
        [cause, remedy]
    }

    fn length(&self, unit: &LengthUnit) -> [String; 2] {
        let (robot, samples) = (&self.robot.name, &self.readings.name);
        let says = if self.readings.positions_in == Some(Unit::Millimetre) {
            "millimetres"
        } else {
            "metres"
        };
        let positions = unit.positions.map(|name| {
            let remedy = match name {
                "metres" => format!("name the columns of {samples} x_m,y_m,z_m"),
                "millimetres" => format!("name the columns of {samples} x_mm,y_mm,z_mm"),
                _ => format!("convert the positions of {samples} to millimetres"),
            };
            let cause = format!("the positions are {name}, and the header says {says}");
            [cause, remedy]
        });
        let lengths = unit.robot.map(|name| {
            [
                format!("the lengths in {robot} are {name} and not millimetres"),
                format!("convert the lengths in {robot} to millimetres"),
            ]
        });
        let mut both = [positions, lengths];
        if self.is_in_metres() {
            both.reverse();
        }
        let both: Vec<_> = both.into_iter().flatten().collect();
        joined(&both, [", or "; 2])
    }

    fn angle_unit(&self) -> &'static str {
        if self.readings.in_degrees { "_deg" } else { "" }
    }

    /// Names of the columns: "q2_deg and q3_deg".
    fn joints(&self, columns: [bool; 3]) -> String {
        let names: Vec<_> = (1..)
            .zip(columns)
            .filter(|(_, named)| *named)
            .map(|(joint, _)| format!("q{joint}{}", self.angle_unit()))
            .collect();
        list(&names)
    }
}

/// Causes, and remedies, as one each.
fn joined(words: &[[String; 2]], between: [&str; 2]) -> [String; 2] {
    [0, 1].map(|place| {
        let all: Vec<_> = words.iter().map(|own| own[place].as_str()).collect();
        all.join(between[place])
    })
}

/// Signed axes: "−y, x, z".
fn signed(order: [usize; 3], signs: [f64; 3]) -> String {
    let named = order.iter().zip(signs).map(|(axis, sign)| {
        let minus = if sign < 0.0 { "−" } else { "" };
        format!("{minus}{}", COORDINATES[*axis])
    });
    named.collect::<Vec<_>>().join(", ")
}
