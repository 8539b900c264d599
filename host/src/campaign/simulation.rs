//! One simulated robot: its true geometry, what is measured of it, and where it is tested.

use super::instruments::{Joints, MeasuredAt, Read as Readings, readings};
use super::plan::{Plan, Scenario, Spread};
use delta_cal::robot::{Arm, ParameterKind, Transmission};
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Robot, Sample};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

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
    Readings(Box<Readings>),
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

/// In units of the start error.
fn scatter(spread: Spread, rng: &mut Pcg32) -> f64 {
    match spread {
        Spread::Uniform => f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0,
        Spread::Normal => standard_normal::<f64, _>(rng),
    }
}
