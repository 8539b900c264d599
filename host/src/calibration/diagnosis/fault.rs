//! Faults of a samples file as a whole: how to undo them, and how to describe them.

use crate::files::samples_file::{PositionUnit, Readings};
use crate::fit::Frame;
use crate::text::list;
use delta_cal::{Robot, Sample};
use std::f64::consts::PI;

/// A fault of a whole file. Columns, joints, arms and axes are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fault {
    /// Joint k's angle is in column `order[k]`. Equivalent to arms in another order.
    Order([usize; 3]),
    /// Columns of joint angles with the wrong sign.
    Reversed([bool; 3]),
    /// Columns of joint angles in another unit, and that unit.
    Angles([bool; 3], AngleUnit),
    /// Coordinate k of the robot's frame is `signs[k]` times the file's coordinate `order[k]`.
    Axes {
        /// The file's coordinates.
        order: [usize; 3],
        /// 1 or −1.
        signs: [f64; 3],
    },
    /// The positions are in another unit.
    Length(LengthUnit),
    /// The robot file has the upper arms and forearms of these two arms exchanged.
    Arms(usize, usize),
    /// The joint limits have the wrong sign.
    Limits,
    /// Each position is one row below, or above, the joints that it belongs to.
    Shifted {
        /// Below rather than above.
        below: bool,
    },
    /// The positions are in a frame at an unknown place.
    Elsewhere,
}

/// Unit of the joint angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AngleUnit {
    /// Radians where the header says degrees.
    Radians,
    /// Degrees where the header says radians.
    Degrees,
}

/// Unit of the positions, or of the robot's lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LengthUnit {
    /// Factor for the positions.
    pub(super) factor: f64,
    /// The positions' unit under this hypothesis; `None` if the robot file is wrong.
    pub(super) positions: Option<&'static str>,
    /// The unit of the robot file's lengths under this hypothesis.
    pub(super) robot: Option<&'static str>,
}

/// Exchanges of two arms; clockwise numbering first.
const EXCHANGED: [[usize; 3]; 3] = [[0, 2, 1], [1, 0, 2], [2, 1, 0]];
const CYCLIC: [[usize; 3]; 2] = [[1, 2, 0], [2, 0, 1]];
const UNCHANGED: [usize; 3] = [0, 1, 2];
/// In a frame at an unknown place, all mirrored axes are equivalent.
pub(super) const MIRRORED: Fault = Fault::Axes {
    order: UNCHANGED,
    signs: [1.0, -1.0, 1.0],
};

/// For positions whose header says millimetres, or for a robot file that does.
const MILLIMETRES: [LengthUnit; 5] = [
    unit(1e3, Some("metres"), None),
    unit(25.4, Some("inches"), None),
    unit(10.0, Some("centimetres"), None),
    unit(1e-3, Some("micrometres"), Some("metres")),
    unit(1.0 / 25.4, None, Some("inches")),
];
/// For positions whose header says metres.
const METRES: [LengthUnit; 3] = [
    unit(1e-3, Some("millimetres"), Some("metres")),
    unit(0.0254, Some("inches"), None),
    unit(0.01, Some("centimetres"), None),
];

const fn unit(
    factor: f64,
    positions: Option<&'static str>,
    robot: Option<&'static str>,
) -> LengthUnit {
    LengthUnit {
        factor,
        positions,
        robot,
    }
}

/// All non-empty subsets of the three.
fn subsets() -> impl Iterator<Item = [bool; 3]> {
    (1_usize..8).map(|bits| [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0])
}

/// 1 for a rotation, −1 for a mirrored frame.
pub(super) fn handedness(order: [usize; 3], signs: [f64; 3]) -> f64 {
    let parity = if EXCHANGED.contains(&order) {
        -1.0
    } else {
        1.0
    };
    parity * signs.iter().product::<f64>()
}

fn axes() -> impl Iterator<Item = Fault> {
    [UNCHANGED]
        .into_iter()
        .chain(EXCHANGED)
        .chain(CYCLIC)
        .flat_map(|order| {
            [[false; 3]]
                .into_iter()
                .chain(subsets())
                .filter_map(move |reversed| {
                    let signs = reversed.map(|reversed| if reversed { -1.0 } else { 1.0 });
                    let changed = order != UNCHANGED || reversed != [false; 3];
                    changed.then_some(Fault::Axes { order, signs })
                })
        })
}

/// Every fault tested, kind by kind. The sensor's frame is found anyway, so its rotations are no faults, nor are cyclic
/// exchanges, which are rotations by a Delta's threefold symmetry.
pub(super) fn faults(frame: Frame, positions_in: PositionUnit) -> Vec<Vec<Fault>> {
    let mut orders: Vec<_> = EXCHANGED.map(Fault::Order).to_vec();
    let reversed = subsets().map(Fault::Reversed).collect();
    let angles = [AngleUnit::Radians, AngleUnit::Degrees]
        .into_iter()
        .flat_map(|unit| subsets().map(move |columns| Fault::Angles(columns, unit)))
        .collect();
    let lengths = match positions_in {
        PositionUnit::Millimetre => MILLIMETRES.map(Fault::Length).to_vec(),
        PositionUnit::Metre => METRES.map(Fault::Length).to_vec(),
        PositionUnit::Other => Vec::new(),
    };
    let arms = vec![Fault::Arms(0, 1), Fault::Arms(0, 2), Fault::Arms(1, 2)];
    let (axes, elsewhere) = match frame {
        Frame::Base => {
            orders.extend(CYCLIC.map(Fault::Order));
            (axes().collect(), vec![Fault::Elsewhere])
        }
        Frame::Sensor => (vec![MIRRORED], Vec::new()),
    };
    let shifted = [true, false].map(|below| Fault::Shifted { below }).to_vec();
    let limits = vec![Fault::Limits];
    vec![
        orders, reversed, angles, axes, lengths, arms, shifted, limits, elsewhere,
    ]
}

/// Whether two faults are more than the second alone: a frame at an unknown place includes rotations, and a cyclic
/// exchange of the joints is one.
pub(super) fn are_two(first: &Fault, second: &Fault) -> bool {
    *second != Fault::Elsewhere
        || match first {
            Fault::Axes { .. } => *first == MIRRORED,
            Fault::Order(order) => EXCHANGED.contains(order),
            _ => true,
        }
}

/// The samples, with positions moved to the joints that they belong to.
pub(super) fn shifted(
    samples: &[Sample<f64>],
    faults: &[Fault],
) -> impl Iterator<Item = Sample<f64>> {
    let by = faults.iter().find_map(|fault| match fault {
        Fault::Shifted { below } => Some(*below),
        _ => None,
    });
    let (joints, positions) = match by {
        None => (samples, samples),
        Some(true) => (samples, samples.get(1..).unwrap_or_default()),
        Some(false) => (samples.get(1..).unwrap_or_default(), samples),
    };
    joints.iter().zip(positions).map(|(one, other)| Sample {
        joints: one.joints,
        position: other.position,
    })
}

/// The samples and the robot with these faults undone.
pub(super) fn undone(
    faults: &[Fault],
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
) -> Option<(Robot<f64>, Vec<Sample<f64>>)> {
    let mut robot = *robot;
    for fault in faults {
        if let Fault::Arms(first, second) = fault {
            robot = with_arms_exchanged(&robot, *first, *second)?;
        }
    }
    let undo = |sample: &Sample<f64>| {
        let mut sample = *sample;
        // Signs and units refer to the file's columns, before these are reordered.
        for in_order in [false, true] {
            for fault in faults {
                if matches!(fault, Fault::Order(_)) == in_order {
                    fault.undo(&mut sample);
                }
            }
        }
        sample
    };
    Some((robot, samples.iter().map(undo).collect()))
}

impl Fault {
    fn undo(&self, sample: &mut Sample<f64>) {
        match self {
            Self::Order(order) => {
                let file = sample.joints;
                sample.joints = order.map(|column| file[column]);
            }
            Self::Reversed(reversed) => {
                for (q, reversed) in sample.joints.iter_mut().zip(reversed) {
                    if *reversed {
                        *q = -*q;
                    }
                }
            }
            Self::Angles(columns, unit) => {
                let factor = match unit {
                    AngleUnit::Radians => 180.0 / PI,
                    AngleUnit::Degrees => PI / 180.0,
                };
                for (q, other) in sample.joints.iter_mut().zip(columns) {
                    if *other {
                        *q *= factor;
                    }
                }
            }
            Self::Axes { order, signs } => {
                let file = sample.position;
                for (k, (axis, sign)) in order.iter().zip(signs).enumerate() {
                    sample.position[k] = sign * file[*axis];
                }
            }
            Self::Length(unit) => sample.position *= unit.factor,
            Self::Arms(..) | Self::Limits | Self::Shifted { .. } | Self::Elsewhere => {}
        }
    }
}

/// Exchanges La_x, La_y and Lb (scale and Lb of linear drives); D, θ and α belong to the base and stay.
fn with_arms_exchanged(robot: &Robot<f64>, first: usize, second: usize) -> Option<Robot<f64>> {
    let arms = robot.arms();
    let mut parameters = arms.map(|arm| arm.parameters());
    let [one, other] = parameters.get_disjoint_mut([first, second]).ok()?;
    one[5..].swap_with_slice(&mut other[5..]);
    robot.with_parameters(parameters).ok()
}

const COORDINATES: [&str; 3] = ["x", "y", "z"];

/// The files and the frame for the messages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Words<'a> {
    pub(super) robot: &'a str,
    pub(super) samples: &'a Readings,
    pub(super) frame: Frame,
    /// Whether the robot is too small for its lengths to be millimetres.
    pub(super) robot_in_metres: bool,
}

impl Words<'_> {
    /// The fault, "the columns q2_deg and q3_deg are exchanged", and the remedy.
    pub(super) fn of(&self, fault: &Fault) -> [String; 2] {
        let (robot, samples) = (self.robot, &self.samples.name);
        match fault {
            Fault::Order(order) => self.order(*order),
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
            Fault::Angles(columns, unit) => self.angles(*columns, *unit),
            Fault::Axes { order, signs } => self.axes(*order, *signs),
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
    pub(super) fn upwards(&self, faults: &[Fault]) -> Option<[String; 2]> {
        let (robot, samples) = (self.robot, &self.samples.name);
        let both = faults.contains(&Fault::Limits) && faults.contains(&Fault::Reversed([true; 3]));
        both.then(|| {
            [
                format!("all joints count upwards in {samples} and in [joints] of {robot}"),
                format!("state joint_positive = \"up\" in [convention] of {robot}"),
            ]
        })
    }

    fn order(&self, order: [usize; 3]) -> [String; 2] {
        let (robot, samples) = (self.robot, &self.samples.name);
        let column = |joint: usize| format!("q{}{}", joint + 1, self.angle_unit());
        let clockwise = self.frame == Frame::Sensor && order == EXCHANGED[0];
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

    fn angles(&self, columns: [bool; 3], unit: AngleUnit) -> [String; 2] {
        let samples = &self.samples.name;
        let (are, says, named) = match unit {
            AngleUnit::Radians => ("radians", "degrees", "q1_rad,q2_rad,q3_rad"),
            AngleUnit::Degrees => ("degrees", "radians", "q1_deg,q2_deg,q3_deg"),
        };
        let header = if self.samples.in_degrees == (unit == AngleUnit::Radians) {
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

    fn axes(&self, order: [usize; 3], signs: [f64; 3]) -> [String; 2] {
        let samples = &self.samples.name;
        if self.frame == Frame::Sensor {
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
        let (robot, samples) = (self.robot, &self.samples.name);
        let says = if self.samples.positions_in == PositionUnit::Millimetre {
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
        if self.robot_in_metres {
            both.reverse();
        }
        let both: Vec<_> = both.into_iter().flatten().collect();
        [0, 1].map(|place| {
            both.iter()
                .map(|own| own[place].as_str())
                .collect::<Vec<_>>()
                .join(", or ")
        })
    }

    fn angle_unit(&self) -> &'static str {
        if self.samples.in_degrees { "_deg" } else { "" }
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

/// Signed axes: "−y, x, z".
fn signed(order: [usize; 3], signs: [f64; 3]) -> String {
    let named = order.iter().zip(signs).map(|(axis, sign)| {
        let minus = if sign < 0.0 { "−" } else { "" };
        format!("{minus}{}", COORDINATES[*axis])
    });
    named.collect::<Vec<_>>().join(", ")
}
