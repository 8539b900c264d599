//! Observations and instruments that mean nothing, and the room for them.

use crate::place::*;
use delta_cal_c::double::fkm::*;
use delta_cal_c::error::Error;
use delta_cal_c::plain::*;
use delta_cal_c::status;

const SIGMA: f64 = 0.02;

fn instruments() -> Instruments {
    Instruments {
        plane_count: 1,
        point_count: 1,
        height_noise: SIGMA,
        distance_noise: SIGMA,
        ..Instruments::default()
    }
}

/// With every reading.
fn observation() -> Observation {
    Observation {
        joints: [0.1, 0.2, 0.3],
        position: [10.0, 20.0, -500.0],
        height: 60.0,
        distance: 500.0,
        readings: READ_X | READ_Y | READ_Z | READ_HEIGHT | READ_DISTANCE,
        ..Observation::default()
    }
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

fn added(calibrator: &mut Place<Own>, observation: &Observation) -> i32 {
    add(calibrator.held_mut(), input(observation), null())
}

#[test]
fn wrong_observations_and_instruments_are_refused() {
    let (good, stated) = (observation(), instruments());
    let mut many = stated;
    (many.frame, many.points[0].has_offset) = (FRAME_SENSOR, 1);
    let refused = made(&many).err().unwrap();
    assert_eq!(refused.status, status::TOO_MANY_UNKNOWNS);
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
        (status::OBSERVATION_UNREACHED, &|o| {
            o.joints = [3.0, 0.0, 0.0];
        }),
        (status::OBSERVATION_UNREACHED, &|o| {
            (o.readings, o.other_joints) = (READ_DISTANCE_BETWEEN, [3.0, 0.0, 0.0]);
        }),
    ] {
        let (mut wrong, mut calibrator) = (good, made(&stated).unwrap());
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
            Ok(mut calibrator) => added(&mut calibrator, &good),
            Err(error) => error.status,
        };
        assert_eq!(found, expected);
    }
    for sigma in [-1.0, f64::NAN, f64::INFINITY] {
        let (mut known, mut level) = (stated, stated);
        known.planes[0].sigma = sigma;
        level.planes[0].level = sigma;
        for wrong in [known, level] {
            let why = made(&wrong).err().unwrap();
            let found = (why.status, why.instrument);
            assert_eq!(found, (status::KNOWN_PLACE, PLANE));
        }
    }
}

#[test]
fn there_is_room_for_so_many_observations() {
    let (mut calibrator, own) = (made(&instruments()).unwrap(), observation());
    for _ in 0..FKM_ROWS {
        ok(added(&mut calibrator, &own));
    }
    assert_eq!(added(&mut calibrator, &own), status::OBSERVATIONS_FULL);
    ok(reset(calibrator.held_mut()));
    ok(added(&mut calibrator, &own));
}
