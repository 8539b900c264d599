//! Where the robots of a campaign are measured, with what, and what that reads.

use super::plan::{Measure, Plan, Scenario};
use crate::files::input_error::InputError;
use crate::files::robot_file::{InstrumentFacts, RobotFile};
use crate::files::samples_file::{Reading, ReadingFrom, Readings, Row};
use crate::fit::options::Frame;
use crate::planning::{
    Kind, Order, PLANE, PlanError, PlanRequest, Planned, Setup, Wishes, plan as planned,
    random_measurements,
};
use delta_cal::frame::RigidTransform;
use delta_cal::simulate::standard_normal;
use delta_cal::{Noise, Robot};
use nalgebra::{Rotation3, Vector3};
use rand_pcg::Pcg32;

/// Joint angles (radians) of one plan.
pub(super) type Joints = Vec<[f64; 3]>;

/// What a calibration takes for the noise of exact readings, mm: it needs one.
const EXACT: f64 = 1e-3;
/// One σ of the height of a plate, mm, and of its two slopes.
const PLATE_OFF: f64 = 3.0;
const PLATE_TILT: f64 = 0.005;
/// One σ of each coordinate of a point, mm.
const POINT_OFF: f64 = 5.0;
/// One σ of each coordinate of the origin of a sensor's frame, mm, and of its turns, radians.
const SENSOR_OFF: f64 = 300.0;
const SENSOR_TURN: f64 = 0.5;
/// Measurements that are drawn for each that is wanted: some robots do not reach what is drawn.
const DRAWN: usize = 2;

/// Where the robots of a scenario are measured, and with what.
#[derive(Debug, Clone)]
pub(super) enum MeasuredAt {
    /// x, y and z at random poses.
    RandomPoses,
    /// x, y and z at the same poses.
    Poses(Joints),
    /// What an instrument reads.
    With(Box<Instrumented>),
}

/// An instrument, where it stands.
#[derive(Debug, Clone)]
pub(super) struct Instrumented {
    setup: Setup,
    kinds: Wishes,
    /// Random ones if `None`.
    planned: Option<Vec<Planned>>,
}

/// What an instrument read of a robot.
#[derive(Debug, Clone)]
pub(super) struct Read {
    /// With noise.
    pub(super) file: Readings,
    /// Without.
    pub(super) exact: Readings,
    pub(super) frame: Frame,
}

/// Poses and measurements as a user would plan them: once, for the nominal robot and the scenario's
/// noise; poses for the IKM method and without a tolerance. All robots of a scenario are measured
/// there.
pub(super) fn measured_at(plan: &Plan, scenario: &Scenario) -> Result<MeasuredAt, InputError> {
    plan_of(plan, scenario).map_err(|error| {
        InputError::new(&plan.robot.name, format!("planned = [true]: {error}"))
            .with_remedy(error.remedy())
    })
}

fn plan_of(plan: &Plan, scenario: &Scenario) -> Result<MeasuredAt, PlanError> {
    let count = scenario.shared.poses;
    match scenario.measure {
        Measure::Positions if !scenario.shared.planned => Ok(MeasuredAt::RandomPoses),
        Measure::Positions => {
            let robot = RobotFile {
                noise: scenario.noise,
                tolerance: None,
                ..plan.robot.clone()
            };
            let request = PlanRequest {
                seed: plan.seed,
                absolute: true,
                order: Order::Shortest,
                ..PlanRequest::new(&robot, Wishes::only(Kind::XYZ), count)
            };
            let found = planned(&request)?.measurements;
            let joints = found.iter().map(|own| own.pose.joints).collect();
            Ok(MeasuredAt::Poses(joints))
        }
        Measure::With(instrument) => {
            let robot = instrument.equips(&known(plan, scenario, true), sigma(scenario));
            let request = PlanRequest {
                seed: plan.seed,
                frame: instrument.frame,
                order: Order::Shortest,
                ..PlanRequest::new(&robot, Wishes::only(instrument.kind), count)
            };
            let planned = if scenario.shared.planned {
                Some(planned(&request)?.measurements)
            } else {
                None
            };
            Ok(MeasuredAt::With(Box::new(Instrumented {
                setup: Setup::of(&request),
                kinds: request.kinds,
                planned,
            })))
        }
    }
}

/// Of a reading, as it is stated.
fn sigma(scenario: &Scenario) -> f64 {
    match scenario.noise {
        Some(_) => scenario.shared.noise_position_mm,
        None => EXACT,
    }
}

/// The nominal robot as the calibration of an instrument's readings knows it.
pub(super) fn known(plan: &Plan, scenario: &Scenario, prior: bool) -> RobotFile {
    let sigma = sigma(scenario);
    let joint = scenario.noise.map_or(0.0, |noise| noise.joint());
    RobotFile {
        noise: Noise::new(sigma, joint).ok(),
        tolerance: scenario.tolerance.filter(|_| prior),
        instruments: InstrumentFacts {
            height_noise: Some(sigma),
            distance_noise: Some(sigma),
            joint_noise: Some(joint),
            ..InstrumentFacts::default()
        },
        ..plan.robot.clone()
    }
}

/// Where the instruments stand.
struct Places {
    level: f64,
    slopes: [f64; 2],
    points: Vec<Vector3<f64>>,
    frame: RigidTransform<f64>,
}

/// `None` if the robot does not reach the planned measurements, or too few of random ones.
pub(super) fn readings(
    truth: &Robot<f64>,
    scenario: &Scenario,
    with: &Instrumented,
    rng: &mut Pcg32,
) -> Option<Read> {
    let setup = &with.setup;
    let places = Places::drawn(setup, rng);
    let count = scenario.shared.poses;
    let (drawn, all_needed) = match &with.planned {
        Some(planned) => (planned.clone(), true),
        None => (
            random_measurements(setup, &with.kinds, DRAWN * count, rng).ok()?,
            false,
        ),
    };
    let mut exact = Vec::with_capacity(count);
    for planned in &drawn {
        match places.exact(truth, planned) {
            Some(reading) if exact.len() < count => exact.push(reading),
            None if all_needed => return None,
            _ => {}
        }
    }
    if exact.len() < count {
        return None;
    }
    let noise = scenario.noise.as_ref();
    let (sigma, joint) = noise.map_or((0.0, 0.0), |noise| (noise.position(), noise.joint()));
    let noisy: Vec<_> = exact
        .iter()
        .map(|reading| off(reading, sigma, joint, rng))
        .collect();
    Some(Read {
        file: in_file(noisy, setup),
        exact: in_file(exact, setup),
        frame: setup.frame,
    })
}

impl Places {
    fn drawn(setup: &Setup, rng: &mut Pcg32) -> Self {
        let mut near = |sigma: f64| sigma * standard_normal::<f64, _>(rng);
        let plane = setup.planes.first().map_or(0.0, |plane| plane.offset);
        let level = plane + near(PLATE_OFF);
        let slopes = [near(PLATE_TILT), near(PLATE_TILT)];
        let points = setup.points.iter();
        let points = points.map(|own| own.place + Vector3::from_fn(|_, _| near(POINT_OFF)));
        let points = points.collect();
        let frame = match setup.frame {
            Frame::Base => RigidTransform::identity(),
            Frame::Sensor => RigidTransform {
                rotation: *Rotation3::from_scaled_axis(Vector3::from_fn(|_, _| near(SENSOR_TURN)))
                    .matrix(),
                translation: Vector3::from_fn(|_, _| near(SENSOR_OFF)),
            },
        };
        Self {
            level,
            slopes,
            points,
            frame,
        }
    }

    fn exact(&self, truth: &Robot<f64>, planned: &Planned) -> Option<Reading> {
        let at = truth.forward(&planned.pose.joints).ok()?;
        let mut reading = Reading {
            joints: planned.pose.joints,
            position: [None; 3],
            height: None,
            distance: None,
        };
        match planned.kind {
            Kind::Plane => {
                let [a, b] = self.slopes;
                let up = Vector3::new(-a, -b, 1.0);
                reading.height = Some((0, (up.dot(&at) - self.level) / up.norm()));
            }
            Kind::Distance => {
                let other = planned.other?.joints;
                let there = truth.forward(&other).ok()?;
                reading.distance = Some((ReadingFrom::Pose(other), (at - there).norm()));
            }
            Kind::Point => {
                let point = planned.point?;
                let from = self.points.get(point)?;
                reading.distance = Some((ReadingFrom::Point(point), (at - from).norm()));
            }
            Kind::Position(_) => {
                let seen = self.frame.apply(&at);
                for (axis, read) in planned.kind.coordinates().into_iter().enumerate() {
                    reading.position[axis] = read.then_some(seen[axis]);
                }
            }
        }
        Some(reading)
    }
}

/// A reading with the noise of the instrument and of the joints.
fn off(reading: &Reading, sigma: f64, joint: f64, rng: &mut Pcg32) -> Reading {
    let mut near = |value: f64, sigma: f64| value + sigma * standard_normal::<f64, _>(rng);
    Reading {
        joints: reading.joints.map(|q| near(q, joint)),
        position: reading
            .position
            .map(|own| own.map(|value| near(value, sigma))),
        height: reading
            .height
            .map(|(plane, height)| (plane, near(height, sigma))),
        distance: reading.distance.map(|(from, distance)| {
            let from = match from {
                ReadingFrom::Pose(joints) => ReadingFrom::Pose(joints.map(|q| near(q, joint))),
                ReadingFrom::Point(point) => ReadingFrom::Point(point),
            };
            (from, near(distance, sigma))
        }),
    }
}

fn in_file(mut readings: Vec<Reading>, setup: &Setup) -> Readings {
    // Points in the order in which they occur, as a file has them.
    let mut used: Vec<usize> = Vec::new();
    for reading in &mut readings {
        if let Some((ReadingFrom::Point(point), _)) = &mut reading.distance {
            let index = used.iter().position(|known| known == point);
            *point = index.unwrap_or_else(|| {
                used.push(*point);
                used.len() - 1
            });
        }
    }
    let heights = readings.iter().any(|reading| reading.height.is_some());
    let names = used.iter().filter_map(|point| setup.points.get(*point));
    Readings {
        planes: heights.then(|| PLANE.to_owned()).into_iter().collect(),
        points: names.map(|own| own.name.clone()).collect(),
        rows: (2..)
            .zip(readings)
            .map(|(line, value)| Row { line, value })
            .collect(),
        ..Readings::of_name("simulated")
    }
}
