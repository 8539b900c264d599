//! A controller's sign and axis conventions. Internally a positive joint angle swings the arm downwards and z points
//! upwards; everything read or written follows the convention of its robot file.

use super::columns::{Quantity, Unit};
use crate::geometry::Limit;
use crate::text::{degrees, list, rounded};
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
    pub joint_unit: Option<JointUnit>,
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

/// The unit of joint angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointUnit {
    /// Degrees.
    Degree,
    /// Radians.
    Radian,
    /// Encoder counts per degree of each joint, negative for a joint that counts backwards.
    Counts([f64; 3]),
}

impl Vertical {
    /// Values in a robot file.
    pub(super) const WORDS: [(&str, Self); 2] = [("up", Self::Up), ("down", Self::Down)];
}

impl JointUnit {
    /// Values in a robot file; counts per degree are stated separately.
    pub(super) const WORDS: [(&str, Self); 3] = [
        ("deg", Self::Degree),
        ("rad", Self::Radian),
        ("counts", Self::Counts([1.0; 3])),
    ];
}

/// Length units in a robot file.
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
            length_unit: None,
        }
    }

    /// Whether this is the default.
    pub fn is_usual(&self) -> bool {
        *self == Self::usual(self.drive)
    }

    /// 1, or −1 where the controller's joints count upwards.
    fn sense(&self) -> f64 {
        match (self.drive, self.joint_positive) {
            (Drive::Rotary, Vertical::Up) => -1.0,
            _ => 1.0,
        }
    }

    /// Signs that convert the file's axes to the internal ones, and back.
    fn axes(&self) -> [f64; 3] {
        match self.z_axis {
            Vertical::Up => [1.0, 1.0, 1.0],
            Vertical::Down => [1.0, -1.0, -1.0],
        }
    }

    /// The unit of a quantity whose column states none.
    pub(crate) fn unit_of(&self, quantity: Quantity) -> Unit {
        if quantity.joint().is_some() && self.drive == Drive::Rotary {
            return match self.joint_unit {
                Some(JointUnit::Radian) => Unit::Radian,
                Some(JointUnit::Counts(_)) => Unit::Count,
                Some(JointUnit::Degree) | None => Unit::Degree,
            };
        }
        match (quantity.usual_unit(), self.length_unit) {
            (Unit::Millimetre, Some(unit)) => unit,
            (usual, _) => usual,
        }
    }

    /// Whether `[convention]` states the unit of this quantity.
    pub(crate) fn states_unit_of(&self, quantity: Quantity) -> bool {
        if quantity.is_angle() {
            self.joint_unit.is_some()
        } else {
            self.length_unit.is_some()
        }
    }

    /// Converts a cell to internal units (radians or mm), axes and signs. `None` for counts of unknown size.
    pub(crate) fn inwards(&self, quantity: Quantity, unit: Unit, value: f64) -> Option<f64> {
        if let Some(axis) = quantity.axis() {
            return Some(self.axes()[axis] * unit.to_internal(value));
        }
        let Some(joint) = quantity.joint().filter(|_| quantity.is_angle()) else {
            return Some(unit.to_internal(value));
        };
        let angle = match (unit, self.joint_unit) {
            (Unit::Count, Some(JointUnit::Counts(per_degree))) => {
                (value / per_degree[joint]).to_radians()
            }
            (Unit::Count, _) => return None,
            _ => unit.to_internal(value),
        };
        Some(self.sense() * angle)
    }

    /// Converts joint angles (radians) or travels (mm) to the file's unit and direction.
    pub fn joints(&self, joints: &[f64; 3]) -> [f64; 3] {
        let travel = self.unit_of(Quantity::X);
        let mut written = *joints;
        for (index, joint) in written.iter_mut().enumerate() {
            *joint = match (self.drive, self.joint_unit) {
                (Drive::Linear, _) => travel.outwards(*joint),
                (Drive::Rotary, Some(JointUnit::Radian)) => self.sense() * *joint,
                (Drive::Rotary, Some(JointUnit::Counts(per_degree))) => {
                    self.degrees(*joint) * per_degree[index]
                }
                (Drive::Rotary, _) => self.degrees(*joint),
            };
        }
        written
    }

    /// Converts a joint angle (radians) to degrees in the file's direction; a travel stays in mm.
    pub fn degrees(&self, joint: f64) -> f64 {
        match self.drive {
            Drive::Linear => joint,
            Drive::Rotary => self.sense() * degrees(joint),
        }
    }

    /// Converts lower and upper joint limits (radians or mm) to the file's direction, and back.
    pub(crate) fn limits(&self, low: f64, high: f64) -> (f64, f64) {
        if self.sense() < 0.0 {
            (-high, -low)
        } else {
            (low, high)
        }
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
        let mut turned = ranges;
        for ((range, (low, high)), sense) in turned.iter_mut().zip(ranges).zip(self.axes()) {
            if sense < 0.0 {
                *range = (-high, -low);
            }
        }
        turned
    }

    /// Converts a rotation between two frames from internal axes to those of the file, and back.
    pub fn rotation(&self, rotation: &Matrix3<f64>) -> Matrix3<f64> {
        let axes = Matrix3::from_diagonal(&Vector3::from(self.axes()));
        axes * rotation * axes
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

    /// Joints and position as one row, rounded to 9 decimals.
    pub(crate) fn row(&self, joints: &[f64; 3], position: &Vector3<f64>) -> String {
        let cells = self
            .joints(joints)
            .into_iter()
            .chain(self.position(position));
        cells.map(rounded).collect::<Vec<_>>().join(",")
    }

    /// Column headings: "q1, deg".
    pub(crate) fn joint_names(&self) -> [String; 3] {
        self.joint_columns().map(|own| own.replacen('_', ", ", 1))
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
        match self.joint_unit {
            Some(JointUnit::Radian) => parts.push("joints in radians".to_owned()),
            Some(JointUnit::Counts(per_degree)) => {
                let counts = list(&per_degree.map(rounded));
                parts.push(format!("joints in counts, {counts} a degree"));
            }
            Some(JointUnit::Degree) | None => {}
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
