//! Sessions of heights, distances and single coordinates.

use crate::controller::driver::{Driver, Flash, begin, message, samples};
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationError, ObservationNoise,
    ObservationProblem, ObservationRow, Plane, Point, PositionFrame,
};
use delta_cal::samples::SampleError;
use delta_cal::simulate::random_pose;
use delta_cal::{ArmIndex, Noise, Real, Refusal, Robot, Settings, Tolerance};
use delta_cal_firmware_example::{Number, nominal};
use delta_cal_protocol::{
    ArmReport, BeginObservations, Fault, Geometry, ObservationMessage, Phase, PlaneMessage,
    PointMessage, Request, Response,
};
use delta_cal_tests::{Spread, generator, paper_limits, paper_robot, perturbed};
use nalgebra::Vector3;

const SESSION: u32 = 7;
/// As docs/protocol.md states it.
const CAPACITY: usize = 100;

fn beginning<T: Number>() -> BeginObservations<T> {
    let n = T::from_f64;
    let mut planes = [PlaneMessage::default(); 4];
    planes[0].known = Some((n(-560.0), n(3.0)));
    planes[0].level = Some(n(0.01));
    let mut points = [PointMessage::default(); 4];
    points[0].known = Some(([n(700.0), n(0.0), n(-500.0)], n(5.0)));
    points[0].offset = true;
    BeginObservations {
        session: SESSION,
        tolerance: Some((n(0.5), n(0.0035))),
        noise: ([n(0.05); 3], n(3e-5)),
        height_noise: n(0.02),
        distance_noise: n(0.02),
        plane_count: 2,
        planes,
        point_count: 1,
        points,
    }
}

/// What these readings are on a robot that differs from the drawn one.
fn rows<T: Real>(seed: u64, count: u32) -> Vec<Observation<T>> {
    let mut rng = generator(seed, 0);
    let robot = perturbed(&paper_robot(), 0.5, 0.0035, Spread::Normal, &mut rng);
    (0..count)
        .map(|row| {
            let mut pose = || random_pose(&robot, &paper_limits(), &mut rng).expect("a pose");
            let (own, other) = (pose(), pose());
            let x = own.position;
            let joints = own.joints.map(T::from_f64);
            let height = |plane, height| {
                Some(Height {
                    plane,
                    height: T::from_f64(height),
                })
            };
            let distance = |from, to: Vector3<f64>, offset: f64| {
                let distance = T::from_f64((x - to).norm() + offset);
                Some(Distance { from, distance })
            };
            let mut observation = Observation::at(joints);
            match row % 4 {
                0 => observation.height = height(0, x.z + 559.5),
                1 => observation.height = height(1, x.z + 602.0),
                2 => {
                    let from = DistanceFrom::Point(0);
                    let at = Vector3::new(702.0, 1.0, -497.0);
                    observation.distance = distance(from, at, 0.7);
                }
                _ => {
                    let from = DistanceFrom::Pose(other.joints.map(T::from_f64));
                    observation.distance = distance(from, other.position, 0.0);
                    observation.position = [None, Some(T::from_f64(x.y)), None];
                }
            }
            observation
        })
        .collect()
}

fn request<T: Number>(index: usize, row: &Observation<T>) -> Request<T> {
    Request::Observation(ObservationMessage {
        session: SESSION,
        index: u32::try_from(index).unwrap(),
        joints: row.joints,
        position: row.position,
        height: row.height.map(|own| (own.plane, own.height)),
        distance: row.distance.map(|own| (own.from, own.distance)),
    })
}

fn open<T: Number>() -> Driver<T, Flash> {
    let mut driver = Driver::start(Flash::new());
    assert_eq!(
        next(&mut driver, &Request::BeginObservations(beginning())),
        0
    );
    driver
}

fn next<T: Number>(driver: &mut Driver<T, Flash>, request: &Request<T>) -> u32 {
    match driver.ask(request) {
        Response::Taken { session, next, .. } if session == SESSION => next,
        response => panic!("{response:?}"),
    }
}

fn send<T: Number>(driver: &mut Driver<T, Flash>, rows: &[Observation<T>]) {
    for (index, row) in rows.iter().enumerate() {
        let taken = next(driver, &request(index, row));
        assert_eq!(usize::try_from(taken).unwrap(), index + 1);
    }
}

fn solved<T: Number>(driver: &mut Driver<T, Flash>, count: u32) -> Phase {
    assert_eq!(driver.solve(SESSION, count), Phase::Solving { arm: None });
    driver.rest();
    driver.status().phase
}

/// The controller's result has the bits of the problem that is solved in one call.
fn same_bits<T: Number>() {
    let n = T::from_f64;
    for (seed, count) in [(1, 40), (2, 60), (3, 100), (4, 24)] {
        let mut driver = open::<T>();
        let rows = rows::<T>(seed, count);
        send(&mut driver, &rows);
        let phase = solved(&mut driver, count);

        let planes = [
            Plane {
                known: Some((n(-560.0), n(3.0))),
                level: Some(n(0.01)),
            },
            Plane::default(),
        ];
        let points = [Point {
            known: Some((Vector3::new(n(700.0), n(0.0), n(-500.0)), n(5.0))),
            offset: true,
        }];
        let instruments = Instruments {
            frame: PositionFrame::Base,
            planes: &planes,
            points: &points,
            noise: ObservationNoise::new(Noise::new(n(0.05), n(3e-5)).unwrap(), n(0.02), n(0.02))
                .unwrap(),
            transmission: None,
        };
        let settings =
            Settings::new().with_tolerance(Some(Tolerance::new(n(0.5), n(0.0035)).unwrap()));
        let robot: Robot<T> = nominal().unwrap();
        let mut here: Vec<_> = rows.iter().copied().map(ObservationRow::new).collect();
        let problem =
            ObservationProblem::<T, 36>::prepare(&robot, &instruments, &mut here).unwrap();
        let outcome = problem.solve::<37, 703>(&settings).unwrap();

        let expected = Geometry::of(&outcome.robot).fingerprint();
        let samples = count;
        assert_eq!(
            phase,
            Phase::Solved {
                samples,
                fingerprint: expected
            }
        );
        let joint = outcome.of_robot();
        for arm in ArmIndex::ALL {
            let session = SESSION;
            let Response::Outcome(report) = driver.ask(&Request::Outcome { session, arm }) else {
                panic!("no outcome")
            };
            assert_eq!(report, ArmReport::new(arm, &joint.arm(arm), None));
        }
        let session = SESSION;
        let Response::Places(places) = driver.ask(&Request::Places { session }) else {
            panic!("no places")
        };
        assert_eq!(places.planes[0], outcome.plane(&instruments, 0));
        assert_eq!(places.planes[1], outcome.plane(&instruments, 1));
        assert_eq!(places.planes[2..], [[T::ZERO; 3]; 2]);
        assert_eq!(places.points[0], outcome.point(&instruments, 0));
        assert_eq!(places.points[1..], [[T::ZERO; 4]; 3]);
    }
}

#[test]
fn results_have_the_bits_of_the_core() {
    same_bits::<f32>();
}

#[test]
fn results_have_the_bits_of_the_core_in_double_precision() {
    same_bits::<f64>();
}

#[test]
fn what_comes_again_changes_nothing() {
    let rows = rows::<f32>(5, 40);
    let mut plain = open();
    send(&mut plain, &rows);
    let expected = solved(&mut plain, 40);
    assert!(matches!(expected, Phase::Solved { .. }), "{expected:?}");

    let mut driver = open();
    for (index, row) in rows.iter().enumerate() {
        let taken = u32::try_from(index).unwrap() + 1;
        for _ in 0..2 {
            assert_eq!(next(&mut driver, &request(index, row)), taken);
            assert_eq!(next(&mut driver, &request(0, &rows[3])), taken);
            let begin = Request::BeginObservations(beginning());
            assert_eq!(next(&mut driver, &begin), taken);
        }
        let gap = driver.fault(&request(index + 2, row));
        assert_eq!(gap, Fault::OutOfOrder { next: taken });
    }
    let solve = driver.solve(SESSION, 40);
    assert_eq!(solve, Phase::Solving { arm: None });
    assert_eq!(driver.fault(&request(40, &rows[0])), Fault::Busy);
    driver.controller.idle();
    assert_eq!(driver.solve(SESSION, 40), solve);
    driver.rest();
    assert_eq!(driver.status().phase, expected);
    assert_eq!(driver.solve(SESSION, 40), expected);
    // More rows may follow.
    assert_eq!(next(&mut driver, &request(40, &rows[0])), 41);
    assert_eq!(driver.status().phase, Phase::Collecting { samples: 41 });
}

#[test]
fn as_many_rows_as_there_is_memory_for() {
    let rows = rows::<f32>(6, 101);
    let mut driver = open();
    send(&mut driver, &rows[..CAPACITY]);
    let capacity = u32::try_from(CAPACITY).unwrap();
    let fault = driver.fault(&request(CAPACITY, &rows[CAPACITY]));
    assert_eq!(fault, Fault::TooManyObservations { capacity });
    // Those that came can be solved.
    let phase = solved(&mut driver, capacity);
    assert!(matches!(phase, Phase::Solved { .. }), "{phase:?}");
}

#[test]
fn wrong_rows_are_refused_and_expected_again() {
    let right = rows::<f32>(7, 4);
    let joints = right[0].joints;
    let at = Observation::at(joints);
    let height = |plane, height| Some(Height { plane, height });
    let distance = |from, distance| Some(Distance { from, distance });
    let wrong = [
        (at, ObservationError::Nothing),
        (
            Observation {
                height: height(2, 1.0),
                ..at
            },
            ObservationError::NoSuchPlane(2),
        ),
        (
            Observation {
                height: height(0, f32::NAN),
                ..at
            },
            ObservationError::NonFinite,
        ),
        (
            Observation {
                distance: distance(DistanceFrom::Point(1), 1.0),
                ..at
            },
            ObservationError::NoSuchPoint(1),
        ),
        (
            Observation {
                distance: distance(DistanceFrom::Point(0), 0.0),
                ..at
            },
            ObservationError::DistanceNotPositive,
        ),
        (
            Observation {
                distance: distance(DistanceFrom::Pose(joints), 1.0),
                ..at
            },
            ObservationError::SamePlace,
        ),
        (
            Observation {
                joints: [0.1, 50.0, 0.1],
                ..right[0]
            },
            ObservationError::Joints(SampleError::JointTooLarge(ArmIndex::Second)),
        ),
    ];
    let mut driver = open();
    for (row, error) in wrong {
        let fault = driver.fault(&request(0, &row));
        assert_eq!(fault, Fault::Observation(error));
    }
    assert_eq!(next(&mut driver, &request(0, &right[0])), 1);
    // One touch on the table, none on the shelf.
    let phase = solved(&mut driver, 1);
    let Phase::CalibrationRefused { refusal, .. } = phase else {
        panic!("{phase:?}")
    };
    assert!(
        matches!(
            refusal,
            delta_cal::stream::StreamRefusal::Calibration(Refusal::TooFewObservations { .. })
        ),
        "{refusal:?}"
    );
}

#[test]
fn wrong_beginnings_leave_the_open_session() {
    let right = beginning::<f32>();
    let mut driver = open();
    send(&mut driver, &rows(8, 3));
    let n = f32::NAN;
    let mut many = [PointMessage::default(); 4];
    many[0].offset = true;
    let settings = [
        BeginObservations {
            session: 0,
            ..right
        },
        BeginObservations {
            tolerance: Some((0.5, n)),
            ..right
        },
        BeginObservations {
            noise: ([0.05, 0.0, -1.0], 0.0),
            ..right
        },
        BeginObservations {
            height_noise: 0.0,
            ..right
        },
        BeginObservations {
            distance_noise: n,
            ..right
        },
        BeginObservations {
            planes: [PlaneMessage {
                known: Some((0.0, 0.0)),
                level: None,
            }; 4],
            ..right
        },
        BeginObservations {
            planes: [PlaneMessage {
                known: None,
                level: Some(-1.0),
            }; 4],
            ..right
        },
        BeginObservations {
            points: [PointMessage {
                known: Some(([0.0, n, 0.0], 1.0)),
                offset: false,
            }; 4],
            ..right
        },
    ];
    for begin in settings {
        let fault = driver.fault(&Request::BeginObservations(begin));
        assert_eq!(fault, Fault::Settings, "{begin:?}");
    }
    let unknowns = [
        // Six and seven: one too many.
        BeginObservations {
            points: many,
            point_count: 2,
            ..right
        },
        BeginObservations {
            plane_count: 5,
            point_count: 0,
            ..right
        },
        BeginObservations {
            plane_count: 0,
            point_count: 255,
            ..right
        },
    ];
    for begin in unknowns {
        let fault = driver.fault(&Request::BeginObservations(begin));
        assert_eq!(fault, Fault::TooManyUnknowns { capacity: 12 });
    }
    assert_eq!(driver.status().session, SESSION);
    assert_eq!(driver.status().phase, Phase::Collecting { samples: 3 });
}

#[test]
fn the_two_kinds_are_not_mixed() {
    let sample = samples::<f32>(1, 1)[0];
    let row = rows::<f32>(9, 1)[0];
    let mut driver = open();
    let session = SESSION;
    assert_eq!(
        driver.fault(&message(session, 0, &sample)),
        Fault::OtherKind
    );
    assert_eq!(driver.fault(&message(3, 0, &sample)), Fault::NoSession);
    assert_eq!(driver.fault(&Request::Places { session }), Fault::NoOutcome);
    let other = Request::Places { session: 3 };
    assert_eq!(driver.fault(&other), Fault::NoSession);
    // The same number for the other kind is another session.
    send(&mut driver, &[row]);
    assert_eq!(driver.begin_with(begin(session)), 0);
    assert_eq!(driver.fault(&request(0, &row)), Fault::OtherKind);
    assert_eq!(driver.fault(&Request::Places { session }), Fault::OtherKind);
    assert_eq!(driver.status().phase, Phase::Collecting { samples: 0 });
}
