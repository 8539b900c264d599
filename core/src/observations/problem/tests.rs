#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use super::super::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationError, ObservationNoise,
    ObservationProblem, ObservationRow, Plane, Point, PositionFrame, TouchCalibrator,
};
use crate::calibration::{
    Instrument, Problem, Progress, Refusal, Settings, Tolerance, sum_of_squares,
};
use crate::frame::RigidTransform;
#[cfg(feature = "transmission")]
use crate::robot::Transmission;
use crate::robot::{Drive, Robot, SymmetricRobot, TransmissionTolerance};
use crate::samples::{Noise, Triangle};
use nalgebra::{Rotation3, Vector3};

/// Every reading in every row, in a rotated and shifted frame.
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

/// JᵀJ, Jᵀr and r² of the rows against central differences of the sums of squares of single rows: the derivatives of
/// every kind of reading, away from the start.
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
    let mut total = 0.0;
    for piece in 0..12 {
        let mut normal = Triangle::<f64, M, E>::zero();
        let sum = problem
            .linearize(&at(&correction), &mut normal, piece)
            .sum_of_squares;
        let whole = Problem::<f64, N, M, E>::sum_of_squares(&problem, &at(&correction), piece);
        assert!((sum / whole.sum_of_squares - 1.0).abs() < 1e-12);
        assert_eq!(whole.more, piece < 11);
        total += sum;
        // RᵀR; its last column is Jᵀr.
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
            // ∂(rᵀr)/∂p = 2 Jᵀr. A step of 1e-5 leaves 1e-10 of the third derivative, and rounding of ε r²/step.
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
    let all = sum_of_squares::<f64, _, N, M, E>(&problem, &at(&correction));
    assert!((all / total - 1.0).abs() < 1e-12);
}

/// Exact measurements of another robot yield that robot, from nominal.
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
    let outcome = problem.solve::<28, 406>(&Settings::new()).unwrap();
    for (found, expected) in outcome.robot.arms().iter().zip(built.arms()) {
        for (found, expected) in found.parameters().iter().zip(expected.parameters()) {
            // Rounding of the residuals, 1e-13 mm, times a condition number of about 1e4.
            assert!((found - expected).abs() < 1e-7, "{found} {expected}");
        }
    }
    let [x, y, z, offset] = outcome.point(&instruments, 0);
    assert!((Vector3::new(x, y, z) - place).norm() < 1e-7 && offset == 0.0);
}

/// Known values of transmissions, planes and points, each divided by its σ; 0 for other unknowns, and 1 at unused
/// places.
#[cfg(feature = "transmission")]
#[test]
fn the_prior_weighs_what_is_known_of_the_instruments() {
    let robot = SymmetricRobot::PAPER.robot().unwrap();
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[
            Plane {
                known: Some((-560.0, 0.5)),
                level: Some(0.01),
            },
            Plane::default(),
        ],
        points: &[
            Point {
                known: Some((Vector3::new(50.0, -30.0, -700.0), 2.0)),
                offset: true,
            },
            Point::default(),
        ],
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.05, 0.03).unwrap(),
        transmission: Some(TransmissionTolerance::new(1e-3).unwrap()),
    };
    let mut measured: [ObservationRow<f64>; 24] = core::array::from_fn(|index| {
        let mut observation = *rows(&robot)[index % 12].observation();
        observation.position = [None; 3];
        if let Some(height) = &mut observation.height {
            height.plane = u8::from(index >= 12);
        }
        ObservationRow::new(observation)
    });
    let problem = ObservationProblem::<f64, 55>::prepare(&robot, &instruments, &mut measured);
    let problem = problem.unwrap();
    let tolerance = Tolerance::new(0.5, 0.003).unwrap();
    let prior = problem.prior(&Settings::new().with_tolerance(tolerance));
    let mut sigmas = [[0.5, 0.5, 0.5, 0.003, 0.003, 0.5, 0.5, 0.5]; 3]
        .as_flattened()
        .iter();
    let [plane, level, point] = [0.5, 0.01, 2.0].map(Some);
    let unknowns = [
        [plane, level, level, None, None, None].as_slice(),
        &[point, point, point, None, None, None, None],
    ]
    .concat();
    for (place, weight) in prior.weights().iter().enumerate() {
        let sigma = match place {
            0..24 => sigmas.next().copied(),
            24..39 => Some(1e-3),
            _ => unknowns.get(place - 39).copied().unwrap_or(None),
        };
        let unit = Problem::<f64, 55, 56, 1596>::unit_of(&problem, place);
        let expected = match sigma {
            Some(sigma) => unit / sigma,
            None if place < 39 + unknowns.len() => 0.0,
            None => 1.0,
        };
        assert!((weight - expected).abs() <= 1e-12 * expected, "{place}");
    }
}

/// A row's Jacobian at the start against the JᵀJ that the problem absorbs, and against central differences of its
/// residuals.
#[test]
fn the_jacobian_of_a_row_is_that_of_its_residuals() {
    let robot = SymmetricRobot::PAPER.robot().unwrap();
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[Plane::default()],
        points: &[Point::default(); 2],
        noise: ObservationNoise::new(Noise::new(0.02, 1e-4).unwrap(), 0.05, 0.03).unwrap(),
        transmission: None,
    };
    let mut rows = rows(&robot);
    let problem = ObservationProblem::<f64, 33>::prepare(&robot, &instruments, &mut rows).unwrap();
    assert!(problem.linearized::<34>(12).is_none());
    // Five readings per row.
    let readings = Problem::<f64, 33, 34, 595>::residuals(&problem);
    assert!((readings - 60.0).abs() < 1e-12);
    for row in 0..12 {
        let columns = problem.linearized::<34>(row).unwrap();
        let mut normal = Triangle::<f64, 34, 595>::zero();
        let at = Problem::<f64, 33, 34, 595>::displaced(&problem, &[0.0; 33]);
        problem.linearize(&at, &mut normal, row);
        for left in 0..34 {
            for right in left..34 {
                let pairs = columns[left].iter().zip(columns[right]);
                let expected: f64 = pairs.map(|(a, b)| a * b).sum();
                let found = normal.rows().enumerate().take(left + 1);
                let found: f64 = found
                    .map(|(index, row)| row[left - index] * row[right - index])
                    .sum();
                let scale = |column: usize| columns[column].iter().map(|a| a * a).sum::<f64>();
                let scale = libm::sqrt(scale(left) * scale(right));
                assert!((found - expected).abs() <= 1e-12 * scale);
            }
        }
    }
}

/// One step to locate the instruments, one per row, and those of the minimisation: bit-identical to a one-call solve,
/// and no observation can interfere.
#[test]
fn the_steps_end_with_the_outcome_of_the_problem() {
    let robot = SymmetricRobot::PAPER.robot().unwrap();
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[Plane::default()],
        points: &[],
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.02).unwrap(),
        transmission: None,
    };
    let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
    let measured: [Observation<f64>; 30] = core::array::from_fn(|index| {
        #[allow(clippy::cast_precision_loss)]
        let t = index as f64;
        let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
        let height = robot.forward(&joints).unwrap().z + 560.0 + 0.05 * (5.0 * t).sin();
        Observation {
            height: Some(Height { plane: 0, height }),
            ..Observation::at(joints)
        }
    });
    let mut calibrator = TouchCalibrator::<f64, 31>::new(&robot, &instruments, &settings).unwrap();
    let refusal = calibrator.solve().unwrap_err();
    assert!(matches!(
        refusal,
        Refusal::TooFewSamples {
            samples: 0,
            needed: 1,
            ..
        }
    ));
    assert_eq!(calibrator.outcome(), Err(refusal));
    for observation in &measured {
        calibrator.add(observation).unwrap();
    }
    assert_eq!(calibrator.outcome(), Err(Refusal::Unfinished));
    calibrator.solve().unwrap();
    let mut steps = 1;
    while calibrator.step() == Progress::Working {
        steps += 1;
        assert_eq!(calibrator.add(&measured[0]), Err(ObservationError::Busy));
        assert_eq!(calibrator.outcome(), Err(Refusal::Unfinished));
    }
    assert!((40..500).contains(&steps), "{steps}");
    let found = calibrator.outcome().cloned();
    let mut rows = measured.map(ObservationRow::new);
    let problem = ObservationProblem::<f64, 27>::prepare(&robot, &instruments, &mut rows);
    assert_eq!(found, problem.unwrap().solve::<28, 406>(&settings));
    assert!(found.is_ok());

    // One more, and no further one.
    calibrator.add(&measured[0]).unwrap();
    assert_eq!(calibrator.outcome(), Err(Refusal::Unfinished));
    assert_eq!(calibrator.add(&measured[0]), Err(ObservationError::Full));
    calibrator.reset();
    assert_eq!(calibrator.samples(), 0);
    for observation in &measured {
        calibrator.add(observation).unwrap();
    }
    assert_eq!(calibrator.calibrate(), found);

    let two = Instruments {
        planes: &[Plane::default(); 2],
        ..instruments
    };
    let refused = Refusal::TooManyUnknowns { parameters: 30 };
    let made = TouchCalibrator::<f64, 31>::new(&robot, &two, &settings);
    assert_eq!(made.unwrap_err(), refused);
}

/// The nominal robot measured in its own frame: the outcome contains that frame.
#[test]
fn the_frame_of_the_outcome_is_that_of_the_coordinates() {
    let robot = SymmetricRobot::PAPER.robot().unwrap();
    let frame = RigidTransform {
        rotation: *Rotation3::new(Vector3::new(0.3, -0.5, 0.8)).matrix(),
        translation: Vector3::new(40.0, -70.0, 300.0),
    };
    let instruments = Instruments {
        frame: PositionFrame::Sensor,
        planes: &[],
        points: &[],
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.02).unwrap(),
        transmission: None,
    };
    let mut measured: [ObservationRow<f64>; 20] = core::array::from_fn(|index| {
        let joints = rows(&robot)[index % 12].observation().joints.map(|q| {
            #[allow(clippy::cast_precision_loss)]
            let shift = 0.01 * index as f64;
            q + shift
        });
        let x = frame.apply(&robot.forward(&joints).unwrap());
        ObservationRow::new(Observation {
            position: [Some(x.x), Some(x.y), Some(x.z)],
            ..Observation::at(joints)
        })
    });
    let problem = ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut measured);
    let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
    let outcome = problem.unwrap().solve::<31, 496>(&settings).unwrap();
    // Rounding of about 1e-13 mm, times a condition number of some thousands.
    assert!((outcome.frame().rotation - frame.rotation).amax() < 1e-10);
    assert!((outcome.frame().translation - frame.translation).amax() < 1e-8);
}

/// Each arm's own lengths, the drive, and the owner of each unknown.
#[test]
fn a_parameter_belongs_to_its_arm_or_instrument() {
    let arms = [(260.0, 480.0), (240.0, 500.0), (280.0, 470.0)];
    let paper = SymmetricRobot::PAPER.robot().unwrap();
    let mut parameters = paper.parameters();
    for (arm, (upper_arm, forearm)) in parameters.iter_mut().zip(arms) {
        (arm[5], arm[7]) = (upper_arm, forearm);
    }
    let robot = Robot::from_parameters(parameters).unwrap();
    let instruments = Instruments {
        frame: PositionFrame::Base,
        planes: &[Plane::default()],
        points: &[Point::default(); 2],
        noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.05, 0.03).unwrap(),
        transmission: None,
    };
    let mut rows = rows(&robot);
    let problem = ObservationProblem::<f64, 33>::prepare(&robot, &instruments, &mut rows).unwrap();
    for (number, (upper_arm, _)) in arms.into_iter().enumerate() {
        for place in 0..8 {
            let found = Problem::<f64, 33, 34, 595>::upper_arm(&problem, 8 * number + place);
            assert!((found - upper_arm).abs() < 1e-12);
        }
    }
    assert_eq!(Problem::<f64, 33, 34, 595>::drive(&problem), Drive::Rotary);
    let of = |place| Problem::<f64, 33, 34, 595>::instrument_of(&problem, place);
    assert_eq!((of(23), of(24)), (None, Some(Instrument::Plane(0))));
    assert_eq!(of(32), Some(Instrument::Point(1)));
    #[cfg(feature = "linear")]
    {
        let towers = crate::robot::SymmetricLinearRobot {
            tower_radius: 140.0,
            forearm: 330.0,
        };
        let towers = towers.robot().unwrap();
        let mut rows: [ObservationRow<f64>; 12] = core::array::from_fn(|index| {
            #[allow(clippy::cast_precision_loss)]
            let t = index as f64;
            let joints = [400.0 + 20.0 * t, 420.0 + 50.0 * t.sin(), 450.0];
            ObservationRow::new(Observation {
                position: [Some(1.0), None, None],
                ..Observation::at(joints)
            })
        });
        let alone = Instruments {
            planes: &[],
            points: &[],
            ..instruments
        };
        let problem = ObservationProblem::<f64, 33>::prepare(&towers, &alone, &mut rows).unwrap();
        assert_eq!(Problem::<f64, 33, 34, 595>::drive(&problem), Drive::Linear);
    }
}
