//! The calibration from heights, distances and single coordinates: against SciPy's optimum. What is unusable is refused.

use delta_cal::calibration::Settings;
use delta_cal::observations::{
    Distance, DistanceFrom, FkmCalibrator, Height, Instrument, Instruments, Observation,
    ObservationError, ObservationNoise, ObservationProblem, ObservationRow, Plane, Point,
    PrepareError,
};
use delta_cal::robot::TransmissionTolerance;
use delta_cal::samples::SampleError;
use delta_cal::{ArmIndex, Noise, Real, Refusal, Robot, Tolerance};
use delta_cal_tests::geometries::symmetric;
use delta_cal_tests::goldens::{Bits, numbers, robot};
use delta_cal_tests::paper_robot;
use nalgebra::Vector3;
use serde::Deserialize;

/// The largest case has 24 parameters, 15 numbers of transmissions and 9 unknowns.
const GOLDEN: usize = 48;

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    nominal: Vec<Bits>,
    tolerance: Option<[Bits; 2]>,
    noise: [Bits; 6],
    frame: String,
    planes: Vec<Option<[Bits; 2]>>,
    points: Vec<GoldenPoint>,
    rows: Vec<Row>,
    parameters: Vec<Bits>,
    sigmas: Vec<Bits>,
    cost: Bits,
    transmission: Option<Bits>,
    unknowns: Vec<Bits>,
    numbers: Vec<Bits>,
}

#[derive(Deserialize)]
struct GoldenPoint {
    known: Option<[Bits; 4]>,
    offset: bool,
}

#[derive(Deserialize)]
struct Row {
    joints: [Bits; 3],
    position: Option<[Option<Bits>; 3]>,
    height: Option<(u8, Bits)>,
    distance: Option<GoldenDistance>,
}

#[derive(Deserialize)]
struct GoldenDistance {
    point: Option<u8>,
    to: Option<[Bits; 3]>,
    value: Bits,
}

impl Row {
    fn observation<T: Real>(&self) -> Observation<T> {
        let distance = self.distance.as_ref().map(|own| Distance {
            from: match (own.point, own.to) {
                (Some(point), _) => DistanceFrom::Point(point),
                (_, Some(joints)) => DistanceFrom::Pose(joints.map(Bits::real)),
                _ => panic!("a distance from nowhere"),
            },
            distance: own.value.real(),
        });
        Observation {
            joints: self.joints.map(Bits::real),
            position: self
                .position
                .unwrap_or_default()
                .map(|own| own.map(Bits::real)),
            height: self.height.map(|(plane, height)| Height {
                plane,
                height: height.real(),
            }),
            distance,
        }
    }
}

/// What the golden holds: 24 parameters, 24 σ, the cost, the unknowns, and the numbers of transmissions.
struct Found {
    parameters: Vec<f64>,
    sigmas: Vec<f64>,
    cost: f64,
    unknowns: Vec<f64>,
    numbers: Vec<f64>,
}

fn solved<T: Real>(case: &Case) -> Result<Found, Refusal> {
    let planes = case.planes.iter().map(|known| Plane {
        known: known.map(|[c, sigma]| (c.real(), sigma.real())),
        level: None,
    });
    let planes: Vec<Plane<T>> = planes.collect();
    let points = case.points.iter().map(|point| Point {
        known: point.known.map(|known| {
            let [x, y, z, sigma] = known.map(Bits::real);
            (Vector3::new(x, y, z), sigma)
        }),
        offset: point.offset,
    });
    let points: Vec<Point<T>> = points.collect();
    let [x, y, z, height, distance, joint] = case.noise.map(Bits::real);
    let instruments = Instruments {
        sensor_frame: case.frame != "base",
        planes: &planes,
        points: &points,
        noise: ObservationNoise::new(Noise::by_axis([x, y, z], joint).unwrap(), height, distance)
            .unwrap(),
        transmission: case
            .transmission
            .map(|sigma| TransmissionTolerance::new(sigma.real()).unwrap()),
    };
    let tolerance = case
        .tolerance
        .map(|[length, angle]| Tolerance::new(length.real(), angle.real()).unwrap());
    let settings = Settings::new().with_tolerance(tolerance);
    let rows = case.rows.iter().map(Row::observation);
    let mut rows: Vec<_> = rows.map(ObservationRow::new).collect();
    let nominal = robot(&case.nominal).cast().unwrap();
    let problem =
        ObservationProblem::<T, GOLDEN>::prepare(&nominal, &instruments, &mut rows).unwrap();
    let outcome = problem.solve(&settings)?;
    let parameters = outcome.robot.parameters();
    let covariance = outcome.of_robot().estimate.covariance.unwrap();
    let sigma = |index: usize| covariance[(index, index)].to_f64().sqrt();
    let residuals = (0..case.rows.len()).map(|row| {
        let residuals = problem
            .residuals_at(&outcome.robot, outcome.unknowns(), row)
            .unwrap();
        residuals
            .iter()
            .map(|own| own.to_f64().powi(2))
            .sum::<f64>()
    });
    let mut unknowns = Vec::new();
    for (index, _) in (0..).zip(&case.planes) {
        unknowns.extend(outcome.plane(&instruments, index).map(Real::to_f64));
    }
    for (index, point) in (0..).zip(&case.points) {
        let values = outcome.point(&instruments, index).map(Real::to_f64);
        unknowns.extend_from_slice(&values[..3 + usize::from(point.offset)]);
    }
    let numbers = outcome.robot.transmissions().into_iter();
    let numbers = numbers.flat_map(|own| own.numbers());
    Ok(Found {
        parameters: parameters
            .as_flattened()
            .iter()
            .map(|own| own.to_f64())
            .collect(),
        sigmas: (0..24).map(sigma).collect(),
        cost: residuals.sum(),
        unknowns,
        numbers: numbers.map(Real::to_f64).collect(),
    })
}

/// Asserts that numbers are within this of others.
fn near(name: &str, found: &[f64], expected: &[f64], off: f64) {
    assert_eq!(found.len(), expected.len(), "{name}");
    for (found, expected) in found.iter().zip(expected) {
        let apart = (found - expected).abs();
        assert!(apart < off, "{name}: {found} {expected}");
    }
}

/// How many σ the farthest parameter is off.
fn farthest(found: &Found, case: &Case) -> f64 {
    let expected = numbers(&case.parameters).into_iter();
    let pairs = found
        .parameters
        .iter()
        .zip(expected.zip(numbers(&case.sigmas)));
    let farthest = pairs
        .map(|(found, (expected, sigma))| (found - expected).abs() / sigma)
        .fold(0.0, f64::max);
    println!("{}: {farthest:.1e} sigma", case.name);
    farthest
}

fn cases() -> Vec<Case> {
    let text = include_str!("../goldens/scipy_observations.json");
    serde_json::from_str::<File>(text).unwrap().cases
}

/// The cost without what the tolerance and the known places add.
fn cost_of_readings(case: &Case) -> f64 {
    let mut cost = case.cost.0;
    let mut added = |off: f64, sigma: Bits| cost -= (off / sigma.0).powi(2);
    if let Some([length, angle]) = case.tolerance {
        for (index, (own, from)) in case.parameters.iter().zip(&case.nominal).enumerate() {
            let is_angle = matches!(index % 8, 3 | 4);
            added(own.0 - from.0, if is_angle { angle } else { length });
        }
    }
    for own in &case.numbers {
        added(own.0, case.transmission.unwrap_or(Bits(1.0)));
    }
    let mut unknowns = case.unknowns.iter();
    for plane in &case.planes {
        let own: Vec<_> = unknowns.by_ref().take(3).collect();
        if let Some([c, sigma]) = plane {
            added(own[0].0 - c.0, *sigma);
        }
    }
    for point in &case.points {
        let own: Vec<_> = unknowns
            .by_ref()
            .take(3 + usize::from(point.offset))
            .collect();
        if let Some([place @ .., sigma]) = &point.known {
            for (own, place) in own.iter().zip(place) {
                added(own.0 - place.0, *sigma);
            }
        }
    }
    cost
}

/// Within 1e-7 σ of SciPy's optimum in double precision: the generator's own optimum is good to 1e-9 σ, and
/// the last step of an iteration that converges quadratically is far below its last but one.
#[test]
fn double_precision_agrees_with_scipy() {
    for case in cases() {
        let found = solved::<f64>(&case).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let farthest = farthest(&found, &case);
        assert!(farthest < 1e-7, "{}: {farthest:e}", case.name);
        // σ is taken where the last linearisation was, a step of 1e-3 σ at most before the end.
        let ratios = found.sigmas.iter().zip(numbers(&case.sigmas));
        let ratios: Vec<_> = ratios.map(|(found, expected)| found / expected).collect();
        near(&case.name, &ratios, &[1.0; 24], 1e-4);
        let cost = found.cost / cost_of_readings(&case);
        near(&case.name, &[cost], &[1.0], 1e-6);
        // Of some 1e-3, known to 1e-5 at best.
        let gears = &found.numbers[..case.numbers.len()];
        near(&case.name, gears, &numbers(&case.numbers), 1e-10);
        // Lengths of some 1e2 mm and slopes, known to 1e-2 mm and 1e-4 at best.
        near(&case.name, &found.unknowns, &numbers(&case.unknowns), 1e-5);
    }
}

/// In single precision a position is rounded to 3e-5 mm, up to 0.006 of σ of these noises; three times that is
/// allowed.
#[test]
fn single_precision_is_within_its_rounding() {
    for case in cases() {
        let found = solved::<f32>(&case).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let farthest = farthest(&found, &case);
        assert!(farthest < 0.02, "{}: {farthest:e}", case.name);
    }
}

fn noise() -> ObservationNoise<f64> {
    let position = Noise::new(0.02, 2e-3f64.to_radians()).unwrap();
    ObservationNoise::new(position, 0.02, 0.05).unwrap()
}

fn instruments_of<'a>(planes: &'a [Plane<f64>], points: &'a [Point<f64>]) -> Instruments<'a, f64> {
    Instruments {
        planes,
        points,
        ..Instruments::new(noise())
    }
}

fn at(q: f64) -> Observation<f64> {
    Observation::at([0.1, q, 0.3])
}

fn height(plane: u8, height: f64) -> Observation<f64> {
    Observation {
        height: Some(Height { plane, height }),
        ..at(0.2)
    }
}

fn distance(from: DistanceFrom<f64>, distance: f64) -> Observation<f64> {
    Observation {
        distance: Some(Distance { from, distance }),
        ..at(0.2)
    }
}

#[test]
fn unusable_observations_are_refused_with_their_fault() {
    use ObservationError::{DistanceNotPositive, NoSuchPlane, NoSuchPoint, NonFinite, Nothing};
    use ObservationError::{SamePlace, TooFar};

    let (robot, settings) = (paper_robot(), Settings::new());
    let (planes, points) = ([Plane::default(); 2], [Point::default()]);
    let instruments = instruments_of(&planes, &points);
    let x = |x| Observation {
        position: [None, Some(x), None],
        ..at(0.2)
    };
    let point = DistanceFrom::Point;
    let of = |q| DistanceFrom::Pose([0.1, 0.2, q]);
    let too_large = ObservationError::Joints(SampleError::JointTooLarge(ArmIndex::Third));
    let not_finite = ObservationError::Joints(SampleError::JointNonFinite(ArmIndex::Second));
    for (observation, expected) in [
        (x(12.0), Ok(())),
        (x(f64::NAN), Err(NonFinite)),
        (x(1e200), Err(NonFinite)),
        // Ten thousand forearms of 480 mm.
        (x(-4.79e6), Ok(())),
        (x(-4.81e6), Err(TooFar)),
        (at(0.2), Err(Nothing)),
        (at(f64::NAN), Err(not_finite)),
        (height(1, -3.0), Ok(())),
        (height(2, 3.0), Err(NoSuchPlane(2))),
        (height(0, f64::INFINITY), Err(NonFinite)),
        (height(0, 1e18), Err(TooFar)),
        (distance(point(0), 1e9), Err(TooFar)),
        (distance(point(0), 100.0), Ok(())),
        (distance(point(1), 100.0), Err(NoSuchPoint(1))),
        (distance(point(0), 0.0), Err(DistanceNotPositive)),
        (distance(point(0), -1.0), Err(DistanceNotPositive)),
        (distance(point(0), f64::NAN), Err(NonFinite)),
        (distance(of(0.4), 100.0), Ok(())),
        (distance(of(13.0), 100.0), Err(too_large)),
        (distance(of(0.3), 100.0), Err(SamePlace)),
    ] {
        let mut calibrator =
            FkmCalibrator::<f64, 9, 33>::new(&robot, &instruments, &settings).unwrap();
        assert_eq!(calibrator.add(&observation), expected);
        assert_eq!(calibrator.samples(), u64::from(expected.is_ok()));
        let mut rows = [height(0, 100.0), observation].map(ObservationRow::new);
        let problem = ObservationProblem::<f64, 33>::prepare(&robot, &instruments, &mut rows);
        match (problem.unwrap_err(), expected) {
            (PrepareError::Row { index: 1, error }, Err(expected)) => assert_eq!(error, expected),
            // Two rows do not determine the instruments.
            (PrepareError::Refused(_), Ok(())) => {}
            (found, expected) => panic!("{found:?}, {expected:?}"),
        }
    }
}

/// A plane needs three heights, a point three distances, an offset one more; prior knowledge of a placement replaces two
/// or all but one of them. What is read at joint angles that the nominal robot does not reach does not count.
#[test]
fn the_instrument_with_too_few_readings_is_named() {
    let robot = symmetric([194.0, 30.0, 260.0, 420.0]);
    let unknown = Plane::default();
    let known = Plane {
        known: Some((-560.0, 0.1)),
        ..unknown
    };
    let level = Plane {
        level: Some(0.01),
        ..unknown
    };
    let place = Some((Vector3::new(0.0, 0.0, -700.0), 1.0));
    let point = |known, offset| Point { known, offset };
    let planes = [(unknown, 3), (known, 1), (level, 1)].map(|own| (own, (point(place, false), 1)));
    let points = [
        (None, false, 3),
        (None, true, 4),
        (place, false, 1),
        (place, true, 2),
    ]
    .map(|(known, offset, needed)| ((level, 1), (point(known, offset), needed)));
    for ((plane, heights), (of_point, distances)) in planes.into_iter().chain(points) {
        let (planes, points) = ([level, plane], [point(place, false), of_point]);
        let instruments = instruments_of(&planes, &points);
        for (touched, measured) in (0..=4).flat_map(|count| [(4, count), (count, 4)]) {
            // Of the first plane and point one reading, and so many of the second.
            let rows = [touched, measured].map(|count| {
                (0..5).map(move |index| {
                    let reached = index <= count;
                    let joints = if reached { [0.6, 0.7, 0.5] } else { [0.0; 3] };
                    (u8::from(index > 0), joints)
                })
            });
            let [touches, lengths] = rows;
            let touches = touches.map(|(plane, joints)| Observation {
                joints,
                ..height(plane, 1.0)
            });
            let lengths = lengths.map(|(point, joints)| Observation {
                joints,
                ..distance(DistanceFrom::Point(point), 100.0)
            });
            let mut rows: Vec<_> = touches.chain(lengths).map(ObservationRow::new).collect();
            let problem =
                ObservationProblem::<f64, GOLDEN>::prepare(&robot, &instruments, &mut rows);
            let few = match problem.err() {
                Some(PrepareError::Refused(Refusal::TooFewObservations {
                    instrument,
                    observations,
                    needed,
                })) => Some((instrument, observations, needed)),
                _ => None,
            };
            let of_plane = (touched < heights).then_some((Instrument::Plane(1), touched, heights));
            let of_point =
                (measured < distances).then_some((Instrument::Point(1), measured, distances));
            assert_eq!(few, of_plane.or(of_point));
        }
    }
}

/// Touches that the nominal robot cannot make, one after each that it can, are refused and take no room: the outcome is
/// that of all that were added. The forearms are shorter than the elbows of level arms are far out; a travel overflows
/// in single precision when it is squared twice.
#[test]
fn what_the_robot_does_not_reach_is_refused_and_takes_no_room() {
    let rotary = symmetric([194.0, 30.0, 260.0, 420.0]);
    let linear = Robot::linear(140.0, 330.0, None).unwrap();
    let (level, far) = ([0.0; 3], [[0.0, 0.0, 700.0], [1e18, 0.0, 0.0]]);
    for (robot, centre, reach, unreached) in [
        (&rotary, 0.6, 0.3, [level, [0.05, 0.0, 0.1]]),
        (&linear, 0.0, 90.0, far),
    ] {
        some_are_unreached(robot, centre, reach, unreached);
        some_are_unreached::<f32>(&robot.cast().unwrap(), centre, reach, unreached);
    }
}

fn some_are_unreached<T: Real>(
    robot: &Robot<T>,
    centre: f64,
    reach: f64,
    unreached: [[f64; 3]; 2],
) {
    let number = T::from_f64;
    let noise = Noise::new(number(0.02), T::ZERO).unwrap();
    let noise = ObservationNoise::new(noise, number(0.02), number(0.02)).unwrap();
    let instruments = Instruments {
        planes: &[Plane::default()],
        ..Instruments::new(noise)
    };
    let tolerance = Tolerance::new(number(0.5), number(0.0035)).unwrap();
    let settings = Settings::new().with_tolerance(tolerance);
    let made = FkmCalibrator::<T, 40, 27>::new(robot, &instruments, &settings);
    let mut calibrator = made.unwrap();
    let touch = |joints: [f64; 3]| {
        let joints = joints.map(number);
        let z = robot.forward(&joints).map_or(T::ZERO, |x| x.z);
        let height = Some(Height {
            plane: 0,
            height: z + number(560.0),
        });
        Observation {
            height,
            ..Observation::at(joints)
        }
    };
    for turn in 0..40_u32 {
        let t = f64::from(turn);
        let good = [1.0, 1.7, 2.3].map(|by| centre + reach * (by * t).sin());
        calibrator.add(&touch(good)).unwrap();
        let refused = calibrator.add(&touch(unreached[(turn % 2) as usize]));
        assert_eq!(refused, Err(ObservationError::Unreached));
        assert_eq!(calibrator.samples(), u64::from(turn + 1));
    }
    let full = calibrator.add(&touch([centre; 3]));
    assert_eq!(full, Err(ObservationError::Full));
    let outcome = calibrator.calibrate().unwrap();
    assert_eq!(outcome.estimate.samples, 40);
    assert_eq!(outcome.estimate.effective_samples, number(40.0));
}

/// A σ of 0 would be an infinite weight. Both ways of solving name the fault.
#[test]
fn known_places_without_a_sigma_are_refused() {
    let robot = paper_robot();
    let settings = Settings::new();
    let refused = |planes: &[Plane<f64>], points: &[Point<f64>], expected| {
        let instruments = instruments_of(planes, points);
        let mut rows: [_; 9] = std::array::from_fn(|_| ObservationRow::new(height(0, 100.0)));
        let refused = Refusal::UnusableInstrument(expected);
        let problem = ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut rows);
        assert_eq!(problem.unwrap_err(), PrepareError::Refused(refused));
        let made = FkmCalibrator::<f64, 9, 33>::new(&robot, &instruments, &settings);
        assert_eq!(made.unwrap_err(), refused);
    };
    let good = Plane {
        known: Some((-700.0, 1.0)),
        level: Some(0.01),
    };
    for sigma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let known = Plane {
            known: Some((-700.0, sigma)),
            ..good
        };
        refused(&[known], &[], Instrument::Plane(0));
        let level = Plane {
            level: Some(sigma),
            ..good
        };
        refused(&[good, level], &[], Instrument::Plane(1));
        let point = Point {
            known: Some((Vector3::new(0.0, 0.0, -700.0), sigma)),
            offset: false,
        };
        refused(&[good], &[point], Instrument::Point(0));
    }
    let nowhere = Plane {
        known: Some((f64::NAN, 1.0)),
        level: None,
    };
    refused(&[nowhere], &[], Instrument::Plane(0));
}

#[test]
fn a_row_whose_weight_is_no_number_is_refused() {
    let robot = paper_robot();
    let planes = [Plane::default()];
    let instruments = instruments_of(&planes, &[]);
    for weight in [f64::INFINITY, f64::NAN, -1.0] {
        let mut rows: [_; 9] = std::array::from_fn(|_| ObservationRow::new(height(0, 100.0)));
        rows[4].set_weight(weight);
        let problem = ObservationProblem::<f64, 27>::prepare(&robot, &instruments, &mut rows);
        let error = ObservationError::Weight;
        assert_eq!(problem.unwrap_err(), PrepareError::Row { index: 4, error });
    }
}
