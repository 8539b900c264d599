//! Faults in sentences.

use super::hypothesis::{AngleUnit, Fault, LengthUnit, handedness};
use crate::files::samples_file::{PositionUnit, Readings};
use crate::fit::options::Frame;
use crate::text::words::list;

const COORDINATES: [&str; 3] = ["x", "y", "z"];

/// The files and the frame that the sentences speak of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Words<'a> {
    pub(super) robot: &'a str,
    pub(super) samples: &'a Readings,
    pub(super) frame: Frame,
    /// Whether the robot is too small for its lengths to be millimetres.
    pub(super) robot_in_metres: bool,
}

impl Words<'_> {
    /// What is wrong: "the columns q2_deg and q3_deg are exchanged".
    pub(super) fn cause(&self, fault: &Fault) -> String {
        match fault {
            Fault::Order(order) => self.order(*order),
            Fault::Reversed([true, true, true]) => {
                "all joint angles have the wrong sign".to_owned()
            }
            Fault::Reversed(reversed) => {
                format!(
                    "the sign of the joint angles in {} is wrong",
                    self.joints(*reversed)
                )
            }
            Fault::Angles(columns, unit) => {
                let (are, says) = match unit {
                    AngleUnit::Radians => ("radians", "degrees"),
                    AngleUnit::Degrees => ("degrees", "radians"),
                };
                let header = if self.samples.in_degrees == (*unit == AngleUnit::Radians) {
                    format!(", and the header says {says}")
                } else {
                    String::new()
                };
                format!(
                    "the joint angles in {} are {are}{header}",
                    self.joints(*columns)
                )
            }
            Fault::Axes { order, signs } => self.axes(*order, *signs),
            Fault::Length(unit) => self.length(unit),
            Fault::Arms(first, second) => format!(
                "in {} the upper arms and forearms of arm {} and arm {} are exchanged",
                self.robot,
                first + 1,
                second + 1
            ),
            Fault::Elsewhere => "the positions are in another frame than the robot's".to_owned(),
        }
    }

    /// What to do about it.
    pub(super) fn remedy(&self, fault: &Fault) -> String {
        let samples = &self.samples.name;
        match fault {
            Fault::Order(order) => {
                let unit = self.angle_unit();
                let mut joints = [0; 3];
                for (joint, column) in order.iter().enumerate() {
                    joints[*column] = joint;
                }
                let header = |joints: [usize; 3]| {
                    joints
                        .map(|joint| format!("q{}{unit}", joint + 1))
                        .join(",")
                };
                format!(
                    "change {} in the header of {samples} to {}, or number the arms of {} as the \
                     columns are",
                    header([0, 1, 2]),
                    header(joints),
                    self.robot
                )
            }
            Fault::Reversed(reversed) => format!(
                "change the sign of {} in {samples} (a positive angle swings the arm towards the \
                 platform)",
                self.joints(*reversed)
            ),
            Fault::Angles([true, true, true], AngleUnit::Radians) => {
                format!("name the columns of {samples} q1_rad,q2_rad,q3_rad")
            }
            Fault::Angles([true, true, true], AngleUnit::Degrees) => {
                format!("name the columns of {samples} q1_deg,q2_deg,q3_deg")
            }
            Fault::Angles(..) => {
                format!("correct the unit (_deg or _rad) in the header of {samples}")
            }
            Fault::Axes { .. } if self.frame == Frame::Sensor => {
                format!("export {samples} in a right-handed frame")
            }
            Fault::Axes { order, signs } => format!(
                "state the positions of {samples} in the robot's frame: x, y, z are its {}",
                signed(*order, *signs)
            ),
            Fault::Length(unit) => self.remedy_of_length(unit),
            Fault::Arms(..) => format!(
                "exchange la_x_mm, la_y_mm and lb_mm of the two in {}",
                self.robot
            ),
            Fault::Elsewhere => "use --frame sensor".to_owned(),
        }
    }

    fn order(&self, order: [usize; 3]) -> String {
        let moved: Vec<_> = (0..3).filter(|joint| order[*joint] != *joint).collect();
        if let [first, second] = moved[..] {
            let arms = format!("arm {} and arm {}", first + 1, second + 1);
            return format!(
                "{}, or {arms}, are exchanged",
                self.joints([0, 1, 2].map(|column| moved.contains(&column)))
            );
        }
        let columns = order.map(|column| format!("q{}{}", column + 1, self.angle_unit()));
        format!(
            "the joint columns are exchanged in turn (joints 1, 2, 3 are in {}), or the frame is turned \
             by 120° about z",
            list(&columns)
        )
    }

    fn axes(&self, order: [usize; 3], signs: [f64; 3]) -> String {
        let mirrored = handedness(order, signs) < 0.0;
        if self.frame == Frame::Sensor {
            return "the sensor's frame is mirrored (left-handed), as if a coordinate had the wrong \
                    sign or two were exchanged"
                .to_owned();
        }
        let hand = if mirrored {
            "the frame is mirrored (left-handed)"
        } else {
            "the frame is turned"
        };
        if order == [0, 1, 2] {
            let wrong: Vec<_> = COORDINATES
                .iter()
                .zip(signs)
                .filter(|(_, sign)| *sign < 0.0)
                .map(|(name, _)| (*name).to_owned())
                .collect();
            let (has, upside_down) = if wrong.len() == 1 {
                ("has", "")
            } else {
                ("have", "upside down")
            };
            if !mirrored {
                let about = COORDINATES
                    .iter()
                    .zip(signs)
                    .find(|(_, sign)| *sign > 0.0)
                    .map_or("", |(name, _)| name);
                let how = if about == "z" {
                    String::new()
                } else {
                    format!(", {upside_down}")
                };
                return format!(
                    "{} have the wrong sign, so the frame is turned by half a turn about {about}{how}",
                    list(&wrong)
                );
            }
            return format!("{} {has} the wrong sign, so {hand}", list(&wrong));
        }
        format!(
            "the robot's x, y, z are {} of the positions, so {hand}",
            signed(order, signs)
        )
    }

    fn length(&self, unit: &LengthUnit) -> String {
        let says = if self.samples.positions_in == PositionUnit::Millimetre {
            "millimetres"
        } else {
            "metres"
        };
        let positions = unit
            .positions
            .map(|name| format!("the positions are {name}, and the header says {says}"));
        let robot = unit.robot.map(|name| {
            format!(
                "the lengths in {} are {name} and not millimetres",
                self.robot
            )
        });
        self.likelier_first([positions, robot])
    }

    fn likelier_first(&self, mut both: [Option<String>; 2]) -> String {
        if self.robot_in_metres {
            both.reverse();
        }
        let both: Vec<_> = both.into_iter().flatten().collect();
        both.join(", or ")
    }

    fn remedy_of_length(&self, unit: &LengthUnit) -> String {
        let positions = unit.positions.map(|name| match name {
            "metres" => format!("name the columns of {} x_m,y_m,z_m", self.samples.name),
            "millimetres" => format!("name the columns of {} x_mm,y_mm,z_mm", self.samples.name),
            _ => format!(
                "convert the positions of {} to millimetres",
                self.samples.name
            ),
        });
        let robot = unit
            .robot
            .map(|_| format!("convert the lengths in {} to millimetres", self.robot));
        self.likelier_first([positions, robot])
    }

    fn angle_unit(&self) -> &'static str {
        if self.samples.in_degrees { "_deg" } else { "" }
    }

    /// "q2_deg and q3_deg".
    fn joints(&self, columns: [bool; 3]) -> String {
        let names: Vec<_> = (1..)
            .zip(columns)
            .filter(|(_, named)| *named)
            .map(|(joint, _)| format!("q{joint}{}", self.angle_unit()))
            .collect();
        list(&names)
    }
}

/// "−y, x, z".
fn signed(order: [usize; 3], signs: [f64; 3]) -> String {
    let named = order.iter().zip(signs).map(|(axis, sign)| {
        let minus = if sign < 0.0 { "−" } else { "" };
        format!("{minus}{}", COORDINATES[*axis])
    });
    named.collect::<Vec<_>>().join(", ")
}
