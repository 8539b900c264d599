#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use super::super::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationProblem,
    ObservationRow, Plane, Point, PositionFrame,
};
use crate::calibration::{Problem, Settings};
#[cfg(feature = "transmission")]
use crate::robot::Transmission;
use crate::robot::{Robot, SymmetricRobot, TransmissionTolerance};
use crate::samples::{Noise, Triangle};
use nalgebra::Vector3;

/// Everything in every row, in a frame that is turned and shifted.
fn rows(robot: &Robot<f64>) -> [ObservationRow<f64>; 12] {
    core::array::from_fn(|index| {
        #[allow(clippy::cast_precision_loss)]
        let t = index as f64;
        let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
        let other = [0.3 * t.cos(), 0.2, -0.3 * (1.1 * t).sin()];
        let x = robot.forward(&joints).unwrap();
        let from = if index % 3 == 0 {
            DistanceFrom::Pose(other)
        } else {
            DistanceFrom::Point(u8::try_from(index % 2).unwrap())
        };
        let distance = match from {
            DistanceFrom::Pose(_) => (x - robot.forward(&other).unwrap()).norm(),
            DistanceFrom::Point(_) => (x - Vector3::new(50.0, -30.0, -700.0)).norm() + 0.4,
        };
        ObservationRow::new(Observation {
            joints,
            position: [Some(x.y + 3.0), Some(-x.x + 0.02 * x.z), Some(x.z - 5.0)],
            height: Some(Height {
                plane: 0,
                height: x.z + 560.0 + 0.01 * x.x,
            }),
            distance: Some(Distance { from, distance }),
        })
    })
}

/// JᵀJ, Jᵀr and r² of the rows against central differences of the sums of squares of single rows: the
/// derivatives of every kind of reading, away from the start.
#[test]
fn derivatives_are_those_of_the_residuals() {
    check_derivatives::<40, 41, 861>(&SymmetricRobot::PAPER.robot().unwrap(), None);
}

#[cfg(feature = "transmission")]
#[test]
fn derivatives_by_transmissions_are_those_of_the_residuals() {
    let transmissions = [0.01, -0.02, 0.005].map(|size| {
        let numbers = [size, -0.7 * size, 0.4 * size, 0.3 * size, -0.5 * size];
        Transmission::new(numbers).unwrap()
    });
    let robot = SymmetricRobot::PAPER
        .robot()
        .unwrap()
        .with_transmissions(transmissions)
        .unwrap();
    let tolerance = TransmissionTolerance::new(1e-3).unwrap();
    check_derivatives::<55, 56, 1596>(&robot, Some(tolerance));
}

fn check_derivatives<const N: usize, const M: usize, const E: usize>(
    robot: &Robot<f64>,
    transmission: Option<TransmissionTolerance<f64>>,
) {
    let instruments = Instruments {
        frame: PositionFrame::Sensor,
        planes: &[Plane::default()],
        points: &[
            Point {
                known: None,
                offset: true,
            },
            Point::default(),
        ],
        noise: ObservationNoise::new(Noise::by_axis([0.02, 0.03, 0.1], 1e-4).unwrap(), 0.05, 0.03)
            .unwrap(),
        transmission,
    };
    assert_eq!(24 + instruments.unknowns(), N);
    let mut rows = rows(robot);
    let problem = ObservationProblem::<f64, N>::prepare(robot, &instruments, &mut rows).unwrap();
    let correction: [f64; N] = core::array::from_fn(|index| {
        #[allow(clippy::cast_precision_loss)]
        let t = index as f64;
        2e-3 * (1.3 * t).sin()
    });
    let at = |correction: &[f64; N]| Problem::<f64, N, M, E>::displaced(&problem, correction);
    for piece in 0..12 {
        let mut normal = Triangle::<f64, M, E>::zero();
        let sum = problem
            .linearize(&at(&correction), &mut normal, piece)
            .sum_of_squares;
        let whole = Problem::<f64, N, M, E>::sum_of_squares(&problem, &at(&correction), piece);
        assert!((sum / whole.sum_of_squares - 1.0).abs() < 1e-12);
        // RᵀR, of which the last column is Jᵀr.
        let product = |left: usize, right: usize| -> f64 {
            let rows = normal.rows().enumerate().take(left + 1);
            rows.map(|(index, row)| row[left - index] * row[right - index])
                .sum()
        };
        for parameter in 0..N {
            let step = 1e-5;
            let [up, down] = [step, -step].map(|step| {
                let mut moved = correction;
                moved[parameter] += step;
                let at = at(&moved);
                Problem::<f64, N, M, E>::sum_of_squares(&problem, &at, piece).sum_of_squares
            });
            // ∂(rᵀr)/∂p = 2 Jᵀr. A step of 1e-5 leaves 1e-10 of the third derivative, and rounding ε r²/step.
            let expected = (up - down) / (4.0 * step);
            let found = product(parameter, N);
            let scale = (product(parameter, parameter) * sum).sqrt();
            let rounding = 4.0 * f64::EPSILON * sum / step;
            assert!(
                (found - expected).abs() < 1e-6 * scale + rounding,
                "row {piece}, parameter {parameter}: {found} {expected} {scale}"
            );
        }
    }
}

/// An exact measurement of another robot gives that robot, from nominal.
#[test]
fn exact_readings_return_the_robot() {
    let robot = SymmetricRobot::PAPER.robot().unwrap();
    let built = SymmetricRobot {
        base_radius: 194.4,
        platform_radius: 30.0,
        upper_arm: 260.7,
        forearm: 479.1,
    }
    .robot()
    .unwrap();
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[],
        points: &[Point::default()],
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.02).unwrap(),
        transmission: None,
    };
    let place = Vector3::new(40.0, 120.0, -300.0);
    let mut rows: [ObservationRow<f64>; 30] = core::array::from_fn(|index| {
        #[allow(clippy::cast_precision_loss)]
        let t = index as f64;
        let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
        let x = built.forward(&joints).unwrap();
        ObservationRow::new(Observation {
            position: [(index % 3 != 0).then_some(x.x), Some(x.y), Some(x.z)],
            distance: Some(Distance {
                from: DistanceFrom::Point(0),
                distance: (x - place).norm(),
            }),
            ..Observation::at(joints)
        })
    });
    let problem = ObservationProblem::<f64, 27>::prepare(&robot, &instruments, &mut rows).unwrap();
    let mut minimizer = problem.minimizer::<28, 406>(&Settings::new()).unwrap();
    while minimizer.step(&problem) == crate::Progress::Working {}
    let outcome = problem
        .outcome(&minimizer.estimate(&problem).unwrap())
        .unwrap();
    for (found, expected) in outcome.robot.arms().iter().zip(built.arms()) {
        for (found, expected) in found.parameters().iter().zip(expected.parameters()) {
            // Rounding of the residuals, 1e-13 mm, times a condition of some 1e4.
            assert!((found - expected).abs() < 1e-7, "{found} {expected}");
        }
    }
    let [x, y, z, offset] = outcome.point(&instruments, 0);
    assert!((Vector3::new(x, y, z) - place).norm() < 1e-7 && offset == 0.0);
}
