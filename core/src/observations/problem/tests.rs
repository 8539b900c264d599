#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use super::super::{
    Distance, DistanceFrom, FkmCalibrator, Height, Instruments, Observation, ObservationError,
    ObservationNoise, ObservationProblem, ObservationRow, Plane, Point,
};
use super::{PIECES, ReadingRows};
use crate::calibration::{Problem, Progress, Refusal, Settings, Tolerance, sum_of_squares};
use crate::fixtures::{instruments, joints, paper};
#[cfg(feature = "transmission")]
use crate::robot::Transmission;
use crate::robot::{Robot, TransmissionTolerance};
use crate::samples::{Noise, Triangle, Unknowns};
use nalgebra::Vector3;

/// Every reading in every row, in a rotated and shifted frame.
fn rows(robot: &Robot<f64>) -> [ObservationRow<f64>; 12] {
    core::array::from_fn(|index| {
        #[allow(clippy::cast_precision_loss)]
        let t = index as f64;
        let joints = joints(index);
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
    check_derivatives::<40>(&paper(), None);
    // With a common scale of the distances between poses, the last unknown.
    #[cfg(feature = "linear")]
    check_derivatives::<41>(&paper(), None);
}

#[cfg(feature = "transmission")]
#[test]
fn derivatives_by_transmissions_are_those_of_the_residuals() {
    let transmissions = [0.01, -0.02, 0.005].map(|size| {
        let numbers = [size, -0.7 * size, 0.4 * size, 0.3 * size, -0.5 * size];
        Transmission::new(numbers).unwrap()
    });
    let robot = paper().with_transmissions(transmissions).unwrap();
    let tolerance = TransmissionTolerance::new(1e-3).unwrap();
    check_derivatives::<55>(&robot, Some(tolerance));
}

fn check_derivatives<const N: usize>(
    robot: &Robot<f64>,
    transmission: Option<TransmissionTolerance<f64>>,
) where
    f64: Unknowns<N>,
{
    let (planes, mut points) = ([Plane::default()], [Point::default(); 2]);
    points[0].offset = true;
    let noise = Noise::by_axis([0.02, 0.03, 0.1], 1e-4).unwrap();
    #[allow(unused_mut)]
    let mut instruments = Instruments {
        sensor_frame: true,
        noise: ObservationNoise::new(noise, 0.05, 0.03).unwrap(),
        transmission,
        ..instruments(&planes, &points)
    };
    #[cfg(feature = "linear")]
    if 24 + instruments.unknowns() < N {
        instruments.noise = instruments.noise.with_scale(0.003).unwrap();
    }
    assert_eq!(24 + instruments.unknowns(), N);
    let mut rows = rows(robot);
    let problem = ObservationProblem::<f64, N>::prepare(robot, &instruments, &mut rows).unwrap();
    let correction: [f64; N] = core::array::from_fn(|index| {
        #[allow(clippy::cast_precision_loss)]
        let t = index as f64;
        2e-3 * (1.3 * t).sin()
    });
    let at = |correction: &[f64; N]| problem.displaced(correction);
    let mut total = 0.0;
    for piece in 0..12 {
        let mut normal = Triangle::<f64, N>::zero();
        let mut columns = ReadingRows::default();
        let mut sum = 0.0;
        for part in 0..PIECES {
            let (at, part) = (at(&correction), PIECES * piece + part);
            let done = problem.linearize(&at, &mut columns, &mut normal, part);
            sum += done.sum_of_squares;
        }
        let whole = problem.sum_of_squares(&at(&correction), piece);
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
                problem.sum_of_squares(&at, piece).sum_of_squares
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
    let all = sum_of_squares(&problem, &at(&correction));
    assert!((all / total - 1.0).abs() < 1e-12);
}

/// One step to locate the instruments, one per row, and those of the minimisation: bit-identical to a one-call solve,
/// and no observation can interfere.
#[test]
fn the_steps_end_with_the_outcome_of_the_problem() {
    let robot = paper();
    let planes = [Plane::default()];
    let instruments = instruments(&planes, &[]);
    let settings = Settings::new().with_tolerance(Tolerance::new(0.5, 0.003).unwrap());
    let measured: [Observation<f64>; 30] = core::array::from_fn(|index| {
        let joints = joints(index);
        let height = robot.forward(&joints).unwrap().z + 560.0 + 0.05 * joints[0];
        Observation {
            height: Some(Height { plane: 0, height }),
            ..Observation::at(joints)
        }
    });
    // There is no free start.
    let free = settings.with_free_start(true);
    let mut calibrator = FkmCalibrator::<f64, 31, 27>::new(&robot, &instruments, &free).unwrap();
    let refused = calibrator.solve();
    assert!(matches!(
        refused,
        Err(Refusal::TooFewSamples { needed: 1, .. })
    ));
    for observation in &measured {
        calibrator.add(observation).unwrap();
    }
    assert_eq!(calibrator.outcome(), Err(Refusal::Unfinished));
    calibrator.solve().unwrap();
    while calibrator.step() == Progress::Working {
        assert_eq!(
            calibrator.add(&measured[0]),
            Err(ObservationError::Busy(crate::Busy))
        );
        assert_eq!(calibrator.outcome(), Err(Refusal::Unfinished));
    }
    let found = calibrator.outcome().cloned();
    let mut rows = measured.map(ObservationRow::new);
    let problem = ObservationProblem::<f64, 27>::prepare(&robot, &instruments, &mut rows);
    let problem = problem.unwrap();
    assert_eq!(found, problem.solve(&settings));
    assert_eq!(found, problem.solve(&free));
    assert!(found.is_ok());

    let two = Instruments {
        planes: &[Plane::default(); 2],
        ..instruments
    };
    let refused = Refusal::TooManyUnknowns { parameters: 30 };
    let made = FkmCalibrator::<f64, 31, 27>::new(&robot, &two, &settings);
    assert_eq!(made.unwrap_err(), refused);
}
