//! Faults of a samples file as a whole, and how to undo them.

use crate::files::columns::Unit;
use crate::fit::Frame;
use delta_cal::{Robot, Sample};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// A fault of a whole file. Columns, joints, arms and axes are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fault {
    /// Joint k's angle is in column `order[k]`. Equivalent to arms in another order.
    Order([usize; 3]),
    /// Columns of joint angles with the wrong sign.
    Reversed([bool; 3]),
    /// Columns of joint angles in another unit: in radians where the header says degrees, if true, or the other way.
    Angles([bool; 3], bool),
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
pub(super) const EXCHANGED: [[usize; 3]; 3] = [[0, 2, 1], [1, 0, 2], [2, 1, 0]];
const CYCLIC: [[usize; 3]; 2] = [[1, 2, 0], [2, 0, 1]];
pub(super) const UNCHANGED: [usize; 3] = [0, 1, 2];
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
    let orders = [UNCHANGED].into_iter().chain(EXCHANGED).chain(CYCLIC);
    let all = orders.flat_map(|order| {
        let signs = [[false; 3]].into_iter().chain(subsets());
        let signs = signs.map(|reversed| reversed.map(|own| if own { -1.0 } else { 1.0 }));
        signs.map(move |signs| (order, signs))
    });
    // The first is no change.
    all.skip(1)
        .map(|(order, signs)| Fault::Axes { order, signs })
}

/// Every fault tested, kind by kind. The sensor's frame is found anyway, so its rotations are no faults, nor are cyclic
/// exchanges, which are rotations by a Delta's threefold symmetry.
pub(super) fn faults(frame: Frame, positions_in: Option<Unit>) -> Vec<Vec<Fault>> {
    let mut orders: Vec<_> = EXCHANGED.map(Fault::Order).to_vec();
    let reversed = subsets().map(Fault::Reversed).collect();
    let angles = [true, false].into_iter();
    let angles = angles
        .flat_map(|radians| subsets().map(move |columns| Fault::Angles(columns, radians)))
        .collect();
    let lengths = match positions_in {
        Some(Unit::Millimetre) => MILLIMETRES.map(Fault::Length).to_vec(),
        Some(Unit::Metre) => METRES.map(Fault::Length).to_vec(),
        _ => Vec::new(),
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
    let shifted = |below| faults.contains(&Fault::Shifted { below });
    let from = |shifted: bool| samples.get(usize::from(shifted)..).unwrap_or_default();
    let (joints, positions) = (from(shifted(false)), from(shifted(true)));
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
        let file = *sample;
        let scaled = |columns: &[bool; 3], factor: f64| {
            let factors = columns.map(|own| if own { factor } else { 1.0 });
            std::array::from_fn(|joint| factors[joint] * file.joints[joint])
        };
        match self {
            Self::Order(order) => sample.joints = order.map(|column| file.joints[column]),
            Self::Reversed(reversed) => sample.joints = scaled(reversed, -1.0),
            Self::Angles(columns, radians) => {
                let factor = if *radians { 180.0 / PI } else { PI / 180.0 };
                sample.joints = scaled(columns, factor);
            }
            Self::Axes { order, signs } => {
                sample.position =
                    Vector3::from_fn(|axis, _| signs[axis] * file.position[order[axis]]);
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
