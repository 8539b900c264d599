//! Effects: what moves readings and is not one of the robot's parameters.
//!
//! ```text
//! measured = h(X(P; q + Σ turns · a) + Σ columns · a) + noise
//! ```
//!
//! h turns a position into coordinates, a height or a distance. An effect has one or more unknowns a, for each row the
//! derivative of the position by each of them, and words. A fit estimates it beside the robot if it has a prior; the
//! search for causes opens it.

mod instrument;
mod numbers;
mod orientation;
mod places;
mod surface;
mod tilt;
mod words;

pub(crate) use instrument::{motion, moved};
pub(crate) use numbers::turned;
pub use orientation::OrientationNoise;
pub(crate) use orientation::{Orientation, USUAL as USUAL_TURN, orientations};
pub use places::{Places, PlaneFound, PointFound};
pub(crate) use surface::{sigmas as sigmas_of_bed, waves as waves_of_bed};
pub(crate) use tilt::Platform;
pub(crate) use words::misplaced;

use crate::files::{Kind, Reading, ReadingFrom, Readings, Row};
use crate::geometry::{Directions, NUMBERS, centroid, range};
use crate::halt;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Robot};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// The kind of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectKind {
    /// The joint's error is proportional to its reading: δq = g q.
    GearRatio,
    /// Error that repeats once a turn: δq = a cos q + b sin q.
    Eccentricity,
    /// Error that repeats twice a turn: δq = a cos 2q + b sin 2q.
    SecondHarmonic,
    /// A carriage is further along its tower at the ends of its range than in the middle: δs = c u², u being −1 and 1
    /// at the ends of the measured range. A bent tower, an uneven belt or screw.
    UnevenTravel,
    /// The joint's error changes sign with the direction of its last move: δq = ±b. Before its first move, of which the
    /// direction is not known, δq = a.
    Backlash,
    /// The joint's zero jumps at one row.
    Slip,
    /// The platform is lower with the squared distance from the robot's axis.
    Sag,
    /// The measured positions move from the first row to the last, evenly or ever more slowly.
    Drift,
    /// From one row on, the measured positions are moved and turned.
    Move,
    /// All measured lengths are larger than the robot's own.
    Scale,
    /// The target is beside its stated place on the platform.
    Target,
    /// The sensor's frame is off the one that the datum points give.
    Datum,
    /// The touched surface is uneven.
    Bed,
    /// All measured prints are longer by the same.
    Oversize,
    /// The platform tilts, because the two rods of an arm differ.
    Tilt,
    /// The robot file's joint zeros are off.
    Zeros,
    /// Its gear ratio or steps per mm.
    Gears,
    /// Its forearms.
    Forearm,
    /// Its upper arms.
    UpperArm,
    /// The distance of motors or towers from the axis.
    Radius,
    /// All its lengths.
    Size,
}

impl EffectKind {
    /// The kinds that concern a single joint throughout.
    const fn of_joints(drive: Drive) -> &'static [Self] {
        match drive {
            Drive::Rotary => &[
                Self::GearRatio,
                Self::Eccentricity,
                Self::SecondHarmonic,
                Self::Backlash,
            ],
            Drive::Linear => &[Self::UnevenTravel, Self::Backlash],
        }
    }

    /// The kinds that the residuals of robots with these drives are tested for.
    pub fn all(drive: Drive) -> impl Iterator<Item = Self> {
        let of_joints = Self::of_joints(drive).iter().copied();
        of_joints.chain([Self::Sag, Self::Drift, Self::Scale])
    }

    /// Whether it can be calibrated as a transmission.
    pub(crate) const fn is_of_transmission(self) -> bool {
        matches!(
            self,
            Self::GearRatio | Self::Eccentricity | Self::SecondHarmonic
        )
    }

    pub(crate) const fn unknowns(self) -> usize {
        match self {
            Self::Eccentricity | Self::SecondHarmonic | Self::Backlash => 2,
            Self::Drift | Self::Target | Self::Zeros => 3,
            Self::Move | Self::Datum => 6,
            Self::Bed => surface::COUNT,
            Self::Tilt => NUMBERS,
            _ => 1,
        }
    }

    pub(crate) const fn is_of_joint(self) -> bool {
        self.is_of_transmission()
            || matches!(self, Self::UnevenTravel | Self::Backlash | Self::Slip)
    }

    /// Whether it happens at one row.
    pub(crate) const fn is_step(self) -> bool {
        matches!(self, Self::Slip | Self::Move)
    }

    /// Whether it is a wrong number of the robot file.
    pub(crate) const fn is_number(self) -> bool {
        matches!(
            self,
            Self::Zeros | Self::Gears | Self::Forearm | Self::UpperArm | Self::Radius | Self::Size
        )
    }

    /// Unit of its size: `ratio`, `deg` or `mm`.
    pub const fn unit(self, drive: Drive) -> &'static str {
        match (self, drive) {
            (Self::Eccentricity | Self::SecondHarmonic | Self::Zeros, _)
            | (Self::Backlash | Self::Slip, Drive::Rotary) => "deg",
            (Self::GearRatio | Self::Scale, _) => "ratio",
            (own, _) if own.is_number() => "ratio",
            _ => "mm",
        }
    }
}

/// An effect: a kind, and what it concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Effect {
    pub(crate) kind: EffectKind,
    /// Of an error of a joint.
    pub(crate) arm: Option<ArmIndex>,
    /// Index of the row at which a slip or a move happened, or of the target; of a drift
    /// the number of its time constants in the file, 0 if it is even.
    pub(crate) index: usize,
}

impl Effect {
    /// An effect that concerns neither an arm nor a row.
    pub(crate) const fn of(kind: EffectKind) -> Self {
        Self {
            kind,
            arm: None,
            index: 0,
        }
    }

    /// An error of an arm's joint.
    pub(crate) const fn of_arm(kind: EffectKind, arm: ArmIndex) -> Self {
        Self {
            arm: Some(arm),
            ..Self::of(kind)
        }
    }

    /// The same at a row, or of a target.
    pub(crate) const fn at(self, index: usize) -> Self {
        Self { index, ..self }
    }

    pub(crate) const fn unknowns(&self) -> usize {
        self.kind.unknowns()
    }

    /// Derivative of a row's position by each unknown: mm per radian, 1, or mm.
    pub(crate) fn columns(&self, at: &At, course: &Course, row: usize) -> Vec<Vector3<f64>> {
        let place = &course.places[row];
        match (self.arm.map(ArmIndex::index), self.kind) {
            (Some(arm), _) => {
                let by_joint = at.by_joints.column(arm);
                let turns = self.turns(&at.joints, course, row).into_iter();
                turns.map(|own| by_joint * own).collect()
            }
            (None, kind) if kind.is_number() => numbers::columns(kind, &course.robot, &at.joints),
            // It grows with the square of the distance, up to its size at the largest.
            (None, EffectKind::Sag) => vec![Vector3::new(0.0, 0.0, -place.radius_squared)],
            (None, EffectKind::Bed) => {
                let touched = at.position + course.target(place);
                surface::columns(&touched, course.disc, place.touched)
            }
            (None, EffectKind::Oversize) => surface::apart(&at.position, place),
            (None, EffectKind::Tilt) => tilt::columns(at, course, place),
            (None, _) => instrument::columns(self, &at.position, course, row),
        }
    }

    /// Error of the joint of its arm per unit of each unknown: what it reads is not its angle or travel.
    fn turns(&self, joints: &[f64; 3], course: &Course, row: usize) -> Vec<f64> {
        let arm = self.arm.map_or(0, ArmIndex::index);
        let (q, (low, high)) = (joints[arm], course.ranges[arm]);
        match self.kind {
            EffectKind::GearRatio => vec![q],
            EffectKind::Eccentricity => vec![q.cos(), q.sin()],
            EffectKind::SecondHarmonic => vec![(2.0 * q).cos(), (2.0 * q).sin()],
            EffectKind::UnevenTravel if high > low => {
                let part = (2.0 * q - low - high) / (high - low);
                vec![part * part]
            }
            EffectKind::Backlash => {
                let direction = course.places[row].directions[arm];
                vec![direction, 1.0 - direction.abs()]
            }
            EffectKind::Slip if row >= self.index => vec![1.0],
            _ => vec![0.0],
        }
    }

    /// Displacement of a row's position by this much of the effect, mm.
    pub(crate) fn displacement(
        &self,
        at: &At,
        course: &Course,
        row: usize,
        by: &[f64],
    ) -> Vector3<f64> {
        match self.kind {
            kind if kind.is_number() => {
                numbers::displacement(kind, &course.robot, &at.joints, by).unwrap_or_default()
            }
            EffectKind::Tilt => tilt::displacement(at, course, &course.places[row], by),
            EffectKind::Move if row >= self.index => {
                moved(&at.position, &course.centre, by) - at.position
            }
            _ => {
                let columns = self.columns(at, course, row).into_iter().zip(by);
                columns.map(|(own, by)| own * *by).sum()
            }
        }
    }
}

/// An effect that a fit estimates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Estimated {
    pub(crate) effect: Effect,
    /// What is stated of its unknowns, and one σ of each; infinite if nothing is stated.
    pub(crate) mean: Vec<f64>,
    pub(crate) sigma: Vec<f64>,
    pub(crate) by: Vec<f64>,
    /// Index of the first of its unknowns.
    pub(crate) first: usize,
}

impl Estimated {
    pub(crate) fn new(effect: Effect, mean: Vec<f64>, sigma: Vec<f64>) -> Self {
        Self {
            effect,
            by: mean.clone(),
            mean,
            sigma,
            first: 0,
        }
    }

    /// Of which nothing is known.
    pub(crate) fn open(effect: Effect) -> Self {
        let unknowns = effect.unknowns();
        Self::new(effect, vec![0.0; unknowns], vec![f64::INFINITY; unknowns])
    }

    pub(crate) fn places(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.by.len()
    }
}

/// A pose of a robot.
#[derive(Clone, Copy)]
pub(crate) struct At {
    pub(crate) joints: [f64; 3],
    pub(crate) position: Vector3<f64>,
    pub(crate) by_joints: Matrix3<f64>,
}

impl At {
    pub(crate) fn new(robot: &Robot<f64>, joints: &[f64; 3]) -> Option<Self> {
        let position = robot.forward(joints).ok()?;
        let by_joints = robot.platform_jacobian(&position, joints).ok()?.by_joints;
        Some(Self {
            joints: *joints,
            position,
            by_joints,
        })
    }
}

/// A row's place in the file as a whole.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Place {
    /// −1 or 1 for each joint: the direction of its last move; 0 before its first move.
    pub(crate) directions: [f64; 3],
    /// From 0 in the first row to 1 in the last.
    pub(crate) part: f64,
    /// Squared distance from the robot's axis, 1 at the largest in the file.
    pub(crate) radius_squared: f64,
    /// 1 for a row whose readings have the instrument's scale, 0 for a touch of a plane.
    pub(crate) scaled: f64,
    /// Whether it is a touch of a plane and nothing else.
    pub(crate) touched: bool,
    /// From the start to the end of a distance between two poses: its direction and its middle, mm.
    pub(crate) between: Option<[Vector3<f64>; 2]>,
    /// The point about which they have it, mm.
    pub(crate) origin: Vector3<f64>,
    pub(crate) target: usize,
}

/// The rows of a file in their order, as far as effects depend on it.
pub(crate) struct Course {
    pub(crate) places: Vec<Place>,
    /// Lowest and highest angle or travel of each joint.
    pub(crate) ranges: [(f64, f64); 3],
    /// Mean of the positions, mm.
    pub(crate) centre: Vector3<f64>,
    /// Largest squared distance from the robot's axis, mm².
    pub(crate) largest: f64,
    /// The robot as far as it is known.
    pub(crate) robot: Robot<f64>,
    /// The target that the places of planes and points count already, mm.
    pub(crate) counted: Vector3<f64>,
    /// The targets, and what holds them.
    pub(crate) platform: Platform,
    /// Largest squared distance of a touched place from the robot's axis, mm².
    pub(crate) disc: f64,
}

impl Course {
    pub(crate) fn of(
        robot: &Robot<f64>,
        platform: Platform,
        found: &Places,
        readings: &Readings,
    ) -> Self {
        let rows = &readings.rows;
        let positions = rows.iter().map(|row| robot.forward(&row.value.joints).ok());
        let positions: Vec<_> = positions.collect();
        let reached = || positions.iter().flatten();
        let largest = |all: &mut dyn Iterator<Item = Vector3<f64>>| {
            all.map(|own| own.xy().norm_squared()).fold(0.0, f64::max)
        };
        let touched = rows.iter().zip(&positions).filter_map(|(row, own)| {
            row.value.height?;
            Some((*own)? + platform.target(row.value.target))
        });
        let disc = largest(&mut touched.into_iter());
        let largest = largest(&mut reached().copied());
        let last = rows.len().saturating_sub(1) as f64;
        let mut moves = Directions::default();
        let place = |(index, row): (usize, &Row<Reading>)| {
            halt::check();
            let squared = positions[index].map_or(0.0, |own| own.xy().norm_squared());
            let here = || {
                let part = share(index as f64, last);
                (part, moves.next(&row.value.joints))
            };
            let known = readings.order.get(&row.line).copied();
            let (part, directions) = known.unwrap_or_else(here);
            let origin = match row.value.distance {
                Some((ReadingFrom::Point(point), _)) => found.points.get(point),
                _ => None,
            };
            Place {
                directions,
                part,
                radius_squared: share(squared, largest),
                scaled: if row.value.height.is_none() { 1.0 } else { 0.0 },
                touched: row.value.kind() == Some(Kind::Height),
                between: between(robot, &row.value),
                origin: origin.map_or_else(Vector3::zeros, |own| own.place),
                target: row.value.target,
            }
        };
        Self {
            places: rows.iter().enumerate().map(place).collect(),
            ranges: [0, 1, 2].map(|joint| range(rows.iter().map(|row| row.value.joints[joint]))),
            centre: centroid(reached().copied()),
            largest,
            robot: robot.clone(),
            counted: Vector3::zeros(),
            platform,
            disc,
        }
    }

    /// The same for a position measured anywhere with the first row, with joints last moved in these directions.
    pub(crate) fn anywhere(&self, at: &At, directions: [f64; 3]) -> Self {
        let place = Place {
            directions,
            part: 0.0,
            radius_squared: share(at.position.xy().norm_squared(), self.largest),
            scaled: 1.0,
            ..Place::default()
        };
        Self {
            places: vec![place],
            robot: self.robot.clone(),
            platform: self.platform.clone(),
            ..*self
        }
    }

    /// Where a row's target is stated to be, mm.
    fn target(&self, place: &Place) -> Vector3<f64> {
        self.platform.target(place.target)
    }

    /// The readings without this much of the effects, as the robot at these places would have given them.
    pub(crate) fn without(
        &self,
        found: &Places,
        readings: &Readings,
        effects: &[(Effect, &[f64])],
    ) -> Readings {
        let mut undone = readings.clone();
        for (row, own) in undone.rows.iter_mut().enumerate() {
            halt::check();
            self.undo(found, row, &mut own.value, effects);
        }
        undone
    }

    fn undo(&self, found: &Places, row: usize, own: &mut Reading, effects: &[(Effect, &[f64])]) {
        for (effect, by) in effects {
            if let Some(arm) = effect.arm.map(ArmIndex::index) {
                own.each_pose(|mut joints| {
                    let turns = effect.turns(&joints, self, row).into_iter();
                    joints[arm] += turns.zip(*by).map(|(own, by)| own * by).sum::<f64>();
                    joints
                });
            }
        }
        let others: Vec<_> = effects.iter().filter(|own| own.0.arm.is_none()).collect();
        if others.is_empty() {
            return;
        }
        let displaced = |joints: &[f64; 3]| {
            let at = At::new(&self.robot, joints)?;
            let all = others.iter();
            let off = all.map(|(effect, by)| effect.displacement(&at, self, row, by));
            Some((at.position, off.sum::<Vector3<f64>>()))
        };
        let Some((there, off)) = displaced(&own.joints) else {
            return;
        };
        let seen = found.frame.map_or(off, |frame| frame.rotation * off);
        for (coordinate, off) in own.position.iter_mut().zip(&seen) {
            *coordinate = coordinate.map(|value| value - off);
        }
        let off = off - self.counted;
        if let Some((plane, height)) = &mut own.height {
            let normal = found.planes.get(*plane).map(|own| own.normal);
            *height -= normal.unwrap_or_else(Vector3::z).dot(&off);
        }
        if let Some((from, distance)) = &mut own.distance {
            let starts = match from {
                ReadingFrom::Pose(joints) => {
                    displaced(joints).map(|(start, moved)| (start, moved - self.counted))
                }
                ReadingFrom::Point(point) => found
                    .points
                    .get(*point)
                    .map(|own| (own.place, Vector3::zeros())),
            };
            if let Some((start, moved)) = starts {
                *distance -= (there + off - start - moved).norm() - (there - start).norm();
            }
        }
    }
}

/// Direction and middle of a distance between two poses.
fn between(robot: &Robot<f64>, own: &Reading) -> Option<[Vector3<f64>; 2]> {
    let Some((ReadingFrom::Pose(from), _)) = own.distance else {
        return None;
    };
    let [from, to] = [robot.forward(&from).ok()?, robot.forward(&own.joints).ok()?];
    Some([(to - from).normalize(), 0.5 * (from + to)])
}

/// 0 of nothing.
fn share(part: f64, all: f64) -> f64 {
    if all > 0.0 { part / all } else { 0.0 }
}
