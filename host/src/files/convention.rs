//! A controller's sign and axis conventions. Internally a positive joint angle swings the arm downwards and z points
//! upwards; everything read or written follows the convention of its robot file.

use super::columns::{ColumnName, Quantity, Unit};
use crate::geometry::Limit;
use crate::text::{degrees, list, rounded};
use delta_cal::Parameter;
use delta_cal::robot::Drive;
use nalgebra::{Matrix3, Vector3};
use std::fmt;

/// The `[convention]` section of a robot file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convention {
    /// The type of drive.
    pub drive: Drive,
    /// The direction in which a motor's joint reading increases.
    pub joint_positive: Vertical,
    /// The direction of the z axis. With z downwards, y is reversed as well, so that the axes stay right-handed.
    pub z_axis: Vertical,
    /// The unit of output joints, and of columns whose names state no unit; `None` if not stated.
    pub joint_unit: Option<Unit>,
    /// Encoder counts per degree of each joint, negative for a joint that counts backwards, if joints are in counts.
    pub counts_per_degree: Option<[f64; 3]>,
    /// The same for lengths.
    pub length_unit: Option<Unit>,
}

/// Up or down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vertical {
    /// Upwards.
    Up,
    /// Downwards.
    Down,
}

impl Vertical {
    /// Values in a robot file.
    pub(super) const WORDS: [(&str, Self); 2] = [("up", Self::Up), ("down", Self::Down)];
}

/// Joint units in a robot file; counts per degree are stated separately.
pub(super) const JOINT_UNITS: [(&str, Unit); 3] = [
    ("deg", Unit::Degree),
    ("rad", Unit::Radian),
    ("counts", Unit::Count),
];

pub(super) const LENGTH_UNITS: [(&str, Unit); 5] = [
    ("mm", Unit::Millimetre),
    ("cm", Unit::Centimetre),
    ("m", Unit::Metre),
    ("um", Unit::Micrometre),
    ("inch", Unit::Inch),
];

impl Convention {
    /// The default, used where a robot file states nothing.
    pub const fn usual(drive: Drive) -> Self {
        Self {
            drive,
            joint_positive: Vertical::Down,
            z_axis: Vertical::Up,
            joint_unit: None,
            counts_per_degree: None,
            length_unit: None,
        }
    }

    /// The same with z upwards.
    pub(crate) const fn upright(mut self) -> Self {
        self.z_axis = Vertical::Up;
        self
    }

    /// Whether this is the default.
    pub fn is_usual(&self) -> bool {
        *self == Self::usual(self.drive)
    }

    /// 1, or −1 where the controller's joints count upwards.
    pub fn sense(&self) -> f64 {
        match (self.drive, self.joint_positive) {
            (Drive::Rotary, Vertical::Up) => -1.0,
            _ => 1.0,
        }
    }

    /// Signs that convert the file's axes to the internal ones, and back.
    pub const fn axes(&self) -> [f64; 3] {
        match self.z_axis {
            Vertical::Up => [1.0, 1.0, 1.0],
            Vertical::Down => [1.0, -1.0, -1.0],
        }
    }

    pub(crate) fn stated_unit(&self, quantity: Quantity) -> Option<Unit> {
        match quantity.usual_unit() {
            Unit::Degree if quantity.joint().is_some() => self.joint_unit,
            Unit::Millimetre => self.length_unit,
            _ => None,
        }
    }

    /// The unit of a quantity whose column states none.
    pub(crate) fn unit_of(&self, quantity: Quantity) -> Unit {
        let stated = self.stated_unit(quantity);
        stated.unwrap_or(quantity.usual_unit())
    }

    /// Converts a cell to internal units (radians or mm), axes and signs. `None` for counts of unknown size.
    pub(crate) fn inwards(&self, quantity: Quantity, unit: Unit, value: f64) -> Option<f64> {
        if let Some(axis) = quantity.axis() {
            return Some(self.axes()[axis] * unit.to_internal(value));
        }
        let Some(joint) = quantity.joint().filter(|_| quantity.is_angle()) else {
            return Some(unit.to_internal(value));
        };
        let angle = match unit {
            Unit::Count => (value / self.counts_per_degree?[joint]).to_radians(),
            _ => unit.to_internal(value),
        };
        Some(self.sense() * angle)
    }

    /// Converts joint angles (radians) or travels (mm) to the file's unit and direction.
    pub fn joints(&self, joints: &[f64; 3]) -> [f64; 3] {
        let counts = self.counts_per_degree.unwrap_or([1.0; 3]);
        [0, 1, 2].map(|index| match (self.drive, self.joint_unit) {
            (Drive::Linear, _) => self.unit_of(Quantity::X).outwards(joints[index]),
            (Drive::Rotary, Some(Unit::Radian)) => self.sense() * joints[index],
            (Drive::Rotary, _) => self.degrees(joints[index]) * counts[index],
        })
    }

    /// Converts joint angles (radians) or travels (mm) to the file's direction, and back.
    pub fn directed(&self, joints: &[f64; 3]) -> [f64; 3] {
        joints.map(|own| self.sense() * own)
    }

    /// Converts a joint angle (radians) to degrees in the file's direction; a travel stays in mm.
    pub fn degrees(&self, joint: f64) -> f64 {
        match self.drive {
            Drive::Linear => joint,
            Drive::Rotary => self.sense() * degrees(joint),
        }
    }

    /// Converts lower and upper joint limits (radians or mm) to the file's direction, and back.
    pub fn limits(&self, low: f64, high: f64) -> (f64, f64) {
        turned(self.sense(), (low, high))
    }

    /// Converts a limit to the file's direction: where joints count upwards, minimum and maximum swap.
    pub(crate) fn limit(&self, limit: Limit) -> Limit {
        match limit {
            Limit::JointMinimum(arm) if self.sense() < 0.0 => Limit::JointMaximum(arm),
            Limit::JointMaximum(arm) if self.sense() < 0.0 => Limit::JointMinimum(arm),
            other => other,
        }
    }

    /// Converts a vector from internal axes to those of the file, and back.
    pub fn vector(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        vector.component_mul(&Vector3::from(self.axes()))
    }

    /// Converts a range along each axis from internal axes to those of the file, and back.
    pub(crate) fn ranges(&self, ranges: [(f64, f64); 3]) -> [(f64, f64); 3] {
        let axes = self.axes();
        [0, 1, 2].map(|axis| turned(axes[axis], ranges[axis]))
    }

    /// [`sign`](Self::sign) of each of the eight parameters of an arm, in their order.
    pub fn signs(&self) -> [f64; 8] {
        let mut signs = [1.0; 8];
        for parameter in self.drive.parameters() {
            signs[parameter.index()] = self.sign(*parameter);
        }
        signs
    }

    /// 1, or −1 for a parameter whose sign changes with the direction of z. In the stated axes the model's formulas hold
    /// with these signs and with [`sense`](Self::sense) of the joints.
    pub const fn sign(&self, parameter: Parameter) -> f64 {
        match (self.z_axis, parameter) {
            (
                Vertical::Down,
                Parameter::Dy
                | Parameter::Dz
                | Parameter::Zero
                | Parameter::Theta
                | Parameter::LaY
                | Parameter::LeanY,
            ) => -1.0,
            _ => 1.0,
        }
    }

    /// Converts a parameter (mm, radians or a ratio) to the file's axes, and back.
    pub fn parameter(&self, parameter: Parameter, value: f64) -> f64 {
        // Without −0.
        self.sign(parameter) * value + 0.0
    }

    /// Converts an azimuth about z or an angle above level, positive towards z, to the file's axes, and back.
    pub(crate) fn angle(&self, angle: f64) -> f64 {
        self.parameter(Parameter::Theta, angle)
    }

    /// Converts a height to the file's axes, and back.
    pub(crate) fn height(&self, height: f64) -> f64 {
        self.parameter(Parameter::Dz, height)
    }

    /// Converts the numbers of a transmission to the file's direction of joints, and back: cosines are even.
    pub fn transmission(&self, [gain, cos, sin, cos2, sin2]: [f64; 5]) -> [f64; 5] {
        let even = |value| self.sense() * value + 0.0;
        [gain, even(cos), sin, even(cos2), sin2]
    }

    /// Converts the numbers of an arm's rods to the file's axes, and back: with z downwards, t changes its direction.
    pub fn rods(&self, [rods, spacing, yaw, roll]: [f64; 4]) -> [f64; 4] {
        let turned = |own| self.angle(own);
        [turned(rods), spacing, turned(yaw), roll]
    }

    /// The rotation from internal axes to those of the file.
    pub(crate) fn turn(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::from(self.axes()))
    }

    /// Converts a rotation between two frames from internal axes to those of the file, and back.
    pub fn rotation(&self, rotation: &Matrix3<f64>) -> Matrix3<f64> {
        self.turn() * rotation * self.turn()
    }

    /// Converts an internal position (mm) to the file's unit and axes.
    pub fn position(&self, position: &Vector3<f64>) -> [f64; 3] {
        let unit = self.unit_of(Quantity::X);
        let [x, y, z] = self.vector(position).data.0[0];
        [x, y, z].map(|value| unit.outwards(value))
    }

    /// `q1_deg`, `q2_deg`, `q3_deg`.
    pub(crate) fn joint_columns(&self) -> [String; 3] {
        Quantity::joints(self.drive).map(|joint| self.column(joint))
    }

    /// The column name of a quantity in a header.
    pub(crate) fn column(&self, quantity: Quantity) -> String {
        quantity.column(self.unit_of(quantity))
    }

    /// `x_mm`, `y_mm`, `z_mm`.
    pub(crate) fn position_columns(&self) -> [String; 3] {
        Quantity::COORDINATES.map(|axis| self.column(axis))
    }

    /// Column headings: "q1, deg".
    pub(crate) fn joint_names(&self) -> [String; 3] {
        self.joint_columns().map(|own| own.replacen('_', ", ", 1))
    }
}

/// Three columns of a table, and how their numbers are converted.
#[derive(Debug, Clone, PartialEq)]
pub struct Three([(String, Quantity, Unit); 3]);

impl Three {
    /// The columns of the joints, if their names state their units.
    pub fn of_joints(drive: Drive, names: &[String]) -> Option<Self> {
        Self::of(Quantity::joints(drive), names)
    }

    /// The same of x, y and z.
    pub fn of_positions(names: &[String]) -> Option<Self> {
        Self::of(Quantity::COORDINATES, names)
    }

    fn of(wanted: [Quantity; 3], names: &[String]) -> Option<Self> {
        let column = |quantity| {
            let own = |name: &String| {
                let known = ColumnName::recognise(name)?;
                let unit = known.unit.filter(|_| known.quantity == quantity)?;
                Some((name.clone(), quantity, unit))
            };
            let mut found = names.iter().filter_map(own);
            found.next().filter(|_| found.next().is_none())
        };
        let [one, two, three] = wanted.map(column);
        Some(Self([one?, two?, three?]))
    }

    /// Their names.
    pub fn names(&self) -> [&str; 3] {
        self.0.each_ref().map(|(name, ..)| name.as_str())
    }

    /// A row in millimetres and radians, in the internal axes; `None` in counts of unknown size.
    pub fn inwards(&self, convention: &Convention, row: [f64; 3]) -> Option<[f64; 3]> {
        let own = |place: usize| {
            let (_, quantity, unit) = &self.0[place];
            convention.inwards(*quantity, *unit, row[place])
        };
        Some([own(0)?, own(1)?, own(2)?])
    }
}

/// A range after a change of direction, for which the sense is negative.
fn turned(sense: f64, (low, high): (f64, f64)) -> (f64, f64) {
    if sense < 0.0 {
        (-high, -low)
    } else {
        (low, high)
    }
}

/// "joints count upwards, z points downwards, joints in counts, lengths in inch".
impl fmt::Display for Convention {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if self.sense() < 0.0 {
            parts.push("joints count upwards".to_owned());
        }
        if self.z_axis == Vertical::Down {
            parts.push(
                "z points downwards, with y turned so that the axes stay right-handed".to_owned(),
            );
        }
        if self.joint_unit == Some(Unit::Radian) {
            parts.push("joints in radians".to_owned());
        }
        if let Some(per_degree) = self.counts_per_degree {
            let counts = list(&per_degree.map(rounded));
            parts.push(format!("joints in counts, {counts} a degree"));
        }
        if let Some(unit) = self.length_unit
            && unit != Unit::Millimetre
        {
            let columns = Quantity::X.column(unit);
            parts.push(format!("lengths as in {columns}"));
        }
        if parts.is_empty() {
            return formatter.write_str("joints count downwards in degrees, z points upwards");
        }
        formatter.write_str(&parts.join("; "))
    }
}
