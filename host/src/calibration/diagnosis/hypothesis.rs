//! What can be wrong with a file of samples as a whole, and how the samples would read without it.

use crate::files::samples_file::PositionUnit;
use crate::fit::options::Frame;
use delta_cal::{Robot, Sample};
use std::f64::consts::PI;

/// One fault of a whole file. Columns, joints, arms and axes are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fault {
    /// Joint k's angle stands in column `order[k]`. The same as arms in another order.
    Order([usize; 3]),
    /// The columns of joint angles whose sign is wrong.
    Reversed([bool; 3]),
    /// The columns of joint angles that are in another unit, and what they are to be multiplied by.
    Angles([bool; 3], AngleUnit),
    /// Coordinate k of the robot's frame is `signs[k]` times the file's coordinate `order[k]`.
    Axes {
        /// Which of the file's coordinates.
        order: [usize; 3],
        /// 1 or −1.
        signs: [f64; 3],
    },
    /// The positions are in another unit.
    Length(LengthUnit),
    /// In the robot file the upper arms and forearms of these two arms are exchanged.
    Arms(usize, usize),
    /// The positions are in a frame that stands anywhere.
    Elsewhere,
}

/// What the joint angles are in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AngleUnit {
    /// Radians where the header says degrees.
    Radians,
    /// Degrees where the header says radians.
    Degrees,
}

/// What the positions, or the lengths of the robot, are in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LengthUnit {
    /// What the positions are to be multiplied by.
    pub(super) factor: f64,
    /// What the positions then are in; `None` if it is the robot file that is wrong.
    pub(super) positions: Option<&'static str>,
    /// What the lengths of the robot file are then in.
    pub(super) robot: Option<&'static str>,
}

const EXCHANGED: [[usize; 3]; 3] = [[1, 0, 2], [2, 1, 0], [0, 2, 1]];
const CYCLIC: [[usize; 3]; 2] = [[1, 2, 0], [2, 0, 1]];
const UNCHANGED: [usize; 3] = [0, 1, 2];
/// Of a frame that stands anywhere all mirrored ones are the same.
pub(super) const MIRRORED: Fault = Fault::Axes {
    order: UNCHANGED,
    signs: [1.0, -1.0, 1.0],
};

/// Positions whose header says millimetres, or whose robot file does.
const MILLIMETRES: [LengthUnit; 5] = [
    unit(1e3, Some("metres"), None),
    unit(25.4, Some("inches"), None),
    unit(10.0, Some("centimetres"), None),
    unit(1e-3, Some("micrometres"), Some("metres")),
    unit(1.0 / 25.4, None, Some("inches")),
];
/// Positions whose header says metres.
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

/// Every set of some of the three.
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

/// Every fault that is looked for, kind by kind. In the sensor's frame, which is found, rotations
/// of it are none, nor is a cyclic exchange, which a Delta's threefold symmetry makes one.
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
    vec![orders, reversed, angles, axes, lengths, arms, elsewhere]
}

/// Whether two faults are more than the second alone: a frame that stands anywhere may be turned as
/// well, and a cyclic exchange of the joints turns it.
pub(super) fn are_two(first: &Fault, second: &Fault) -> bool {
    *second != Fault::Elsewhere
        || match first {
            Fault::Axes { .. } => *first == MIRRORED,
            Fault::Order(order) => EXCHANGED.contains(order),
            _ => true,
        }
}

/// The samples and the robot as they would be without these faults.
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
        // Signs and units are those of the file's columns, before these are put in order.
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
            Self::Arms(..) | Self::Elsewhere => {}
        }
    }

    /// Whether it changes what the joint angles are.
    pub(super) const fn is_of_joints(&self) -> bool {
        matches!(self, Self::Order(_) | Self::Reversed(_) | Self::Angles(..))
    }
}

/// La_x, La_y and Lb exchanged (scale and Lb of linear drives); D, θ and α stay where the robot's base has
/// them.
fn with_arms_exchanged(robot: &Robot<f64>, first: usize, second: usize) -> Option<Robot<f64>> {
    let arms = robot.arms();
    let mut parameters = arms.map(|arm| arm.parameters());
    let [one, other] = parameters.get_disjoint_mut([first, second]).ok()?;
    one[5..].swap_with_slice(&mut other[5..]);
    robot.with_parameters(parameters).ok()
}
