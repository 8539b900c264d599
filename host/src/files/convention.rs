//! How a controller counts its joints and where its axes point. Inside, a positive joint angle swings the arm downwards and
//! z points upwards; everything that is read or written is in the convention of its robot file.

use super::columns::{Quantity, Unit};
use crate::geometry::Limit;
use crate::text::{degrees, list, rounded};
use delta_cal::robot::Drive;
use nalgebra::{Matrix3, Vector3};
use std::fmt;

/// `[convention]` of a robot file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convention {
    /// What drives the joints.
    pub drive: Drive,
    /// The direction in which a motor's joint counts.
    pub joint_positive: Vertical,
    /// The direction of the z axis. With z downwards y is opposite as well, so that the axes stay right-handed.
    pub z_axis: Vertical,
    /// The unit of the joints where a column names none, and of what is written; `None` if not stated.
    pub joint_unit: Option<JointUnit>,
    /// The same of lengths.
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
    /// Encoder counts: how many a degree of each joint; a joint that counts backwards has a negative number.
    Counts([f64; 3]),
}

impl Vertical {
    /// As a robot file states them.
    pub(super) const WORDS: [(&str, Self); 2] = [("up", Self::Up), ("down", Self::Down)];
}

impl JointUnit {
    /// As a robot file states them; how many counts a degree has is stated beside.
    pub(super) const WORDS: [(&str, Self); 3] = [
        ("deg", Self::Degree),
        ("rad", Self::Radian),
        ("counts", Self::Counts([1.0; 3])),
    ];
}

/// The units of lengths, as a robot file states them.
pub(super) const LENGTH_UNITS: [(&str, Unit); 5] = [
    ("mm", Unit::Millimetre),
    ("cm", Unit::Centimetre),
    ("m", Unit::Metre),
    ("um", Unit::Micrometre),
    ("inch", Unit::Inch),
];

impl Convention {
    /// What holds where a robot file states nothing.
    pub const fn usual(drive: Drive) -> Self {
        Self {
            drive,
            joint_positive: Vertical::Down,
            z_axis: Vertical::Up,
            joint_unit: None,
            length_unit: None,
        }
    }

    /// Whether it says nothing else than usual.
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

    /// The directions of the axes: from the file's to those inside, and back.
    fn axes(&self) -> [f64; 3] {
        match self.z_axis {
            Vertical::Up => [1.0, 1.0, 1.0],
            Vertical::Down => [1.0, -1.0, -1.0],
        }
    }

    /// The unit of a quantity whose column names none.
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

    /// Whether `[convention]` states that unit.
    pub(crate) fn states_unit_of(&self, quantity: Quantity) -> bool {
        if quantity.is_angle() {
            self.joint_unit.is_some()
        } else {
            self.length_unit.is_some()
        }
    }

    /// A cell of a table: radians or mm, in the axes and directions inside. `None` for counts whose size is not stated.
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

    /// Joint angles (radians) or travels (mm) in the unit and direction of the file.
    pub fn joints(&self, joints: &[f64; 3]) -> [f64; 3] {
        let travel = self.unit_of(Quantity::Travel1);
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

    /// A joint angle (radians) in degrees, in the direction of the file; a travel stays in mm.
    pub fn degrees(&self, joint: f64) -> f64 {
        match self.drive {
            Drive::Linear => joint,
            Drive::Rotary => self.sense() * degrees(joint),
        }
    }

    /// The smaller and the larger of two limits of the joints, radians or mm, in the direction of the file, and back.
    pub(crate) fn limits(&self, low: f64, high: f64) -> (f64, f64) {
        if self.sense() < 0.0 {
            (-high, -low)
        } else {
            (low, high)
        }
    }

    /// What limits a robot: the smaller limit of a joint is the larger one where it counts upwards.
    pub(crate) fn limit(&self, limit: Limit) -> Limit {
        match limit {
            Limit::JointMinimum(arm) if self.sense() < 0.0 => Limit::JointMaximum(arm),
            Limit::JointMaximum(arm) if self.sense() < 0.0 => Limit::JointMinimum(arm),
            other => other,
        }
    }

    /// A vector in the axes of the file from one in those inside, and back.
    pub fn vector(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        vector.component_mul(&Vector3::from(self.axes()))
    }

    /// From and to along each axis, in the axes of the file from those inside, and back.
    pub(crate) fn ranges(&self, ranges: [(f64, f64); 3]) -> [(f64, f64); 3] {
        let mut turned = ranges;
        for ((range, (low, high)), sense) in turned.iter_mut().zip(ranges).zip(self.axes()) {
            if sense < 0.0 {
                *range = (-high, -low);
            }
        }
        turned
    }

    /// A rotation between frames that both have the axes of the file from one with those inside, and back.
    pub fn rotation(&self, rotation: &Matrix3<f64>) -> Matrix3<f64> {
        let axes = Matrix3::from_diagonal(&Vector3::from(self.axes()));
        axes * rotation * axes
    }

    /// A position (mm, inside) in the unit and axes of the file.
    pub fn position(&self, position: &Vector3<f64>) -> [f64; 3] {
        let unit = self.unit_of(Quantity::X);
        let [x, y, z] = self.vector(position).data.0[0];
        [x, y, z].map(|value| unit.outwards(value))
    }

    /// `q1_deg`, `q2_deg`, `q3_deg`.
    pub(crate) fn joint_columns(&self) -> [String; 3] {
        Quantity::joints(self.drive).map(|joint| self.column(joint))
    }

    /// As the header of a table names a quantity.
    pub(crate) fn column(&self, quantity: Quantity) -> String {
        quantity.column(self.unit_of(quantity))
    }

    /// `x_mm`, `y_mm`, `z_mm`.
    pub(crate) fn position_columns(&self) -> [String; 3] {
        Quantity::COORDINATES.map(|axis| self.column(axis))
    }

    /// A row of joints and position, rounded to 9 decimals.
    pub(crate) fn row(&self, joints: &[f64; 3], position: &Vector3<f64>) -> String {
        let cells = self
            .joints(joints)
            .into_iter()
            .chain(self.position(position));
        cells.map(rounded).collect::<Vec<_>>().join(",")
    }

    /// "q1, deg": headings of a table's columns.
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
