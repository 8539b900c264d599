#![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

use crate::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationError, ObservationNoise,
    ObservationProblem, ObservationRow, Plane, Point, PositionFrame,
};
use crate::robot::{Robot, SymmetricRobot};
use crate::samples::Noise;
use nalgebra::{SMatrix, Vector3};

const PLANES: [Plane<f64>; 1] = [Plane {
    known: Some((-560.0, 1.0)),
    level: Some(1e-9),
}];
const POINTS: [Point<f64>; 1] = [Point {
    known: Some((Vector3::new(50.0, -30.0, -700.0), 1.0)),
    offset: false,
}];

fn robot() -> Robot<f64> {
    SymmetricRobot::PAPER.robot().unwrap()
}

/// Too short for level upper arms: near those the forearms lie nearly in a plane.
fn short_forearms() -> Robot<f64> {
    let robot = SymmetricRobot {
        forearm: 420.0,
        ..SymmetricRobot::PAPER
    };
    robot.robot().unwrap()
}

fn instruments() -> Instruments<'static, f64> {
    Instruments {
        frame: PositionFrame::Base,
        planes: &PLANES,
        points: &POINTS,
        noise: ObservationNoise::new(Noise::by_axis([0.02, 0.03, 0.1], 1e-4).unwrap(), 0.05, 0.04)
            .unwrap(),
        transmission: None,
    }
}

fn joints(index: usize) -> [f64; 3] {
    let t = index as f64;
    [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()]
}

/// Every kind of reading, in rows that hold all, some or one of them.
fn observation(index: usize) -> Observation<f64> {
    let own = joints(index);
    let from = if index.is_multiple_of(2) {
        DistanceFrom::Pose(joints(index + 5))
    } else {
        DistanceFrom::Point(0)
    };
    let [x, y, z, height, distance] = readings(&own, &joints(index + 5), &from);
    Observation {
        position: [
            (index % 3 != 1).then_some(x),
            Some(y),
            (index % 4 != 2).then_some(z),
        ],
        height: (index % 5 != 3).then_some(Height { plane: 0, height }),
        distance: (index % 7 != 4).then_some(Distance { from, distance }),
        ..Observation::at(own)
    }
}

/// x, y, z, height and distance at joint angles.
fn readings(own: &[f64; 3], other: &[f64; 3], from: &DistanceFrom<f64>) -> [f64; 5] {
    let x = robot().forward(own).unwrap();
    let other = match from {
        DistanceFrom::Pose(_) => robot().forward(other).unwrap(),
        DistanceFrom::Point(_) => Vector3::new(50.0, -30.0, -700.0),
    };
    [x.x, x.y, x.z, x.z + 560.0, (x - other).norm()]
}

/// The noise of the reading itself, and of both poses' joint angles by central differences.
#[test]
fn a_row_is_weighed_by_the_covariance_of_its_readings() {
    let (robot, instruments) = (robot(), instruments());
    let mut rows: [ObservationRow<f64>; 24] =
        core::array::from_fn(|index| ObservationRow::new(observation(index)));
    let problem = ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut rows).unwrap();
    for (index, row) in problem.rows().iter().enumerate() {
        let observation = *row.observation();
        let from = observation.distance.map(|distance| distance.from);
        let between = matches!(from, Some(DistanceFrom::Pose(_)));
        let from = from.unwrap_or(DistanceFrom::Point(0));
        let mut by_joints = SMatrix::<f64, 5, 6>::zeros();
        for joint in 0..6 {
            let [above, below] = [1e-6, -1e-6].map(|by| {
                let mut both = [joints(index), joints(index + 5)];
                both.as_flattened_mut()[joint] += by;
                readings(&both[0], &both[1], &from)
            });
            for reading in 0..5 {
                if joint < 3 || (between && reading == 4) {
                    by_joints[(reading, joint)] = (above[reading] - below[reading]) / 2e-6;
                }
            }
        }
        let [x, y, z] = observation.position.map(|own| own.is_some());
        let read = [
            x,
            y,
            z,
            observation.height.is_some(),
            observation.distance.is_some(),
        ];
        let mut expected = by_joints * by_joints.transpose() * 1e-8;
        for (reading, sigma) in [0.02, 0.03, 0.1, 0.05, 0.04].into_iter().enumerate() {
            expected[(reading, reading)] += sigma * sigma;
            if !read[reading] {
                expected.row_mut(reading).fill(0.0);
                expected.column_mut(reading).fill(0.0);
                expected[(reading, reading)] = 1.0;
            }
        }
        let factor = SMatrix::<f64, 5, 5>::from_fn(|row_, column| row.factor[row_][column]);
        let found = factor * factor.transpose();
        // Differences over 1e-6 rad keep eight digits.
        assert!((found - expected).amax() < 1e-6 * expected.amax());

        // Σ 1/Lₖₖ² times |X|² + Lb².
        let size = robot.forward(&joints(index)).unwrap().norm_squared() + 480.0 * 480.0;
        let pivots = (0..5).filter(|reading| read[*reading]);
        let squares: f64 = pivots
            .map(|k| 1.0 / (factor[(k, k)] * factor[(k, k)]))
            .sum();
        assert!((row.terms_squared(&robot) / (squares * size) - 1.0).abs() < 1e-12);
        let mut twice = *row;
        twice.set_weight(2.0);
        let start = problem.prepared.start();
        let residuals = |row: &ObservationRow<f64>| {
            let built = Robot::from_parameters(robot.parameters().map(|mut arm| {
                arm[5] += 0.3;
                arm
            }));
            let built = built.unwrap();
            row.residuals(&built, &instruments, start, start.unknowns())
        };
        let (once, doubled) = (residuals(row).unwrap(), residuals(&twice).unwrap());
        assert!(once.iter().any(|residual| residual.abs() > 0.1));
        for (once, doubled) in once.into_iter().zip(doubled) {
            assert!((doubled - libm::sqrt(2.0) * once).abs() <= 1e-14 * once.abs());
        }
        assert!((twice.terms_squared(&robot) / (2.0 * squares * size) - 1.0).abs() < 1e-12);
    }
}

/// A pose is steep where one of the forearms, made longer, moves the platform by more than three times as much: by
/// central differences.
#[test]
fn poses_that_errors_of_a_forearm_move_far_are_steep() {
    let robot = short_forearms();
    let moves = |joints: &[f64; 3]| -> Option<f64> {
        let mut largest: f64 = 0.0;
        for arm in 0..3 {
            let at = |by: f64| {
                let mut parameters = robot.parameters();
                parameters[arm][7] += by;
                let robot = Robot::from_parameters(parameters).ok()?;
                robot.forward(joints).ok()
            };
            largest = largest.max((at(1e-4)? - at(-1e-4)?).norm() / 2e-4);
        }
        Some(largest)
    };
    let poses = || (0..400).map(|index| joints(index).map(|q| 0.2 + 1.5 * q));
    let (mut steep, mut clear, mut other_alone) = (0, 0, 0);
    for (own, other) in poses().zip(poses().skip(1)) {
        let (Some(of_own), Some(of_other)) = (moves(&own), moves(&other)) else {
            continue;
        };
        let distance = Distance {
            from: DistanceFrom::Pose(other),
            distance: 1.0,
        };
        for (distance, largest) in [(None, of_own), (Some(distance), of_own.max(of_other))] {
            let mut row = ObservationRow::new(Observation {
                position: [Some(1.0), None, None],
                distance,
                ..Observation::at(own)
            });
            row.look_whether_reached(&robot).unwrap();
            assert!(!row.is_left_out());
            // As near to the limit the differences do not tell.
            if (largest - 3.0).abs() > 1e-2 {
                assert_eq!(row.is_steep(), largest > 3.0, "{largest}");
                steep += u32::from(largest > 3.0);
                clear += u32::from(largest < 3.0);
                other_alone += u32::from(largest > 3.0 && of_own < 3.0);
            }
        }
    }
    assert!(
        steep > 20 && clear > 20 && other_alone > 5,
        "{steep} {clear} {other_alone}"
    );
}

/// Two poses are the same place if they are nearer than √ε of the distance from the base.
#[test]
fn a_distance_needs_two_places() {
    let robot = robot();
    let own = joints(4);
    let x = robot.forward(&own).unwrap();
    for (part, same) in [(0.0, true), (0.5, true), (2.0, false), (1e6, false)] {
        let apart = Vector3::new(0.3, -0.4, 0.5).normalize() * (part * 1.5e-8 * x.norm());
        let other = robot.inverse(&(x + apart)).unwrap();
        let mut row = ObservationRow::new(Observation {
            distance: Some(Distance {
                from: DistanceFrom::Pose(other),
                distance: 1.0,
            }),
            ..Observation::at(own)
        });
        let expected = if same {
            Err(ObservationError::SamePlace)
        } else {
            Ok(())
        };
        assert_eq!(row.look_whether_reached(&robot), expected, "{part}");
    }
    // Of a pose out of reach nothing is known.
    let mut row = ObservationRow::new(Observation {
        position: [Some(1.0), None, None],
        ..Observation::at([0.0; 3])
    });
    row.look_whether_reached(&short_forearms()).unwrap();
    assert!(row.is_left_out() && !row.is_steep());
}

/// Of a noise that no number holds rounding is left: four ε of the robot's size.
#[test]
fn rounding_is_a_noise_too() {
    let robot = robot();
    let instruments = Instruments {
        noise: ObservationNoise::new(Noise::new(1.0, 0.0).unwrap(), 1e-15, 1.0).unwrap(),
        points: &[],
        ..instruments()
    };
    let mut rows: [ObservationRow<f64>; 4] = core::array::from_fn(|index| {
        ObservationRow::new(Observation {
            height: Some(Height {
                plane: 0,
                height: 60.0,
            }),
            ..Observation::at(joints(index))
        })
    });
    let problem = ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut rows).unwrap();
    for (index, row) in problem.rows().iter().enumerate() {
        let size = robot.forward(&joints(index)).unwrap().norm_squared() + 480.0 * 480.0;
        let expected = 4.0 * f64::EPSILON * libm::sqrt(size);
        assert!((row.factor[3][3] / expected - 1.0).abs() < 1e-5);
    }
}
