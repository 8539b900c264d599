//! One simulated robot: its true geometry, what is measured of it, and where it is tested.

use super::mixing::mixed;
use super::plan::{Plan, Scenario, Spread};
use super::planned::Joints;
use delta_cal::robot::{Arm, ParameterKind};
use delta_cal::simulate::{random_pose, simulate_sample, standard_normal};
use delta_cal::{Parameter, Robot, Sample};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Poses over which the position error is stated; none of them is among the measured ones.
pub const HELD_OUT_POSES: usize = 100;

/// A robot whose true parameters are known, and measurements of it.
#[derive(Debug, Clone)]
pub(super) struct SimulatedRobot {
    pub(super) truth: Robot<f64>,
    /// With noise.
    pub(super) samples: Vec<Sample<f64>>,
    /// The exact joint angles of the samples, radians.
    pub(super) measured: Vec<[f64; 3]>,
    /// Joint angles that were not measured, radians.
    pub(super) held_out: Vec<[f64; 3]>,
}

/// The seed of one robot. It depends on the scenario's values, not on its place in the file: a
/// longer list adds cases and leaves the others' robots as they were.
pub(super) fn seed(plan: &Plan, scenario: &Scenario, robot: u64) -> u64 {
    [
        scenario.poses as u64,
        scenario.start_error.length_mm.to_bits(),
        scenario.start_error.angle_deg.to_bits(),
        scenario.noise_level.position_mm.to_bits(),
        scenario.noise_level.joint_deg.to_bits(),
        u64::from(scenario.planned),
        robot,
    ]
    .into_iter()
    .fold(mixed(plan.seed), |state, value| mixed(state ^ value))
}

/// The robot that a seed stands for, measured at the planned joint angles or at random ones. `None`
/// if the start error makes no robot of it, one without usable poses within the joint limits, or one
/// that does not reach the planned ones.
pub(super) fn simulate(
    plan: &Plan,
    scenario: &Scenario,
    planned: Option<&Joints>,
    seed: u64,
) -> Option<SimulatedRobot> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let truth = true_robot(plan, scenario, &mut rng)?;
    let mut samples = Vec::with_capacity(scenario.poses);
    let mut measured = Vec::with_capacity(scenario.poses);
    for index in 0..scenario.poses {
        let pose = match planned {
            Some(joints) => simulate_sample(&truth, joints.get(index)?, None, &mut rng).ok()?,
            None => random_pose(&truth, &plan.robot.limits, &mut rng).ok()?,
        };
        measured.push(pose.joints);
        samples.push(match &scenario.noise {
            None => pose,
            noise => simulate_sample(&truth, &pose.joints, noise.as_ref(), &mut rng).ok()?,
        });
    }
    let held_out = (0..HELD_OUT_POSES)
        .map(|_| random_pose(&truth, &plan.robot.limits, &mut rng).map(|pose| pose.joints))
        .collect::<Result<_, _>>()
        .ok()?;
    Some(SimulatedRobot {
        truth,
        samples,
        measured,
        held_out,
    })
}

fn true_robot(plan: &Plan, scenario: &Scenario, rng: &mut Pcg32) -> Option<Robot<f64>> {
    let [first, second, third] = plan.robot.robot.arms();
    let mut arm = |nominal: &Arm<f64>| {
        let parameters = Parameter::ALL.map(|parameter| {
            let bound = match parameter.kind() {
                ParameterKind::Length => scenario.start_error.length_mm,
                ParameterKind::Angle => scenario.start_error.angle_deg.to_radians(),
            };
            nominal.get(parameter) + bound * scatter(plan.spread, rng)
        });
        Arm::new(parameters).ok()
    };
    Robot::new([arm(first)?, arm(second)?, arm(third)?]).ok()
}

/// In units of the start error.
fn scatter(spread: Spread, rng: &mut Pcg32) -> f64 {
    match spread {
        Spread::Uniform => f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0,
        Spread::Normal => standard_normal::<f64, _>(rng),
    }
}
