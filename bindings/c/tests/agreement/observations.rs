//! Observations of every kind: a sensor's frame, a plane that is known to a sigma, a point with an offset, distances
//! between poses.

use crate::place::{Place, input, output};
use crate::{bits, noise_alone, nominal_place};
use delta_cal::nalgebra::Vector3;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, ObservationNoise, ObservationProblem, ObservationRow,
    PositionFrame,
};
use delta_cal_c::double::observations::*;
use delta_cal_c::double::outcome::joint_outcome_covariance;
use delta_cal_c::double::sample::Settings;
use delta_cal_c::error::Error;
use delta_cal_c::kind::OBSERVATION_ROW_F64;
use delta_cal_c::plain::{
    FRAME_SENSOR, READ_DISTANCE, READ_DISTANCE_BETWEEN, READ_HEIGHT, READ_X, READ_Y, READ_Z,
};
use delta_cal_c::{Many, Workspace, status};
use delta_cal_target_tests::{noise, nominal, samples, tolerance};

const SIGMA: f64 = 0.02;
const PLACE: [f64; 3] = [10.0, -20.0, -700.0];

/// The readings of each sample, in C and in the core.
fn observed() -> Vec<(Observation, delta_cal::observations::Observation<f64>)> {
    let samples = samples::<f64>();
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

fn settings() -> Settings {
    let tolerance = tolerance::<f64>();
    Settings {
        length_tolerance: tolerance.of(delta_cal::Parameter::Lb),
        angle_tolerance: tolerance.of(delta_cal::Parameter::Theta),
        ..noise_alone()
    }
}

fn instruments() -> Instruments {
    let plane = Plane {
        known: 0.0,
        sigma: 0.0,
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
    };
    all.points[0].has_offset = 1;
    all
}

/// The call, and the error that it leaves.
fn solve(
    observations: &[Observation],
    instruments: &Instruments,
    outcome: &mut Place<delta_cal_c::observed::Observed<f64>>,
) -> (i32, Error) {
    let mut robot = nominal_place();
    let mut workspace = vec![0_u64; observations.len() * OBSERVATION_ROW_F64 / 8];
    let mut error = Error::from(status::OK);
    let (new, size) = (outcome.new_object(), outcome.size());
    let found = observations_solve(
        robot.held(),
        unsafe { Many::from_c(observations.as_ptr().cast()) },
        observations.len(),
        input(instruments),
        input(&settings()),
        unsafe { Workspace::from_c(workspace.as_mut_ptr().cast()) },
        size_of_val(&*workspace),
        new,
        size,
        output(&mut error),
    );
    (found, error)
}

#[test]
fn observations_of_every_kind_are_the_cores() {
    let (in_c, of_core): (Vec<_>, Vec<_>) = observed().into_iter().unzip();
    let known = delta_cal::observations::Instruments {
        frame: PositionFrame::Sensor,
        planes: &[delta_cal::observations::Plane {
            known: Some((-560.2, 1.0)),
            level: None,
        }],
        points: &[delta_cal::observations::Point {
            known: None,
            offset: true,
        }],
        noise: ObservationNoise::new(noise(), SIGMA, SIGMA).unwrap(),
        transmission: None,
    };
    let robot = nominal::<f64>();
    let assumed = delta_cal::Settings::new()
        .with_noise(noise())
        .with_tolerance(tolerance());
    let mut rows: Vec<_> = of_core.into_iter().map(ObservationRow::new).collect();
    let problem = ObservationProblem::<f64, 36>::prepare(&robot, &known, &mut rows);
    // 24 + 6 + 3 + 4 parameters are one more than there is room for.
    assert!(problem.is_err());
    let mut outcome = Place::new();
    let (found, _) = solve(&in_c, &instruments(), &mut outcome);
    assert_eq!(found, status::TOO_MANY_UNKNOWNS);

    // Without the plane there is room.
    let without_height = |(index, _): &(usize, _)| index % 4 != 3;
    let in_c: Vec<_> = in_c
        .into_iter()
        .enumerate()
        .filter(without_height)
        .collect();
    let in_c: Vec<_> = in_c
        .into_iter()
        .map(|(_, observation)| observation)
        .collect();
    let mut rows: Vec<_> = observed()
        .into_iter()
        .enumerate()
        .filter(|(index, _)| index % 4 != 3)
        .map(|(_, (_, observation))| ObservationRow::new(observation))
        .collect();
    let known = delta_cal::observations::Instruments {
        planes: &[],
        ..known
    };
    let problem = ObservationProblem::<f64, 36>::prepare(&robot, &known, &mut rows).unwrap();
    let expected = problem.solve::<37, 703>(&assumed).unwrap();

    let mut stated = instruments();
    stated.plane_count = 0;
    let (found, error) = solve(&in_c, &stated, &mut outcome);
    assert_eq!((found, error.status), (status::OK, status::OK));
    let mut place = [0.0; 4];
    let found = observation_outcome_point(outcome.held(), 0, output(&mut place));
    assert_eq!(found, status::OK);
    assert_eq!(bits(&place), bits(&expected.point(&known, 0)));
    let (mut rotation, mut translation) = ([[0.0; 3]; 3], [0.0; 3]);
    let (turned, moved) = (output(&mut rotation), output(&mut translation));
    assert_eq!(
        observation_outcome_frame(outcome.held(), turned, moved),
        status::OK
    );
    let frame = expected.frame();
    for (row, values) in rotation.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            assert_eq!(value.to_bits(), frame.rotation[(row, column)].to_bits());
        }
    }
    assert_eq!(bits(&translation), bits(frame.translation.as_slice()));

    let mut joint = Place::new();
    let (new, size) = (joint.new_object(), joint.size());
    assert_eq!(
        observation_outcome_joint(outcome.held(), new, size),
        status::OK
    );
    let mut covariance = [[0.0; 24]; 24];
    assert_eq!(
        joint_outcome_covariance(joint.held(), output(&mut covariance)),
        status::OK
    );
    let expected = expected.of_robot().estimate.covariance.unwrap();
    for (row, values) in covariance.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            assert_eq!(value.to_bits(), expected[(row, column)].to_bits());
        }
    }
}

#[test]
fn a_plane_that_is_known_is_the_cores() {
    let chosen = |index: &usize| index % 4 >= 2;
    let (in_c, of_core): (Vec<_>, Vec<_>) = observed()
        .into_iter()
        .enumerate()
        .filter(|(index, _)| chosen(index))
        .map(|(_, pair)| pair)
        .unzip();
    let known = delta_cal::observations::Instruments {
        frame: PositionFrame::Sensor,
        planes: &[delta_cal::observations::Plane {
            known: Some((-560.2, 1.0)),
            level: None,
        }],
        points: &[],
        noise: ObservationNoise::new(noise(), SIGMA, SIGMA).unwrap(),
        transmission: None,
    };
    let robot = nominal::<f64>();
    let assumed = delta_cal::Settings::new()
        .with_noise(noise())
        .with_tolerance(tolerance());
    let mut rows: Vec<_> = of_core.into_iter().map(ObservationRow::new).collect();
    let problem = ObservationProblem::<f64, 36>::prepare(&robot, &known, &mut rows).unwrap();
    let expected = problem.solve::<37, 703>(&assumed).unwrap();

    let mut stated = instruments();
    stated.point_count = 0;
    let mut outcome = Place::new();
    let (found, _) = solve(&in_c, &stated, &mut outcome);
    assert_eq!(found, status::OK);
    let mut plane = [0.0; 3];
    let found = observation_outcome_plane(outcome.held(), 0, output(&mut plane));
    assert_eq!(found, status::OK);
    assert_eq!(bits(&plane), bits(&expected.plane(&known, 0)));
}

#[test]
fn wrong_observations_are_refused_by_their_index() {
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
        let mut wrong = good.clone();
        change(&mut wrong[5]);
        let mut outcome = Place::new();
        let (found, error) = solve(&wrong, &stated, &mut outcome);
        assert_eq!((found, error.status, error.index), (expected, expected, 5));
        let unmade = observation_outcome_plane(outcome.held(), 0, output(&mut [0.0; 3]));
        assert_eq!(unmade, status::NOT_INITIALIZED);
    }
    stated.planes[0].sigma = -1.0;
    let (found, _) = solve(&good, &stated, &mut Place::new());
    assert_eq!(found, status::KNOWN_PLACE);
}
