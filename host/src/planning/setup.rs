//! Where the instruments stand, how accurate they are, and what they read at a pose.

use super::PlanRequest;
use super::request::Kind;
use crate::accuracy::uncertainty::inside;
use crate::files::robot_file::RobotFile;
use crate::fit::Frame;
use delta_cal::frame::RigidTransform;
use delta_cal::observations::{Distance, DistanceFrom, Height, Observation, Plane, Point};
use delta_cal::{Noise, Real, Robot, Sample};
use nalgebra::Vector3;

/// The name of a plane that the robot file leaves unnamed.
pub const PLANE: &str = "plane";
/// Gauge blocks of a plane for which the robot file states none, mm.
const BLOCKS: [f64; 3] = [0.0, 60.0, 120.0];
/// Fixed points if the robot file states none.
const POINTS: [&str; 3] = ["A", "B", "C"];
/// Their distance from the z axis, as a fraction of the positions' rms distance from it.
const POINTS_OUT: f64 = 0.7;
/// Shortest distance if none is stated, mm.
const SHORTEST: f64 = 50.0;
/// Typical σ of a laser tracker, a dial gauge, and a calliper or wire sensor, mm.
const POSITION: f64 = 0.02;
const HEIGHT: f64 = 0.02;
const DISTANCE: f64 = 0.05;
/// Typical σ of an encoder on a geared joint, degrees.
const JOINT_DEGREES: f64 = 0.002;

/// A plane that is touched.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneAt {
    /// As the samples file names it.
    pub name: String,
    /// Unit vector, pointing up.
    pub normal: Vector3<f64>,
    /// mm: a height above the plane is `normal · X − offset`.
    pub offset: f64,
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
    /// mm.
    pub place: Vector3<f64>,
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
    /// Whether the points stand on a table, below the platform.
    pub(super) on_table: bool,
    /// The shortest and the longest distance between two poses, mm.
    pub lengths: (f64, f64),
    /// The frame of coordinates.
    pub frame: Frame,
    /// From the robot's frame to that of the coordinates.
    pub to_frame: RigidTransform<f64>,
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
        let (heights, from_points) = (kinds.contain(Kind::Plane), kinds.contain(Kind::Point));
        let distances = from_points || kinds.contain(Kind::Distance);
        let poses = inside(&request.robot.robot, &request.robot.reach());
        let mut planes = Vec::new();
        if heights {
            planes.extend(facts.planes.iter().map(|plane| PlaneAt {
                name: plane.name.clone(),
                normal: Vector3::z(),
                offset: plane.height,
                blocks: blocks_or_usual(&plane.blocks),
                known: Plane {
                    known: Some((plane.height, plane.sigma)),
                    level: plane.tilt.map(f64::tan),
                },
            }));
            if planes.is_empty() {
                planes.push(PlaneAt {
                    name: PLANE.to_owned(),
                    normal: Vector3::z(),
                    offset: broadest(&poses),
                    blocks: BLOCKS.to_vec(),
                    known: Plane::default(),
                });
            }
        }
        let points = if from_points {
            points(request.robot, &poses)
        } else {
            Vec::new()
        };
        let measured = [kinds.positions(), heights, distances];
        let (robot, noise_stated) = with_noise(request.robot, measured);
        Self {
            robot,
            planes,
            points,
            on_table: facts.points.iter().all(|point| point.place.is_none()),
            lengths: facts.lengths.unwrap_or((SHORTEST, f64::INFINITY)),
            frame: request.frame,
            to_frame: RigidTransform::identity(),
            noise_stated,
        }
    }

    /// Whether there is only one unnamed plane, which a samples file need not name.
    pub fn has_only_usual_plane(&self) -> bool {
        self.planes.len() == 1 && self.planes.iter().all(|plane| plane.name == PLANE)
    }

    /// A measurement as a row of a samples file, with the nominal robot's readings.
    pub fn row(&self, own: &Planned) -> Observation<f64> {
        let from = match (&own.other, own.point) {
            (Some(other), _) => Some(DistanceFrom::Pose(other.joints)),
            (None, Some(index)) => numbered(index).map(DistanceFrom::Point),
            (None, None) => None,
        };
        let plane = own.plane.and_then(|(index, _)| numbered(index));
        let asked = Observation {
            joints: own.pose.joints,
            position: own.kind.coordinates().map(|read| read.then_some(0.0)),
            height: plane.map(|plane| Height { plane, height: 0.0 }),
            distance: from.map(|from| Distance {
                from,
                distance: 1.0,
            }),
        };
        self.read(&self.robot.robot, &asked)
    }

    /// The same row with another robot's readings; unchanged if that robot does not reach it.
    pub fn read(&self, robot: &Robot<f64>, row: &Observation<f64>) -> Observation<f64> {
        let mut read = *row;
        let Ok(there) = robot.forward(&row.joints) else {
            return read;
        };
        let coordinates = self.to_frame.apply(&there);
        for (cell, coordinate) in read.position.iter_mut().zip(&coordinates) {
            *cell = cell.map(|_| *coordinate);
        }
        if let Some(height) = &mut read.height
            && let Some(plane) = self.planes.get(usize::from(height.plane))
        {
            height.height = plane.normal.dot(&there) - plane.offset;
        }
        if let Some(distance) = &mut read.distance {
            let from = match distance.from {
                DistanceFrom::Pose(joints) => robot.forward(&joints).ok(),
                DistanceFrom::Point(index) => {
                    let point = self.points.get(usize::from(index));
                    point.map(|point| point.place)
                }
            };
            if let Some(from) = from {
                distance.distance = (there - from).norm().max(f64::EPSILON);
            }
        }
        read
    }
}

fn numbered(index: usize) -> Option<u8> {
    u8::try_from(index).ok()
}

pub(super) fn blocks_or_usual(stated: &[f64]) -> Vec<f64> {
    if stated.is_empty() {
        BLOCKS.to_vec()
    } else {
        stated.to_vec()
    }
}

/// The robot with a noise of every kind, stated or typical, and whether the file states it for each kind that is measured:
/// coordinates, heights, distances.
pub(super) fn with_noise(robot: &RobotFile, measured: [bool; 3]) -> (RobotFile, bool) {
    let facts = &robot.instruments;
    let stated = [
        robot.noise.is_some(),
        facts.height_noise.is_some(),
        facts.distance_noise.is_some(),
    ];
    let all_stated = measured
        .iter()
        .zip(stated)
        .all(|(measured, stated)| !measured || stated);
    let joint = facts.joint_noise.unwrap_or(JOINT_DEGREES.to_radians());
    let mut with = robot.clone();
    with.noise = robot.noise.or_else(|| Noise::new(POSITION, joint).ok());
    with.instruments.height_noise = facts.height_noise.or(Some(HEIGHT));
    with.instruments.distance_noise = facts.distance_noise.or(Some(DISTANCE));
    (with, all_stated)
}

/// The height of the plane, such that most poses lie between it and the tallest gauge block.
fn broadest(poses: &[Sample<f64>]) -> f64 {
    let [.., tallest] = BLOCKS;
    let heights = || poses.iter().map(|pose| pose.position.z);
    let lowest = heights().fold(f64::INFINITY, f64::min);
    let highest = heights().fold(f64::NEG_INFINITY, f64::max);
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

/// The points of the robot file at their known places, or else on a table, evenly around the z axis.
fn points(robot: &RobotFile, poses: &[Sample<f64>]) -> Vec<PointAt> {
    let unnamed = |name: &str| PointAt {
        name: name.to_owned(),
        place: Vector3::zeros(),
        lengths: (SHORTEST, f64::INFINITY),
        known: Point::default(),
    };
    let named = robot.instruments.points.iter().map(|point| PointAt {
        lengths: point.lengths.unwrap_or((SHORTEST, f64::INFINITY)),
        known: Point {
            known: point.place,
            offset: point.offset_unknown,
        },
        ..unnamed(&point.name)
    });
    let mut points: Vec<_> = named.collect();
    if points.is_empty() {
        points.extend(POINTS.map(unnamed));
    }
    place(&mut points, poses);
    points
}

/// Places points with unknown positions on a table, evenly around the z axis.
pub(super) fn place(points: &mut [PointAt], poses: &[Sample<f64>]) {
    let squares = poses.iter().map(|pose| pose.position.xy().norm_squared());
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), own| (sum + own, count + 1.0));
    let out = POINTS_OUT * (sum / f64::max(count, 1.0)).square_root();
    let unknown = points.iter().filter(|point| point.known.known.is_none());
    let unknown = unknown.count() as f64;
    let mut index = 0.0;
    for point in points {
        if let Some((place, _)) = point.known.known {
            point.place = place;
            continue;
        }
        let (sine, cosine) = (std::f64::consts::TAU * index / unknown).sine_cosine();
        let place = Vector3::new(out * cosine, out * sine, low(poses));
        point.place = place.map(|c| (c / 10.0).round() * 10.0 + 0.0);
        index += 1.0;
    }
}
