//! Where the instruments stand, how accurate they are, and what they read at a pose.

use super::PlanRequest;
use super::request::Kind;
use crate::accuracy::uncertainty::inside;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind as ReadingKind, Reading, ReadingFrom, Readings};
use crate::fit::Frame;
use crate::fit::observations::{USUAL_DISTANCE, USUAL_HEIGHT, is_stated, places};
use crate::fit::solution::{Places, PlaneFound, PointFound};
use crate::geometry::range;
use delta_cal::observations::{Plane, Point};
use delta_cal::{Noise, Real, Robot, Sample};
use nalgebra::Vector3;

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
    /// Whether the points stand on a table, below the platform.
    pub(super) on_table: bool,
    /// The shortest and the longest distance between two poses, mm.
    pub lengths: (f64, f64),
    /// The frame of coordinates.
    pub frame: Frame,
    /// Whether the robot file states the noise of every kind that is measured.
    pub noise_stated: bool,
}

/// A measurement to take.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// The kind of reading.
    pub kind: Kind,
    /// Joint angles in whole thousandths of a degree, and the nominal robot's position there.
    pub pose: Sample<f64>,
    /// The other pose of a distance between two poses.
    pub other: Option<Sample<f64>>,
    /// Which of the planes ([`Setup::planes`]), and which of its gauge blocks.
    pub plane: Option<(usize, usize)>,
    /// Which of the points ([`Setup::points`]).
    pub point: Option<usize>,
}

impl Setup {
    /// The set-up for a request: what the robot file states, and defaults for the rest.
    pub fn of(request: &PlanRequest<'_>) -> Self {
        let facts = &request.robot.instruments;
        let kinds = &request.kinds;
        let mut named = Readings::of_name("");
        if kinds.contain(Kind::Plane) {
            named.planes = facts.planes.iter().map(|own| own.name.clone()).collect();
            if named.planes.is_empty() {
                named.planes.push(PLANE.to_owned());
            }
        }
        if kinds.contain(Kind::Point) {
            named.points = facts.points.iter().map(|own| own.name.clone()).collect();
            if named.points.is_empty() {
                named.points.extend(POINTS.map(str::to_owned));
            }
        }
        let heights = !named.planes.is_empty();
        let distances = !named.points.is_empty() || kinds.contain(Kind::Distance);
        let measured = [kinds.positions(), heights, distances];
        let mut setup = Self::unplaced(request.robot, &named, request.frame, measured);
        let poses = inside(&request.robot.robot, &request.robot.reach());
        setup.place(|_| broadest(&poses), &poses);
        setup
    }

    /// The planes and points that are named, as the robot file states them. `measured`: whether coordinates, heights and
    /// distances are measured. What has no stated place is at the origin.
    pub(super) fn unplaced(
        robot: &RobotFile,
        named: &Readings,
        frame: Frame,
        measured: [bool; 3],
    ) -> Self {
        let facts = &robot.instruments;
        let (planes, points) = places(robot, named);
        let places = Places {
            planes: planes.iter().map(plane_of).collect(),
            points: points.iter().map(point_of).collect(),
            ..Places::default()
        };
        let planes = named.planes.iter().zip(planes).map(|(name, known)| {
            let stated = facts.planes.iter().find(|own| own.name == *name);
            let blocks = stated.map(|own| &own.blocks[..]).unwrap_or_default();
            PlaneAt {
                name: name.clone(),
                blocks: match blocks {
                    [] => BLOCKS.to_vec(),
                    stated => stated.to_vec(),
                },
                known,
            }
        });
        let points = named.points.iter().zip(points).map(|(name, known)| {
            let stated = facts.points.iter().find(|own| own.name == *name);
            PointAt {
                name: name.clone(),
                lengths: stated.and_then(|own| own.lengths).unwrap_or(LENGTHS),
                known,
            }
        });
        let mut kinds = ReadingKind::ALL.into_iter().zip(measured);
        Self {
            robot: with_noise(robot),
            planes: planes.collect(),
            points: points.collect(),
            places,
            on_table: facts.points.iter().all(|point| point.place.is_none()),
            lengths: facts.lengths.unwrap_or(LENGTHS),
            frame,
            noise_stated: kinds.all(|(kind, measured)| !measured || is_stated(robot, kind)),
        }
    }

    /// Places planes of unknown height at the height that is given for their index, and points at unknown places on a table,
    /// evenly around the z axis.
    pub(super) fn place(&mut self, height: impl Fn(usize) -> f64, poses: &[Sample<f64>]) {
        for (index, (plane, at)) in self.planes.iter().zip(&mut self.places.planes).enumerate() {
            if plane.known.known.is_none() {
                at.offset = height(index);
            }
        }
        let squares = poses.iter().map(|pose| pose.position.xy().norm_squared());
        let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), own| (sum + own, count + 1.0));
        let out = POINTS_OUT * (sum / f64::max(count, 1.0)).square_root();
        let points = self.points.iter().zip(&mut self.places.points);
        let unknown = points.filter(|(point, _)| point.known.known.is_none());
        let unknown: Vec<_> = unknown.collect();
        let number = unknown.len() as f64;
        for (index, (_, at)) in unknown.into_iter().enumerate() {
            let angle = std::f64::consts::TAU * index as f64 / number;
            let (sine, cosine) = angle.sine_cosine();
            let place = Vector3::new(out * cosine, out * sine, low(poses));
            at.place = place.map(|c| (c / 10.0).round() * 10.0 + 0.0);
        }
    }

    /// A measurement as a row of a samples file, with the nominal robot's readings.
    pub(super) fn row(&self, own: &Planned) -> Reading {
        let from = match (&own.other, own.point) {
            (Some(other), _) => Some(ReadingFrom::Pose(other.joints)),
            (None, point) => point.map(ReadingFrom::Point),
        };
        let asked = Reading {
            position: own.kind.coordinates().map(|read| read.then_some(0.0)),
            height: own.plane.map(|(plane, _)| (plane, 0.0)),
            distance: from.map(|from| (from, 1.0)),
            ..Reading::at(own.pose.joints)
        };
        self.read(&self.robot.robot, &asked)
    }

    /// The same row with another robot's readings; unchanged if that robot does not reach it.
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
}

/// A level plane at its known height.
fn plane_of(known: &Plane<f64>) -> PlaneFound {
    PlaneFound {
        normal: Vector3::z(),
        offset: known.known.map_or(0.0, |(height, _)| height),
    }
}

fn point_of(known: &Point<f64>) -> PointFound {
    PointFound {
        place: known.known.map_or_else(Vector3::zeros, |(place, _)| place),
        offset: 0.0,
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
    heights.sort_by(f64::total_cmp);
    let height = heights.get(heights.len() / 10).copied().unwrap_or_default();
    10.0 * (height / 10.0).round()
}
