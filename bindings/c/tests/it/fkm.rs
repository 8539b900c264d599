//! Observations of every kind: a sensor's frame, a plane that is known to a sigma, a point with an offset, distances
//! between poses.

use crate::place::{Place, bits, input, no_error, noise_and_tolerance, ok, output, robot};
use delta_cal::nalgebra::Vector3;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, ObservationNoise, ObservationOutcome, ObservationProblem,
    ObservationRow, PositionFrame,
};
use delta_cal_c::double::fkm::*;
use delta_cal_c::double::outcome::joint_outcome_covariance;
use delta_cal_c::error::Error;
use delta_cal_c::plain::{
    FKM_ROWS, FRAME_SENSOR, READ_DISTANCE, READ_DISTANCE_BETWEEN, READ_HEIGHT, READ_X, READ_Y,
    READ_Z,
};
use delta_cal_c::status;
use delta_cal_target_tests::{noise, nominal, samples as measured, tolerance};

const SIGMA: f64 = 0.02;
/// One sigma of the plane's slopes.
const LEVEL: f64 = 0.01;
const PLACE: [f64; 3] = [10.0, -20.0, -700.0];

/// The readings of each sample, in C and in the core.
fn observed() -> Vec<(Observation, delta_cal::observations::Observation<f64>)> {
    let samples = measured::<f64>();
    let place = Vector3::from(PLACE);
    let mut all = Vec::new();
    for (index, sample) in samples.iter().enumerate() {
        let other = &samples[(index + 1) % samples.len()];
        let [x, y, z] = sample.position.into();
        let mut in_c = Observation {
            joints: sample.joints,
            position: [x, y, z],
            height: z + 560.0,
            distance: 0.0,
            other_joints: other.joints,
            plane: 0,
            point: 0,
            readings: 0,
            reserved: 0,
        };
        let mut of_core = delta_cal::observations::Observation::at(sample.joints);
        let mut distance = |from, length| {
            of_core.distance = Some(Distance {
                from,
                distance: length,
            });
            in_c.distance = length;
        };
        match index % 4 {
            0 => {
                distance(
                    DistanceFrom::Point(0),
                    (sample.position - place).norm() + 0.5,
                );
                in_c.readings = READ_DISTANCE;
            }
            1 => {
                let apart = (sample.position - other.position).norm();
                distance(DistanceFrom::Pose(other.joints), apart);
                in_c.readings = READ_DISTANCE_BETWEEN | READ_Z;
                of_core.position = [None, None, Some(z)];
            }
            2 => {
                in_c.readings = READ_X | READ_Y | READ_Z;
                of_core.position = [Some(x), Some(y), Some(z)];
            }
            _ => {
                in_c.readings = READ_HEIGHT | READ_Y;
                of_core.position = [None, Some(y), None];
                of_core.height = Some(Height {
                    plane: 0,
                    height: z + 560.0,
                });
            }
        }
        all.push((in_c, of_core));
    }
    all
}

fn instruments() -> Instruments {
    let plane = Plane {
        known: 0.0,
        sigma: 0.0,
        level: 0.0,
    };
    let point = Point {
        known: [0.0; 3],
        sigma: 0.0,
        has_offset: 0,
        reserved: 0,
    };
    let mut all = Instruments {
        frame: FRAME_SENSOR,
        plane_count: 1,
        point_count: 1,
        reserved: 0,
        height_noise: SIGMA,
        distance_noise: SIGMA,
        planes: [plane; 4],
        points: [point; 4],
    };
    all.planes[0] = Plane {
        known: -560.2,
        sigma: 1.0,
        level: LEVEL,
    };
    all.points[0].has_offset = 1;
    all
}

/// A calibrator of these instruments, if they are usable.
fn made(instruments: &Instruments) -> Result<Place<Own>, Error> {
    let (mut robot, mut calibrator) = (robot(), Place::filled_with(0x5a));
    let mut error = Error::from(status::OK);
    let (new, size) = (calibrator.new_object(), calibrator.size());
    let (own, settings) = (robot.held(), noise_and_tolerance());
    let (stated, why) = (input(instruments), output(&mut error));
    if init(new, size, own, stated, input(&settings), why) == status::OK {
        return Ok(calibrator);
    }
    assert!(calibrator.is_filled_with(0x5a), "something was written");
    Err(error)
}

/// In bounded steps; the outcome, or the error that the calls leave.
fn solved(
    observations: &[Observation],
    instruments: &Instruments,
) -> Result<Place<Outcome>, Error> {
    let (mut calibrator, mut outcome) = (made(instruments)?, Place::new());
    for observation in observations {
        ok(add(calibrator.held_mut(), input(observation), no_error()));
    }
    let mut error = Error::from(status::OK);
    if solve(calibrator.held_mut(), output(&mut error)) != status::OK {
        return Err(error);
    }
    let (new, size) = (outcome.new_object(), outcome.size());
    assert_eq!(step(calibrator.held_mut()), status::WORKING);
    let busy = add(calibrator.held_mut(), input(&observations[0]), no_error());
    let early = finish(calibrator.held(), new, size, no_error());
    assert_eq!((busy, early), (status::BUSY, status::UNFINISHED));
    while step(calibrator.held_mut()) == status::WORKING {}
    let (new, size) = (outcome.new_object(), outcome.size());
    match finish(calibrator.held(), new, size, output(&mut error)) {
        status::OK => Ok(outcome),
        _ => Err(error),
    }
}

/// Readings of the kinds that are chosen, which the core and C solve alike; the outcome of both.
fn solved_alike(
    chosen: &[usize],
    points: &[delta_cal::observations::Point<f64>],
    has_plane: bool,
) -> (Place<Outcome>, ObservationOutcome<f64, 36>) {
    let kinds = observed().into_iter().enumerate();
    let (in_c, of_core): (Vec<_>, Vec<_>) = kinds
        .filter(|(index, _)| chosen.contains(&(index % 4)))
        .map(|(_, pair)| pair)
        .unzip();
    let robot = nominal::<f64>();
    let known = known(points, has_plane);
    let assumed = delta_cal::Settings::new()
        .with_noise(noise())
        .with_tolerance(tolerance());
    let mut rows: Vec<_> = of_core.into_iter().map(ObservationRow::new).collect();
    let problem = ObservationProblem::<f64, 36>::prepare(&robot, &known, &mut rows).unwrap();
    let expected = problem.solve::<37, 703>(&assumed).unwrap();

    let mut stated = instruments();
    stated.plane_count = u32::from(has_plane);
    stated.point_count = u32::try_from(points.len()).unwrap();
    (solved(&in_c, &stated).unwrap(), expected)
}

/// As [`instruments`], in the core.
fn known(
    points: &[delta_cal::observations::Point<f64>],
    has_plane: bool,
) -> delta_cal::observations::Instruments<'_, f64> {
    const PLANE: &[delta_cal::observations::Plane<f64>] = &[delta_cal::observations::Plane {
        known: Some((-560.2, 1.0)),
        level: Some(LEVEL),
    }];
    delta_cal::observations::Instruments {
        frame: PositionFrame::Sensor,
        planes: if has_plane { PLANE } else { &[] },
        points,
        noise: ObservationNoise::new(noise(), SIGMA, SIGMA).unwrap(),
        transmission: None,
    }
}

#[test]
fn observations_of_every_kind_are_the_cores() {
    let points = [delta_cal::observations::Point {
        known: None,
        offset: true,
    }];
    // 24 + 6 + 3 + 4 parameters are one more than there is room for.
    let refused = made(&instruments()).err().unwrap();
    assert_eq!(refused.status, status::TOO_MANY_UNKNOWNS);

    let (mut outcome, expected) = solved_alike(&[0, 1, 2], &points, false);
    let mut place = [0.0; 4];
    ok(outcome_point(outcome.held(), 0, output(&mut place)));
    assert_eq!(
        bits(&place),
        bits(&expected.point(&known(&points, false), 0))
    );
    let (mut rotation, mut translation) = ([[0.0; 3]; 3], [0.0; 3]);
    let (turned, moved) = (output(&mut rotation), output(&mut translation));
    ok(outcome_frame(outcome.held(), turned, moved));
    let frame = expected.frame();
    let by_rows = frame.rotation.transpose();
    assert_eq!(bits(rotation.as_flattened()), bits(by_rows.as_slice()));
    assert_eq!(bits(&translation), bits(frame.translation.as_slice()));

    let mut joint = Place::new();
    let (new, size) = (joint.new_object(), joint.size());
    ok(outcome_joint(outcome.held(), new, size));
    let mut covariance = [[0.0; 24]; 24];
    ok(joint_outcome_covariance(
        joint.held(),
        output(&mut covariance),
    ));
    let expected = expected.of_robot().estimate.covariance.unwrap().transpose();
    assert_eq!(bits(covariance.as_flattened()), bits(expected.as_slice()));
}

#[test]
fn a_plane_that_is_known_is_the_cores() {
    let (mut outcome, expected) = solved_alike(&[2, 3], &[], true);
    let mut plane = [0.0; 3];
    ok(outcome_plane(outcome.held(), 0, output(&mut plane)));
    assert_eq!(bits(&plane), bits(&expected.plane(&known(&[], true), 0)));
}

#[test]
fn wrong_observations_and_instruments_are_refused() {
    let good: Vec<Observation> = observed().into_iter().map(|(in_c, _)| in_c).collect();
    let mut stated = instruments();
    stated.frame = 0;
    for (expected, change) in [
        (
            status::OBSERVATION_EMPTY,
            &(|o: &mut Observation| o.readings = 0) as &dyn Fn(&mut Observation),
        ),
        (status::NO_SUCH_CHOICE, &|o| o.readings = 64),
        (status::NO_SUCH_CHOICE, &|o| {
            o.readings = READ_DISTANCE | READ_DISTANCE_BETWEEN;
        }),
        (status::NO_SUCH_PLANE, &|o| {
            (o.readings, o.plane) = (READ_HEIGHT, 1);
        }),
        (status::NO_SUCH_PLANE, &|o| {
            (o.readings, o.plane) = (READ_HEIGHT, 256);
        }),
        (status::NO_SUCH_POINT, &|o| {
            (o.readings, o.point) = (READ_DISTANCE, 4);
        }),
        (status::OBSERVATION_DISTANCE, &|o| {
            (o.readings, o.distance) = (READ_DISTANCE, -1.0);
        }),
        (status::OBSERVATION_NOT_FINITE, &|o| {
            (o.readings, o.height) = (READ_HEIGHT, f64::NAN);
        }),
        (status::SAMPLE_JOINT_TOO_LARGE, &|o| o.joints[2] = 45.0),
    ] {
        let (mut wrong, mut calibrator) = (good[5], made(&stated).unwrap());
        change(&mut wrong);
        let mut error = Error::from(status::OK);
        let found = add(calibrator.held_mut(), input(&wrong), output(&mut error));
        assert_eq!((found, error.status), (expected, expected));
        let mut count = 7;
        ok(samples(calibrator.held(), output(&mut count)));
        assert_eq!(count, 0);
    }
    for (expected, height, distance) in [
        (status::NOISE_OF_HEIGHT, 0.0, SIGMA),
        (status::NOISE_OF_DISTANCE, SIGMA, 0.0),
        (status::NOISE_OF_HEIGHT, -1.0, SIGMA),
    ] {
        let mut wrong = stated;
        (wrong.height_noise, wrong.distance_noise) = (height, distance);
        let found = match made(&wrong) {
            Ok(mut calibrator) => good
                .iter()
                .map(|own| add(calibrator.held_mut(), input(own), no_error()))
                .find(|found| *found != status::OK),
            Err(error) => Some(error.status),
        };
        assert_eq!(found, Some(expected));
    }
    for sigma in [-1.0, f64::NAN, f64::INFINITY] {
        let (mut known, mut level) = (stated, stated);
        known.planes[0].sigma = sigma;
        level.planes[0].level = sigma;
        for wrong in [known, level] {
            assert_eq!(made(&wrong).err().unwrap().status, status::KNOWN_PLACE);
        }
    }
}

#[test]
fn there_is_room_for_so_many_observations() {
    let mut stated = instruments();
    stated.frame = 0;
    let (mut calibrator, (own, _)) = (made(&stated).unwrap(), observed()[0]);
    for _ in 0..FKM_ROWS {
        ok(add(calibrator.held_mut(), input(&own), no_error()));
    }
    let found = add(calibrator.held_mut(), input(&own), no_error());
    assert_eq!(found, status::OBSERVATIONS_FULL);
    ok(reset(calibrator.held_mut()));
    ok(add(calibrator.held_mut(), input(&own), no_error()));
}
