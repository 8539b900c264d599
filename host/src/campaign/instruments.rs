//! Simulated robots: their true geometry, where they are measured, with what, what that reads, and where they are tested.

use super::plan::{Measure, Plan, Scenario, Spread};
use crate::files::input::InputError;
use crate::files::robot_file::{InstrumentFacts, RobotFile};
use crate::files::samples_file::{Reading, ReadingFrom, Readings, Row};
use crate::fit::Frame;
use crate::planning::{
    Kind, Order, PLANE, PlanError, PlanRequest, Planned, Setup, Wishes, plan as planned,
    random_measurements,
};
use delta_cal::frame::RigidTransform;
use delta_cal::robot::{Arm, ParameterKind, Transmission};
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Noise, Parameter, Robot, Sample};
use nalgebra::{Rotation3, Vector3};
use rand_core::{Rng, SeedableRng};
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
pub(super) struct InstrumentReadings {
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
) -> Option<InstrumentReadings> {
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
    Some(InstrumentReadings {
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
        let mut reading = Reading::at(planned.pose.joints);
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
        sigma: reading.sigma,
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

/// Poses over which the position error is stated; none of them is among the measured ones.
pub const HELD_OUT_POSES: usize = 100;

/// A robot whose true parameters are known, and measurements of it.
#[derive(Debug, Clone)]
pub(super) struct SimulatedRobot {
    pub(super) truth: Robot<f64>,
    pub(super) read: Read,
    /// Joint angles that were not measured, radians.
    pub(super) held_out: Vec<[f64; 3]>,
}

/// What was read of it.
#[derive(Debug, Clone)]
pub(super) enum Read {
    /// Positions, with noise, and the exact joint angles, radians.
    Positions(Vec<Sample<f64>>, Vec<[f64; 3]>),
    /// Readings of an instrument.
    Readings(Box<InstrumentReadings>),
}

/// The robot that a seed stands for, as it is measured. `None`
/// if the start error makes no robot of it, one without usable poses within the joint limits, or one
/// that does not reach the planned ones.
pub(super) fn simulate(
    plan: &Plan,
    scenario: &Scenario,
    at: &MeasuredAt,
    seed: u64,
) -> Option<SimulatedRobot> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let truth = true_robot(plan, scenario, &mut rng)?;
    let read = match at {
        MeasuredAt::With(with) => {
            Read::Readings(Box::new(readings(&truth, scenario, with, &mut rng)?))
        }
        MeasuredAt::RandomPoses => positions(plan, scenario, None, &truth, &mut rng)?,
        MeasuredAt::Poses(joints) => positions(plan, scenario, Some(joints), &truth, &mut rng)?,
    };
    let held_out = (0..HELD_OUT_POSES)
        .map(|_| random_pose(&truth, &plan.robot.limits, &mut rng).map(|pose| pose.joints))
        .collect::<Result<_, _>>()
        .ok()?;
    Some(SimulatedRobot {
        truth,
        read,
        held_out,
    })
}

fn positions(
    plan: &Plan,
    scenario: &Scenario,
    planned: Option<&Joints>,
    truth: &Robot<f64>,
    rng: &mut Pcg32,
) -> Option<Read> {
    let count = scenario.shared.poses;
    let mut samples = Vec::with_capacity(count);
    let mut measured = Vec::with_capacity(count);
    for index in 0..count {
        let pose = match planned {
            Some(joints) => simulate_sample(truth, joints.get(index)?, None, rng).ok()?,
            None => random_pose(truth, &plan.robot.limits, rng).ok()?,
        };
        measured.push(pose.joints);
        samples.push(match &scenario.noise {
            None => pose,
            noise => simulate_sample(truth, &pose.joints, noise.as_ref(), rng).ok()?,
        });
    }
    Some(Read::Positions(samples, measured))
}

fn true_robot(plan: &Plan, scenario: &Scenario, rng: &mut Pcg32) -> Option<Robot<f64>> {
    let case = &scenario.shared;
    let [first, second, third] = plan.robot.robot.arms();
    let common = match case.start_error_radius_mm {
        radius if radius > 0.0 => radius * scatter(case.spread, rng),
        _ => 0.0,
    };
    let mut arm = |nominal: &Arm<f64>| {
        let mut parameters = nominal.parameters();
        for parameter in nominal.drive().parameters() {
            let bound = match parameter.kind() {
                ParameterKind::Length => case.start_error_mm,
                // A tower that leans and a belt that is too long by as much move the platform alike.
                ParameterKind::Angle | ParameterKind::Ratio => case.start_error_deg.to_radians(),
            };
            parameters[parameter.index()] += bound * scatter(case.spread, rng);
        }
        let [x, y, ..] = nominal.parameters();
        let radius = x.hypot(y);
        if common != 0.0 && radius > 0.0 {
            parameters[0] += common * x / radius;
            parameters[1] += common * y / radius;
        }
        if case.start_error_zero_deg > 0.0 {
            let turn = case.start_error_zero_deg.to_radians() * scatter(case.spread, rng);
            turn_upper_arm(nominal, &mut parameters, turn);
        }
        nominal.with_parameters(parameters).ok()
    };
    let truth = Robot::new([arm(first)?, arm(second)?, arm(third)?]).ok()?;
    let Some(tolerance) = &plan.robot.transmission else {
        return Some(truth);
    };
    let mut off = |own: Transmission<f64>| {
        let off = own
            .numbers()
            .map(|number| number + tolerance.sigma() * scatter(case.spread, rng));
        Transmission::new(off).ok()
    };
    let [first, second, third] = truth.transmissions();
    let transmissions = [off(first)?, off(second)?, off(third)?];
    truth.with_transmissions(transmissions).ok()
}

/// The upper arm in another direction where the joint reads 0, as much longer as its `La_x` is.
fn turn_upper_arm(nominal: &Arm<f64>, parameters: &mut [f64; 8], turn: f64) {
    let (x, y) = nominal.la();
    let place = Parameter::LaX.index();
    let length = nominal.upper_arm_length() + parameters[place] - x;
    let direction = y.atan2(x) + turn;
    parameters[place] = length * direction.cos();
    parameters[place + 1] = length * direction.sin();
}

/// In units of the start error.
fn scatter(spread: Spread, rng: &mut Pcg32) -> f64 {
    match spread {
        Spread::Uniform => f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0,
        Spread::Normal => standard_normal::<f64, _>(rng),
    }
}
