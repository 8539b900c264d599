//! Simulated robots: true geometry, measured poses and held-out poses.

use super::plan::{Case, Plan, Spread};
use crate::files::{InputError, RobotFile, Tool};
use crate::geometry::Parallelograms;
use crate::planning::{Kind, Order, PlanRequest, Wishes, plan as planned};
use delta_cal::robot::{Arm, ParameterKind};
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Parameter, Robot, Sample};
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Joint angles of planned poses, radians; `None` for random poses, different for each robot.
pub(super) type Planned = Option<Vec<[f64; 3]>>;

/// Plans poses as a user would: once, for the nominal robot and the case's noise, without a tolerance. All robots of
/// the case are measured at them.
pub(super) fn measured_at(plan: &Plan, case: &Case) -> Result<Planned, InputError> {
    if !case.planned {
        return Ok(None);
    }
    let robot = RobotFile {
        noise: case.noise(),
        tolerance: None,
        ..plan.robot.clone()
    };
    let request = PlanRequest {
        seed: plan.seed,
        absolute: true,
        order: Order::Shortest,
        ..PlanRequest::new(&robot, Wishes::only(Kind::XYZ), case.poses)
    };
    let found = planned(&request).map_err(|error| {
        InputError::new(&robot.name, format!("planned = [true]: {error}"))
            .with_remedy(error.remedy())
    })?;
    let poses = found.measurements.iter();
    Ok(Some(poses.map(|own| own.reading.joints).collect()))
}

/// Random poses tried for one where the robot works.
const TRIED: u32 = 10_000;
/// Number of poses over which the position error is evaluated; none of them is measured.
pub const HELD_OUT_POSES: usize = 100;

/// A robot with known true parameters, and its measurements.
#[derive(Debug, Clone)]
pub(super) struct SimulatedRobot {
    pub(super) truth: Robot<f64>,
    /// The tool, with the true rods.
    pub(super) tool: Tool,
    /// Samples, including noise; where the platform tilts, of each target in turn.
    pub(super) samples: Vec<Sample<f64>>,
    /// The rotation in each sample, radians, if the noise of rotations is stated.
    pub(super) turns: Vec<Vector3<f64>>,
    /// The exact joint angles of the samples, radians.
    pub(super) measured: Vec<[f64; 3]>,
    /// Joint angles of the held-out poses, radians.
    pub(super) held_out: Vec<[f64; 3]>,
}

/// Simulates the robot of a seed and its measurements. `None` if the start error yields no valid robot, no usable poses
/// within the joint limits, or a robot that does not reach the planned poses.
pub(super) fn simulate(
    plan: &Plan,
    case: &Case,
    planned: &Planned,
    seed: u64,
) -> Option<SimulatedRobot> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let truth = true_robot(plan, case, &mut rng)?;
    let stated = plan.robot.parallelograms;
    let rods = stated.map(|own| true_rods(own, &mut rng));
    let targets = plan.robot.instruments.targets.iter();
    let mut places: Vec<_> = targets.map(|own| own.place).collect();
    if rods.is_none() || places.is_empty() {
        places = vec![Vector3::zeros()];
    }
    let count = case.poses;
    let noise = case.noise();
    let orientation = plan.robot.instruments.orientation_noise;
    let (mut samples, mut turns) = (Vec::with_capacity(count), Vec::new());
    let mut measured = Vec::with_capacity(count);
    for index in 0..count {
        let pose = match planned {
            Some(joints) => simulate_sample(&truth, joints.get(index)?, None, &mut rng).ok()?,
            None => worked(plan, &truth, &mut rng)?,
        };
        measured.push(pose.joints);
        for place in &places {
            let mut sample = match &noise {
                None => pose,
                noise => simulate_sample(&truth, &pose.joints, noise.as_ref(), &mut rng).ok()?,
            };
            if let Some(rods) = rods {
                let there = rods.pose(&truth, &pose.joints).ok()?;
                sample.position += there.of(place) - pose.position;
                turns.extend(orientation.map(|sigma| {
                    let noise =
                        Vector3::from_fn(|_, _| sigma * standard_normal::<f64, _>(&mut rng));
                    there.tilt + noise
                }));
            }
            samples.push(sample);
        }
    }
    let held_out = (0..HELD_OUT_POSES)
        .map(|_| worked(plan, &truth, &mut rng).map(|pose| pose.joints))
        .collect::<Option<_>>()?;
    Some(SimulatedRobot {
        truth,
        tool: Tool {
            parallelograms: rods,
            ..plan.tool()
        },
        samples,
        turns,
        measured,
        held_out,
    })
}

/// A random pose. Where the platform tilts it is clear of singularities and where the robot works: near a singularity of its
/// rotation a platform turns far.
fn worked(plan: &Plan, truth: &Robot<f64>, rng: &mut Pcg32) -> Option<Sample<f64>> {
    let file = &plan.robot;
    let random = |_| random_pose(truth, &file.limits, rng);
    if file.parallelograms.is_none() {
        return (0..1).find_map(random);
    }
    let clear = |pose: &Sample<f64>| {
        let reach = file.reach();
        let clear = reach.clear_position(&file.robot, &pose.joints).is_ok();
        clear && file.within.is_none_or(|own| own.contains(&pose.position))
    };
    (0..TRIED).filter_map(random).find(clear)
}

/// Rods made to their tolerance, normal.
fn true_rods(stated: Parallelograms, rng: &mut Pcg32) -> Parallelograms {
    let numbers = stated.numbers.as_flattened().iter().zip(stated.sigmas());
    let numbers = numbers.map(|(own, sigma)| own + sigma * standard_normal::<f64, _>(rng));
    stated.with_numbers(&numbers.collect::<Vec<_>>())
}

fn true_robot(plan: &Plan, case: &Case, rng: &mut Pcg32) -> Option<Robot<f64>> {
    let [first, second, third] = plan.robot.robot.arms();
    let common = match case.start_error_radius_mm {
        radius if radius > 0.0 => radius * scatter(case.spread, rng),
        _ => 0.0,
    };
    let mut arm = |nominal: &Arm<f64>| {
        let mut parameters = nominal.parameters();
        for parameter in nominal.drive().parameters() {
            let of_kind = match parameter.kind() {
                ParameterKind::Length => case.start_error_mm,
                // A leaning tower and an equal relative error of the belt move the platform by the same amount.
                ParameterKind::Angle | ParameterKind::Ratio => case.start_error_deg.to_radians(),
            };
            let bound = plan.robot.single(*parameter).unwrap_or(of_kind);
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
    Robot::new([arm(first)?, arm(second)?, arm(third)?]).ok()
}

/// Turns the upper arm at joint reading 0. Its length changes by the error already drawn for `La_x`.
fn turn_upper_arm(nominal: &Arm<f64>, parameters: &mut [f64; 8], turn: f64) {
    let (x, y) = nominal.la();
    let place = Parameter::LaX.index();
    let length = nominal.upper_arm_length() + parameters[place] - x;
    let direction = y.atan2(x) + turn;
    parameters[place] = length * direction.cos();
    parameters[place + 1] = length * direction.sin();
}

/// A random error in units of the start error.
fn scatter(spread: Spread, rng: &mut Pcg32) -> f64 {
    match spread {
        Spread::Uniform => f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0,
        Spread::Normal => standard_normal::<f64, _>(rng),
    }
}
