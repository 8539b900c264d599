//! Where the instruments stand, how accurate they are, and what they read at a pose.

use super::request::{Kind, PlanRequest};
use crate::accuracy::rigid_motion;
use crate::accuracy::uncertainty::inside;
use crate::effects::{Places, PlaneFound, PointFound, USUAL_TURN};
use crate::files::{
    Kind as ReadingKind, ONLY_TARGET, Reading, ReadingFrom, Readings, RobotFile, Target,
};
use crate::fit::datum::Datum;
use crate::fit::observations::{USUAL_DISTANCE, USUAL_HEIGHT, is_stated, places};
use crate::fit::solution::{PARAMETERS, WITH_TRANSMISSIONS};
use crate::fit::{Frame, Options, solve};
use crate::geometry::range;
use crate::order;
use crate::text::{degrees, in_words, joint, rounded, tenths};
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{Plane, Point};
use delta_cal::{Noise, Real, Robot, Sample};
use nalgebra::{Rotation3, SMatrix, Vector3};
use serde::Serialize;
use std::f64::consts::TAU;

/// The name of the plane if the robot file states none.
pub const PLANE: &str = "plane";
/// Gauge blocks of a plane for which the robot file states none, mm.
const BLOCKS: [f64; 3] = [0.0, 60.0, 120.0];
/// Fixed points if the robot file states none.
const POINTS: [&str; 3] = ["A", "B", "C"];
/// Their distance from the z axis, as a fraction of the positions' rms distance from it.
const POINTS_OUT: f64 = 0.7;
/// Shortest and longest distance if none are stated, mm.
const LENGTHS: (f64, f64) = (50.0, f64::INFINITY);
/// Typical σ of a laser tracker, mm.
const POSITION: f64 = 0.02;
/// Typical σ of an encoder on a geared joint, degrees.
const JOINT_DEGREES: f64 = 0.002;
/// Heights closer together than this belong to the same gauge block, and distances to the same bar, mm.
const SAME: f64 = 1.0;
/// Poses stay above planes by so many σ of their height.
const CLEAR: f64 = 3.0;
/// A target this close to the axis of the platform, mm, is on it.
const CENTRAL: f64 = 1.0;
/// A file with more different heights than this was not measured on gauge blocks.
const MOST_BLOCKS: usize = 8;

/// A plane that is touched.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneAt {
    /// As the samples file names it.
    pub name: String,
    /// Heights of the gauge blocks on it, mm; 0 is the bare plane.
    pub blocks: Vec<f64>,
    /// What a calibration knows about it.
    pub known: Plane<f64>,
}

/// A fixed point that distances are measured from.
#[derive(Debug, Clone, PartialEq)]
pub struct PointAt {
    /// As the samples file names it.
    pub name: String,
    /// The shortest and the longest distance that can be measured from it, mm.
    pub lengths: (f64, f64),
    /// What a calibration knows about it.
    pub known: Point<f64>,
}

/// Where the instruments stand and how accurate they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// The robot with its tolerance and the noise assumed.
    pub robot: RobotFile,
    /// The planes.
    pub planes: Vec<PlaneAt>,
    /// The fixed points.
    pub points: Vec<PointAt>,
    /// Where planes, points and frame are.
    pub places: Places,
    /// The shortest and the longest distance between two poses, mm.
    pub lengths: (f64, f64),
    /// The frame of coordinates.
    pub frame: Frame,
    /// What datum points say about that frame's shift (mm) and turn (radians) in the sensor's axes: its information.
    pub datum: Option<SMatrix<f64, 7, 7>>,
    /// The vector from the platform point to the target that touches planes and to which distances are measured, mm.
    pub target: Vector3<f64>,
    /// The targets of positions, by name; empty if none is stated.
    pub targets: Vec<String>,
    /// Whether the robot file states the noise of every kind that is measured.
    pub noise_stated: bool,
}

/// A measurement to take, in the units and axes of the robot file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planned {
    /// Its name, if names were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Which repetition it is, if the poses are repeated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeat: Option<usize>,
    /// What is read.
    #[serde(rename = "measure")]
    pub kind: Kind,
    /// Whole thousandths of a degree or of a millimetre of travel.
    pub joints: [f64; 3],
    /// Position of the nominal robot's target, or of its platform point if no target is stated.
    pub position_mm: [f64; 3],
    /// The same in the frame of the coordinates if that is known.
    #[serde(skip)]
    pub nominal_mm: [f64; 3],
    /// Joints of the pose from which a distance between poses is measured.
    pub to_joints: Option<[f64; 3]>,
    /// Name of the target, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Name of the plane.
    pub plane: Option<String>,
    /// The gauge block on it.
    pub block_mm: Option<f64>,
    /// Name of the point.
    pub point: Option<String>,
    /// The row of a samples file, with the nominal robot's readings: radians and mm, in internal axes.
    #[serde(skip)]
    pub reading: Reading,
}

impl Setup {
    /// Coordinates of a target, by its index, to measure at a pose.
    pub(super) fn planned(&self, kind: Kind, target: usize, pose: &Sample<f64>) -> Planned {
        let convention = &self.robot.convention;
        let target = match kind {
            Kind::Position(_) => target,
            _ => 0,
        };
        let name = self.targets.get(target);
        let stated = name.and_then(|name| self.robot.instruments.target(name));
        let beside = match (kind, stated) {
            (Kind::Position(_), Some(own)) => own.place,
            _ => self.target,
        };
        let at = pose.position + beside;
        let seen = self.places.frame.map_or(at, |frame| frame.apply(&at));
        let turns = self.robot.instruments.orientation_noise.is_some();
        let asked = Reading {
            position: kind.coordinates().map(|read| read.then_some(0.0)),
            target,
            turn: (turns && kind == Kind::XYZ).then(Vector3::zeros),
            ..Reading::at(pose.joints)
        };
        let named = name.filter(|name| matches!(kind, Kind::Position(_)) && *name != ONLY_TARGET);
        Planned {
            target: named.cloned(),
            name: None,
            repeat: None,
            kind,
            joints: convention.joints(&pose.joints),
            position_mm: convention.vector(&at).into(),
            nominal_mm: convention.vector(&seen).into(),
            to_joints: None,
            plane: None,
            block_mm: None,
            point: None,
            reading: self.read(&self.robot.robot, &asked),
        }
    }

    /// The set-up for a request: what the robot file states, and defaults for the rest. `within`: poses in the region.
    pub fn of(request: &PlanRequest<'_>, within: Option<&[Sample<f64>]>) -> Self {
        let facts = &request.robot.instruments;
        let kinds = &request.kinds;
        let named = |stated: Vec<String>, wanted: Kind, usual: &[&str]| match stated {
            _ if !kinds.contain(wanted) => Vec::new(),
            stated if stated.is_empty() => usual.iter().map(|name| (*name).to_owned()).collect(),
            stated => stated,
        };
        let planes = facts.planes.iter().map(|own| own.name.clone()).collect();
        let points = facts.points.iter().map(|own| own.name.clone()).collect();
        let named = Readings {
            planes: named(planes, Kind::Plane, &[PLANE]),
            points: named(points, Kind::Point, &POINTS),
            ..Readings::of_name("")
        };
        let measured = |kind| kinds.read(kind);
        let mut setup = Self::unplaced(request.robot, &named, request.frame, measured);
        let poses = inside(&request.robot.robot, &request.robot.reach());
        let target = setup.target;
        let level = broadest(&shifted(within.unwrap_or(&poses), &target)) - target.z;
        setup.place(|_| level, &poses);
        setup
    }

    /// The instruments where a calibration from the rows of a file locates them, if every row is measured and the
    /// calibration succeeds. Otherwise planes are level, points are where a plan would put them, and the frame is the
    /// robot's.
    pub(super) fn of_rows(
        robot: &RobotFile,
        file: &Readings,
        unmeasured: &[u64],
        frame: Frame,
    ) -> Self {
        let mut setup = Self::unplaced(robot, file, frame, |kind| file.holds(kind));
        let options = Options::in_frame(frame);
        let fit = unmeasured
            .is_empty()
            .then(|| solve(&setup.robot, file, &options));
        if let Some(Ok(fit)) = fit {
            setup.places = fit.places;
        } else {
            let poses = inside(&robot.robot, &robot.reach());
            setup.place(|index| level(&robot.robot, file, unmeasured, index), &poses);
        }
        setup
    }

    /// The planes and points that are named, as the robot file states them. `measured`: whether a kind of reading is taken.
    /// What has no stated place is at the origin.
    pub(super) fn unplaced(
        robot: &RobotFile,
        named: &Readings,
        frame: Frame,
        measured: impl Fn(ReadingKind) -> bool,
    ) -> Self {
        let facts = &robot.instruments;
        let (planes, points) = places(robot, named);
        let level_at = |own: &Plane<f64>| PlaneFound {
            normal: Vector3::z(),
            offset: own.known.map_or(0.0, |(height, _)| height),
        };
        let still_at = |own: &Point<f64>| PointFound {
            place: own.known.map_or_else(Vector3::zeros, |(place, _)| place),
            offset: 0.0,
        };
        // An invalid datum was refused earlier.
        let datum = Datum::of(robot, frame).ok().flatten().map(|own| own.frame);
        let places = Places {
            planes: planes.iter().map(level_at).collect(),
            points: points.iter().map(still_at).collect(),
            frame: datum,
            ..Places::default()
        };
        let planes = named.planes.iter().zip(planes).map(|(name, known)| {
            let stated = facts.plane(name);
            let blocks = stated.map(|own| &own.blocks).filter(|own| !own.is_empty());
            PlaneAt {
                name: name.clone(),
                blocks: blocks.cloned().unwrap_or_else(|| BLOCKS.to_vec()),
                known,
            }
        });
        let points = named.points.iter().zip(points).map(|(name, known)| {
            let stated = facts.point(name);
            PointAt {
                name: name.clone(),
                lengths: stated.and_then(|own| own.lengths).unwrap_or(LENGTHS),
                known,
            }
        });
        let mut kinds = ReadingKind::ALL.into_iter();
        let mut with_noise = with_noise(robot);
        let turns = &mut with_noise.instruments.orientation_noise;
        if robot.parallelograms.is_none() {
            *turns = None;
        } else if named.rows.iter().any(|row| row.value.turn.is_some()) {
            turns.get_or_insert(USUAL_TURN);
        }
        let sigma = with_noise.noise.map_or(POSITION, |own| own.position());
        let seen = |frame: RigidTransform<f64>| {
            let each = facts.datum.iter().map(|point| {
                let place = frame.rotation * point.place;
                let mut columns = SMatrix::<f64, 3, 7>::zeros();
                columns
                    .fixed_columns_mut::<6>(0)
                    .copy_from(&rigid_motion::columns(&place));
                columns.set_column(6, &place);
                columns.tr_mul(&columns) / point.sigma.unwrap_or_default().hypot(sigma).powi(2)
            });
            each.sum()
        };
        Self {
            robot: with_noise,
            planes: planes.collect(),
            points: points.collect(),
            places,
            lengths: facts.lengths.unwrap_or(LENGTHS),
            frame,
            datum: datum.map(seen),
            target: facts.target_place(),
            targets: if named.targets.is_empty() {
                facts.targets.iter().map(|own| own.name.clone()).collect()
            } else {
                named.targets.clone()
            },
            noise_stated: kinds.all(|kind| !measured(kind) || is_stated(robot, kind)),
        }
    }

    /// Places planes of unknown height at the height that is given for their index, and points at unknown places on a table,
    /// evenly around the z axis.
    fn place(&mut self, height: impl Fn(usize) -> f64, poses: &[Sample<f64>]) {
        for (index, (plane, at)) in self.planes.iter().zip(&mut self.places.planes).enumerate() {
            if plane.known.known.is_none() {
                at.offset = height(index);
            }
        }
        let target = self.target;
        let poses = &shifted(poses, &target);
        let squares = poses.iter().map(|pose| pose.position.xy().norm_squared());
        let count = f64::max(poses.len() as f64, 1.0);
        let out = POINTS_OUT * (squares.fold(0.0, |sum, own| sum + own) / count).square_root();
        let points = self.points.iter().zip(&mut self.places.points);
        let unknown = points.filter(|(point, _)| point.known.known.is_none());
        let unknown: Vec<_> = unknown.collect();
        let number = unknown.len() as f64;
        for (index, (_, at)) in unknown.into_iter().enumerate() {
            let angle = std::f64::consts::TAU * index as f64 / number;
            let (sine, cosine) = angle.sine_cosine();
            let place = Vector3::new(out * cosine, out * sine, low(poses));
            at.place = place.map(|c| (c / 10.0).round() * 10.0 + 0.0) - target;
        }
    }

    /// Number of the core's unknowns that belong to the robot.
    pub(super) const fn robot_unknowns(&self) -> usize {
        match self.robot.transmission {
            Some(_) => WITH_TRANSMISSIONS,
            None => PARAMETERS,
        }
    }

    /// The same with the first `count` targets, or with as many more, turned about the z axis from the first.
    pub(super) fn with_targets(&self, count: usize) -> Option<Self> {
        let mut own = self.clone();
        let targets = &mut own.robot.instruments.targets;
        let first = targets
            .first()
            .filter(|own| own.place.xy().norm() > CENTRAL)?;
        let first = first.clone();
        for index in targets.len()..count {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), TAU * index as f64 / 3.0);
            targets.push(Target {
                name: format!("{} {index}", first.name),
                place: turn * first.place,
                ..first
            });
        }
        targets.truncate(count);
        own.targets = targets.iter().map(|own| own.name.clone()).collect();
        Some(own)
    }

    /// Whether all targets stay above every plane of known height with the platform here; the height may be off by three σ.
    pub(super) fn is_above_planes(&self, platform: &Vector3<f64>) -> bool {
        let facts = &self.robot.instruments;
        let targets = facts.targets.iter().map(|own| own.place.z);
        let lowest = targets.reduce(f64::min).unwrap_or_default();
        let mut planes = facts.planes.iter();
        planes.all(|own| platform.z + lowest >= own.height + CLEAR * own.sigma)
    }

    /// A row with a robot's readings in place of its own; unchanged if that robot does not reach it.
    pub(super) fn read(&self, robot: &Robot<f64>, row: &Reading) -> Reading {
        let [x, y, z, height, distance] = self.places.expected(robot, row);
        let mut read = *row;
        for (cell, coordinate) in read.position.iter_mut().zip([x, y, z]) {
            *cell = coordinate.or(*cell);
        }
        if let (Some((_, cell)), Some(height)) = (&mut read.height, height) {
            *cell = height;
        }
        if let (Some((_, cell)), Some(distance)) = (&mut read.distance, distance) {
            *cell = distance.max(f64::EPSILON);
        }
        read
    }

    /// Takes gauge blocks and lengths from the rows of a file where the robot file states none.
    pub(super) fn as_used(&mut self, rows: &[Reading]) {
        let facts = &self.robot.instruments;
        for (index, plane) in self.planes.iter_mut().enumerate() {
            let stated = facts.plane(&plane.name);
            if stated.is_some_and(|own| !own.blocks.is_empty()) {
                continue;
            }
            let heights = rows.iter().filter_map(|row| row.height);
            let heights = heights.filter(|(plane, _)| *plane == index);
            // Nominal heights of the blocks, to a tenth of a millimetre.
            let mut heights: Vec<_> = heights.map(|(_, height)| tenths(height)).collect();
            order::sort(&mut heights);
            heights.dedup_by(|one, other| (*one - *other).abs() < SAME);
            plane.blocks = match heights.len() {
                1..=MOST_BLOCKS => heights,
                _ => vec![0.0],
            };
        }
        let lengths = |is_own: &dyn Fn(&ReadingFrom) -> bool| {
            let distances = rows.iter().filter_map(|row| row.distance);
            let own = distances.filter(|(from, _)| is_own(from));
            let (shortest, longest) = range(own.map(|(_, distance)| distance));
            if longest > 0.0 && longest - shortest < SAME {
                let middle = f64::midpoint(shortest, longest);
                return (middle, middle);
            }
            (shortest.min(longest.max(0.0)), f64::INFINITY)
        };
        if facts.lengths.is_none() {
            self.lengths = lengths(&|from| matches!(from, ReadingFrom::Pose(_)));
        }
        for (index, point) in self.points.iter_mut().enumerate() {
            let stated = facts.point(&point.name);
            if stated.is_none_or(|own| own.lengths.is_none()) {
                point.lengths = lengths(&|from| *from == ReadingFrom::Point(index));
            }
        }
    }

    /// The noise of what is measured, and the tolerance, in words.
    pub(super) fn assumptions(&self, planned: &[Planned]) -> String {
        let noise = self.robot.noise;
        let mut kinds = Vec::new();
        for kind in ReadingKind::ALL {
            if planned.iter().any(|own| own.kind.reads() == kind) {
                let sigma = self.robot.sigma(kind);
                kinds.extend(sigma.map(|sigma| format!("{} {sigma} mm", kind.plural())));
            }
        }
        if let Some(own) = self
            .robot
            .instruments
            .orientation_noise
            .filter(|_| planned.iter().any(|own| own.reading.turn.is_some()))
        {
            kinds.push(format!("rotations {}°", rounded(degrees(own))));
        }
        let drive = self.robot.robot.drive();
        let joint = noise.map_or(0.0, |own| joint::in_file(drive, own.joint()));
        let (name, mark) = (joint::name(drive), joint::mark(drive));
        kinds.push(format!("{name}s {}{mark}", rounded(joint)));
        let stated = if self.noise_stated {
            ""
        } else {
            " (assumed where not stated)"
        };
        let tolerance = self.robot.tolerance.as_ref();
        let tolerance = tolerance.map_or("none stated".to_owned(), |own| in_words(drive, own));
        format!(
            "Noise: {}{stated}. Tolerance: {tolerance}.",
            kinds.join(", ")
        )
    }
}

/// The robot with a noise of every kind, stated or typical.
fn with_noise(robot: &RobotFile) -> RobotFile {
    let facts = &robot.instruments;
    let joint = facts.joint_noise.unwrap_or(JOINT_DEGREES.to_radians());
    let mut with = robot.clone();
    with.noise = robot.noise.or_else(|| Noise::new(POSITION, joint).ok());
    with.instruments.height_noise = facts.height_noise.or(Some(USUAL_HEIGHT));
    with.instruments.distance_noise = facts.distance_noise.or(Some(USUAL_DISTANCE));
    with
}

/// The poses, with the target's positions.
fn shifted(poses: &[Sample<f64>], target: &Vector3<f64>) -> Vec<Sample<f64>> {
    let target_of = |pose: &Sample<f64>| Sample {
        position: pose.position + target,
        ..*pose
    };
    poses.iter().map(target_of).collect()
}

/// The height of the plane, such that most poses lie between it and the tallest gauge block.
fn broadest(poses: &[Sample<f64>]) -> f64 {
    let [.., tallest] = BLOCKS;
    let heights = || poses.iter().map(|pose| pose.position.z);
    let (lowest, highest) = range(heights());
    let span = tallest.max(0.1 * (highest - lowest));
    let within = |low: f64| heights().filter(|z| (low..low + span).contains(z)).count();
    let steps = (0..100).map(|step| lowest + (highest - lowest) * f64::from(step) / 100.0);
    let best = steps.max_by_key(|low| within(*low)).unwrap_or(lowest);
    // To a centimetre: a plate is not placed more accurately than that.
    10.0 * (best / 10.0).round()
}

/// The height of a table: one pose in ten lies below it.
fn low(poses: &[Sample<f64>]) -> f64 {
    let mut heights: Vec<_> = poses.iter().map(|pose| pose.position.z).collect();
    order::sort(&mut heights);
    let height = heights.get(heights.len() / 10).copied().unwrap_or_default();
    10.0 * (height / 10.0).round()
}

/// The height of a plane according to the nominal robot's touches; without measurements, that of its lowest pose.
fn level(robot: &Robot<f64>, file: &Readings, unmeasured: &[u64], plane: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut lowest = f64::INFINITY;
    for row in &file.rows {
        let height = row.value.height.filter(|(own, _)| *own == plane);
        if let (Some((_, height)), Ok(there)) = (height, robot.forward(&row.value.joints)) {
            lowest = lowest.min(there.z);
            if unmeasured.binary_search(&row.line).is_err() {
                sum += there.z - height;
                count += 1.0;
            }
        }
    }
    match (count > 0.0, lowest.is_finite()) {
        (true, _) => sum / count,
        (false, true) => lowest,
        (false, false) => 0.0,
    }
}
