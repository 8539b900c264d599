#![allow(clippy::cast_precision_loss, clippy::unwrap_used)]

use super::StartValues;
use crate::frame::RigidTransform;
use crate::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationRow,
    Plane, Point, PositionFrame,
};
use crate::robot::{Robot, SymmetricRobot};
use crate::samples::Noise;
use nalgebra::{Rotation3, Vector3};

fn robot() -> Robot<f64> {
    SymmetricRobot::PAPER.robot().unwrap()
}

fn joints(index: usize) -> [f64; 3] {
    let t = index as f64;
    [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()]
}

fn instruments<'a>(
    frame: PositionFrame,
    planes: &'a [Plane<f64>],
    points: &'a [Point<f64>],
) -> Instruments<'a, f64> {
    Instruments {
        frame,
        planes,
        points,
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.05).unwrap(),
        transmission: None,
    }
}

/// Coordinates of the nominal robot in a frame that is turned and shifted, some of each pose: the start is that
/// frame, along the axes that were measured.
#[test]
fn the_frame_is_found_whatever_coordinates_were_measured() {
    let robot = robot();
    let frame = RigidTransform {
        rotation: *Rotation3::new(Vector3::new(0.3, -0.5, 0.8)).matrix(),
        translation: Vector3::new(40.0, -70.0, 300.0),
    };
    let instruments = instruments(PositionFrame::Sensor, &[], &[]);
    for pattern in [
        // All of each pose; all, by turns; two of them.
        [[true; 3]; 2],
        [[true, false, true], [false, true, false]],
        [[true, true, false]; 2],
        [[false, true, true]; 2],
        [[true, false, true]; 2],
    ] {
        let rows: [ObservationRow<f64>; 40] = core::array::from_fn(|index| {
            let joints = joints(index);
            let measured = frame.apply(&robot.forward(&joints).unwrap());
            let seen = pattern[index % 2];
            ObservationRow::new(Observation {
                position: core::array::from_fn(|axis| seen[axis].then(|| measured[axis])),
                ..Observation::at(joints)
            })
        });
        let start = StartValues::<f64, 30>::of(&robot, &instruments, &rows);
        // ε times lengths of some hundreds times a condition of some tens.
        assert!((start.frame().rotation - frame.rotation).amax() < 1e-10);
        let seen = [0, 1, 2].map(|axis| pattern.iter().any(|own| own[axis]));
        for (axis, seen) in seen.into_iter().enumerate() {
            let expected = if seen { frame.translation[axis] } else { 0.0 };
            assert!((start.frame().translation[axis] - expected).abs() < 1e-8);
        }
    }
}

/// A shift along an axis is seen where that was measured, a turn about it where another was.
#[test]
fn the_numbers_of_the_frame_that_nothing_was_measured_of_are_free() {
    for pattern in 1..8 {
        let seen = [1, 2, 4].map(|bit| pattern & bit != 0);
        let rows = [ObservationRow::new(Observation {
            position: seen.map(|seen| seen.then_some(1.0)),
            ..Observation::at(joints(1))
        })];
        let start = StartValues::<f64, 30>::of(
            &robot(),
            &instruments(PositionFrame::Sensor, &[], &[]),
            &rows,
        );
        for axis in 0..3 {
            assert_eq!(start.is_free(axis), !seen[axis]);
            let others = (0..3).any(|other| other != axis && seen[other]);
            assert_eq!(start.is_free(3 + axis), !others);
        }
        assert!(start.is_free(6));
    }
}

/// Touches of the nominal robot at 60 mm above a plane, square to it: the plane itself; or the level one at their mean,
/// where the tilt is known to be small, cannot be told or is more than 45°.
#[test]
fn the_plane_is_that_of_the_touches() {
    let unknown = Plane {
        known: None,
        level: None,
    };
    let level = Plane {
        level: Some(0.01),
        ..unknown
    };
    for (plane, [a, b], [wide, narrow], tilted) in [
        (unknown, [0.2, -0.3], [90.0, 80.0], true),
        (unknown, [-0.1, 0.4], [30.0, 90.0], true),
        (level, [0.02, -0.03], [90.0, 80.0], false),
        // Nearly on a line: of the variance across it a thousandth of that along it is asked for.
        (unknown, [0.2, -0.3], [90.0, 4.5], true),
        (unknown, [0.2, -0.3], [90.0, 1.8], false),
        (unknown, [2.0, 0.0], [20.0, 20.0], false),
    ] {
        let robot = robot();
        let mut mean = 0.0;
        let rows: [ObservationRow<f64>; 30] = core::array::from_fn(|index| {
            let turn = core::f64::consts::PI * index as f64 / 15.0;
            let (sine, cosine) = libm::sincos(turn);
            let (x, y) = (30.0 + wide * cosine, -20.0 + narrow * sine);
            let z = -560.0 + a * x + b * y + 60.0 * libm::sqrt(1.0 + a * a + b * b);
            mean += (z - 60.0) / 30.0;
            let joints = robot.inverse(&Vector3::new(x, y, z)).unwrap();
            ObservationRow::new(Observation {
                height: Some(Height {
                    plane: 0,
                    height: 60.0,
                }),
                ..Observation::at(joints)
            })
        });
        let planes = [plane];
        let of_plane = instruments(PositionFrame::Base, &planes, &[]);
        let start = StartValues::<f64, 27>::of(&robot, &of_plane, &rows);
        let [.., c, found_a, found_b] = *start.unknowns();
        let expected = if tilted {
            [-560.0, a, b]
        } else {
            [mean, 0.0, 0.0]
        };
        // ε times lengths of some hundreds times a condition of some thousands.
        assert!(
            (found_a - expected[1]).abs() < 1e-9,
            "{found_a} {expected:?}"
        );
        assert!(
            (found_b - expected[2]).abs() < 1e-9,
            "{found_b} {expected:?}"
        );
        assert!((c - expected[0]).abs() < 1e-7, "{c} {expected:?}");
    }
}

/// Exact distances from a point, with an offset that the sensor adds or without: both in closed form.
#[test]
fn the_point_is_that_of_the_distances() {
    let robot = robot();
    let place = Vector3::new(120.0, -80.0, -700.0);
    for offset in [None, Some(7.0), Some(-4.0)] {
        let rows: [ObservationRow<f64>; 30] = core::array::from_fn(|index| {
            let joints = joints(index);
            let x = robot.forward(&joints).unwrap();
            let distance = (x - place).norm() + offset.unwrap_or(0.0);
            let from = DistanceFrom::Point(0);
            ObservationRow::new(Observation {
                distance: Some(Distance { from, distance }),
                ..Observation::at(joints)
            })
        });
        let points = [Point {
            known: None,
            offset: offset.is_some(),
        }];
        let of_point = instruments(PositionFrame::Base, &[], &points);
        let start = StartValues::<f64, 28>::of(&robot, &of_point, &rows);
        let [.., x, y, z, found] = *start.unknowns();
        // ε times lengths of some hundreds times a condition of some thousands.
        assert!((Vector3::new(x, y, z) - place).norm() < 1e-8);
        assert!((found - offset.unwrap_or(0.0)).abs() < 1e-8);
        // Of two poses there is no such point.
        let start = StartValues::<f64, 28>::of(&robot, &of_point, &rows[..2]);
        assert!(start.unknowns().iter().all(|value| *value == 0.0));
    }
}
