//! Deviations of heights, distances and single coordinates: planes, points and a frame of which nothing is known are fitted
//! to the readings first, with the robot as it is.

use super::interval::{RowDeviation, RowNoise};
use crate::files::robot_file::{KnownPlane, RobotFile};
use crate::files::samples_file::{Kind, READINGS, Reading, ReadingFrom, Readings};
use crate::fit::solution::{Places, Solution};
use crate::fit::{Frame, Options, Unsolved, solve};
use delta_cal::{Robot, Sample, Tolerance};
use nalgebra::Vector3;

/// So near the robot stays to its file while the instruments are found: this part of the forearm, and radians.
const HELD: f64 = 1e-8;

/// A plane of which nothing is known is so far away, in forearms, and tilted by this angle, radians.
const ANYWHERE: f64 = 10.0;
const TILT: f64 = 0.1;

/// Every reading's deviation.
pub(super) struct Deviations {
    pub(super) rows: Vec<RowDeviation>,
    pub(super) places: Places,
    /// How many readings the unknowns of the instruments took up.
    pub(super) taken_up: f64,
    /// Readings of a row, on average.
    pub(super) coordinates: f64,
}

/// Of readings of any kind, with a frame that is known or to be found.
///
/// # Errors
/// Readings that do not determine where the instruments are, or that this robot cannot have.
pub(super) fn deviations(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
) -> Result<Deviations, Unsolved> {
    let [arm, ..] = robot.robot.arms();
    let mut held = robot.clone();
    held.tolerance = Tolerance::new(HELD * arm.lb(), HELD).ok();
    held.transmission = None;
    // A robot that is off is no reason to refuse: the noise is what the deviations show.
    held.noise = None;
    held.instruments.height_noise = None;
    held.instruments.distance_noise = None;
    // Poses above one another do not show a plane's tilt: it is nearly level then.
    for name in &readings.planes {
        if held
            .instruments
            .planes
            .iter()
            .all(|plane| plane.name != *name)
        {
            held.instruments.planes.push(KnownPlane {
                name: name.clone(),
                line: 0,
                height: 0.0,
                sigma: ANYWHERE * arm.lb(),
                tilt: Some(TILT),
                blocks: Vec::new(),
            });
        }
    }
    let options = Options {
        frame,
        ..Options::default()
    };
    let solution = solve(&held, readings, &options)?;
    let (mut rows, mut taken_up, mut coordinates) = (Vec::new(), 0.0, 0.0);
    for (index, row) in readings.rows.iter().enumerate() {
        let leverage = solution.rows[index].leverage;
        for kind in Kind::ALL {
            let Some((own, used, count)) = deviation(robot, &solution, &row.value, kind, leverage)
            else {
                continue;
            };
            rows.push(RowDeviation {
                line: row.line,
                ..own
            });
            taken_up += used;
            coordinates += count;
        }
    }
    let count = rows.iter().fold(0.0, |count: f64, _| count + 1.0);
    Ok(Deviations {
        rows,
        places: solution.places,
        taken_up,
        coordinates: coordinates / count.max(1.0),
    })
}

/// Of the readings of one kind in a row, with how much of them was taken up and how many they are.
fn deviation(
    robot: &RobotFile,
    solution: &Solution,
    reading: &Reading,
    kind: Kind,
    leverage: [f64; READINGS],
) -> Option<(RowDeviation, f64, f64)> {
    let position = robot.robot.forward(&reading.joints).ok()?;
    let by_joints = robot
        .robot
        .platform_jacobian(&position, &reading.joints)
        .ok()?
        .by_joints;
    let expected = solution.places.expected(&robot.robot, reading);
    let mut off = Vector3::zeros();
    let (mut used, mut count) = (0.0, 0.0);
    let (mut variance, mut largest, mut squares) = (Some(0.0), 0.0_f64, 0.0);
    for (place, read) in reading.read().into_iter().enumerate() {
        let (Some(read), Some(expected), true) =
            (read, expected[place], Kind::of_place(place) == kind)
        else {
            continue;
        };
        let axis = if kind == Kind::Position { place } else { 2 };
        off[axis] = read - expected;
        used += leverage[place];
        count += 1.0;
        let own = noise(robot, kind, axis).map(|(sigma, joint)| {
            let along = direction(robot, &solution.places, reading, place, &position);
            let by_joint = along.map_or(0.0, |along| {
                (by_joints.tr_mul(&along) * joint).norm_squared()
            });
            sigma * sigma + by_joint
        });
        variance = variance.zip(own).map(|(sum, own)| sum + own);
        largest = largest.max(own.unwrap_or_default().sqrt());
        squares += own.map_or(0.0, |own| off[axis].powi(2) / own);
    }
    (count > 0.0).then(|| {
        let own = RowDeviation {
            line: 0,
            measured: Sample {
                joints: reading.joints,
                position,
            },
            deviation: off,
            leverage: used / count,
            noise: variance.map(|mean_square| RowNoise {
                mean_square,
                largest,
                squares,
            }),
        };
        (own, used, count)
    })
}

/// σ of a reading and of the joints, if they are stated.
fn noise(robot: &RobotFile, kind: Kind, axis: usize) -> Option<(f64, f64)> {
    let facts = &robot.instruments;
    let joint = robot.noise.map(|own| own.joint()).or(facts.joint_noise);
    let sigma = match kind {
        Kind::Position => robot.noise.map(|own| own.position_by_axis()[axis]),
        Kind::Height => facts.height_noise,
        Kind::Distance => facts.distance_noise,
    };
    Some((sigma?, joint.unwrap_or_default()))
}

/// ∂h/∂X of a reading.
fn direction(
    robot: &RobotFile,
    places: &Places,
    reading: &Reading,
    place: usize,
    position: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let from = |robot: &Robot<f64>, joints: &[f64; 3]| robot.forward(joints).ok();
    match Kind::of_place(place) {
        Kind::Position => Some(match &places.frame {
            Some(frame) => frame.rotation.row(place).transpose(),
            None => Vector3::ith(place, 1.0),
        }),
        Kind::Height => Some(places.planes.get(reading.height?.0)?.normal),
        Kind::Distance => {
            let begin = match reading.distance?.0 {
                ReadingFrom::Point(point) => places.points.get(point)?.place,
                ReadingFrom::Pose(joints) => from(&robot.robot, &joints)?,
            };
            Some((position - begin).normalize())
        }
    }
}
