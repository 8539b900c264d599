//! Where the instruments stand and how good they are: what the robot file states, what was asked for, and what
//! is assumed.

use super::kind::Kind;
use super::request::{MeasurementRequest, NoiseOf};
use crate::accuracy::workspace_poses::inside;
use crate::files::robot_file::RobotFile;
use crate::fit::options::Frame;
use crate::planning::poses::Assumptions;
use delta_cal::{Noise, Real, Sample};
use nalgebra::Vector3;

/// The name of the plane in the samples file.
pub const PLANE: &str = "plane";
/// Fixed points stand so far from the z axis as part of the positions' distance from it (root of the mean
/// square).
const POINTS_OUT: f64 = 0.7;
/// Distances are no shorter where nothing is said of them, mm.
pub(super) const SHORTEST: f64 = 50.0;

/// Where the instruments stand and how good they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// The robot, its tolerance, and the noise that is planned for.
    pub robot: RobotFile,
    /// Where the plane crosses the robot's z axis, mm.
    pub plane: f64,
    /// Gauge blocks, mm.
    pub blocks: Vec<f64>,
    /// The fixed points, mm, by name.
    pub points: Vec<(String, Vector3<f64>)>,
    /// Whether the points stand on a table, so that the platform stays above them.
    pub(super) on_table: bool,
    /// The shortest and the longest distance, mm.
    pub lengths: (f64, f64),
    /// The frame of coordinates.
    pub frame: Frame,
    /// Whether the robot file states the noise of all that is measured.
    pub noise_stated: bool,
}

impl Setup {
    /// For a request: what the robot file states, what was asked for, and what is assumed.
    pub fn of(request: &MeasurementRequest<'_>) -> Self {
        Self::new(request, &workspace(request.robot))
    }

    /// `poses`: of the nominal robot, evenly spread.
    pub(super) fn new(request: &MeasurementRequest<'_>, poses: &[Sample<f64>]) -> Self {
        let facts = &request.robot.instruments;
        let wished = |kind: Kind| request.kinds.0.iter().any(|wish| wish.kind == kind);
        let positions = request.kinds.0.iter().any(|wish| wish.kind.is_position());
        let (robot, noise_stated) = with_noise(
            request.robot,
            request.noise,
            [
                positions,
                wished(Kind::Plane),
                wished(Kind::Point) || wished(Kind::Distance),
            ],
        );
        let known = facts.planes.iter().find(|plane| plane.name == PLANE);
        let plane = request.plane.or(known.map(|plane| plane.height));
        let tallest = request.blocks.iter().copied().fold(0.0, f64::max);
        let plane = plane.unwrap_or_else(|| {
            if wished(Kind::Point) {
                low(poses)
            } else {
                broadest(poses, tallest)
            }
        });
        let points = points(request, poses, plane);
        Self {
            robot,
            plane,
            blocks: request.blocks.clone(),
            points,
            on_table: facts.points.iter().all(|point| point.place.is_none()),
            lengths: request.lengths.unwrap_or((SHORTEST, f64::INFINITY)),
            frame: if positions {
                request.frame
            } else {
                Frame::Base
            },
            noise_stated,
        }
    }
}

/// Positions of the nominal robot that stand for its whole workspace.
pub(super) fn workspace(file: &RobotFile) -> Vec<Sample<f64>> {
    inside(&file.robot, &file.reach())
}

/// The robot with a noise of everything: what was asked for, what its file states, or what is typical. And
/// whether the file states it of all that is measured: coordinates, heights, distances.
pub(super) fn with_noise(
    robot: &RobotFile,
    wanted: Option<NoiseOf>,
    [positions, heights, distances]: [bool; 3],
) -> (RobotFile, bool) {
    let facts = &robot.instruments;
    let typical = wanted.unwrap_or_default();
    let mut stated_of_all = true;
    let mut sigma = |measured: bool, stated: Option<f64>, typical: f64| {
        let stated = stated.filter(|_| wanted.is_none());
        stated_of_all &= stated.is_some() || !measured;
        stated.unwrap_or(typical)
    };
    let height = sigma(heights, facts.height_noise, typical.height);
    let distance = sigma(distances, facts.distance_noise, typical.distance);
    let stated = robot.noise.filter(|_| wanted.is_none());
    stated_of_all &= stated.is_some() || !positions;
    let joint = facts
        .joint_noise
        .or(robot.noise.map(|noise| noise.joint()))
        .unwrap_or(Assumptions::JOINT_DEGREES.to_radians());
    let mut robot = robot.clone();
    robot.noise = stated.or_else(|| Noise::new(typical.position, joint).ok());
    robot.instruments.height_noise = Some(height);
    robot.instruments.distance_noise = Some(distance);
    (robot, stated_of_all)
}

/// The height above which, up to the tallest gauge block, most poses lie.
fn broadest(poses: &[Sample<f64>], tallest: f64) -> f64 {
    let heights = || poses.iter().map(|pose| pose.position.z);
    let lowest = heights().fold(f64::INFINITY, f64::min);
    let highest = heights().fold(f64::NEG_INFINITY, f64::max);
    let span = tallest.max(0.1 * (highest - lowest));
    let within = |low: f64| heights().filter(|z| (low..low + span).contains(z)).count();
    let steps = (0..100).map(|step| lowest + (highest - lowest) * f64::from(step) / 100.0);
    let best = steps.max_by_key(|low| within(*low)).unwrap_or(lowest);
    // To a centimetre: nobody places a plate better.
    10.0 * (best / 10.0).round()
}

/// The height below which one pose in ten lies: where a table is.
fn low(poses: &[Sample<f64>]) -> f64 {
    let mut heights: Vec<_> = poses.iter().map(|pose| pose.position.z).collect();
    heights.sort_by(f64::total_cmp);
    let height = heights.get(heights.len() / 10).copied().unwrap_or_default();
    10.0 * (height / 10.0).round()
}

/// Those of the robot file whose place is known, and others on the plane, evenly around the z axis.
fn points(
    request: &MeasurementRequest<'_>,
    poses: &[Sample<f64>],
    plane: f64,
) -> Vec<(String, Vector3<f64>)> {
    let facts = &request.robot.instruments;
    let named = facts.points.iter();
    let known = named.filter_map(|point| Some((point.name.clone(), point.place?.0)));
    let mut points: Vec<_> = known.take(request.points).collect();
    let unplaced = facts.points.iter().filter(|point| point.place.is_none());
    let mut names = unplaced
        .map(|point| point.name.clone())
        .chain(('A'..='Z').map(String::from));
    let squares = poses.iter().map(|pose| pose.position.xy().norm_squared());
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), own| (sum + own, count + 1.0));
    let out = POINTS_OUT * (sum / f64::max(count, 1.0)).square_root();
    #[allow(clippy::cast_precision_loss)] // a handful
    let missing = (request.points.saturating_sub(points.len())) as f64;
    let mut index = 0.0;
    while points.len() < request.points {
        let Some(name) = names.find(|name| points.iter().all(|(taken, _)| taken != name)) else {
            break;
        };
        let (sine, cosine) = (std::f64::consts::TAU * index / missing).sine_cosine();
        let place = Vector3::new(out * cosine, out * sine, plane);
        points.push((name, place.map(|c| (c / 10.0).round() * 10.0 + 0.0)));
        index += 1.0;
    }
    points
}
