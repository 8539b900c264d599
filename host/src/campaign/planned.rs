//! Where the robots of a campaign are measured, and with what.

use super::CampaignError;
use super::plan::{Measure, NoiseLevel, Plan, Scenario};
use crate::files::input_error::InputError;
use crate::files::robot_file::RobotFile;
use crate::planning::{
    Kind, Order, PlanError, PlanRequest, Planned, Setup, Wishes, plan as planned,
};
use delta_cal::{Noise, Tolerance};

/// Joint angles (radians) of one plan.
pub(super) type Joints = Vec<[f64; 3]>;

/// What a calibration takes for the noise of exact readings, mm: it needs one.
pub(super) const EXACT: f64 = 1e-3;

/// Where the robots of a scenario are measured, and with what.
#[derive(Debug)]
pub(super) enum MeasuredAt {
    /// x, y and z at random poses.
    RandomPoses,
    /// x, y and z at the same poses.
    Poses(Joints),
    /// What an instrument reads.
    With(Box<Instrumented>),
}

/// An instrument, where it stands.
#[derive(Debug)]
pub(super) struct Instrumented {
    pub(super) setup: Setup,
    pub(super) kinds: Wishes,
    /// Random ones if `None`.
    pub(super) planned: Option<Vec<Planned>>,
}

/// For what a plan is made.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Purpose {
    measure: Measure,
    poses: usize,
    noise_level: NoiseLevel,
    planned: bool,
    /// Where it matters.
    tolerance: Option<Tolerance<f64>>,
}

impl Purpose {
    fn of(scenario: &Scenario) -> Self {
        Self {
            measure: scenario.measure,
            poses: scenario.poses,
            noise_level: scenario.noise_level,
            planned: scenario.planned,
            tolerance: match scenario.measure {
                Measure::Positions => None,
                Measure::With(_) => scenario.tolerance,
            },
        }
    }
}

/// Of every scenario of a campaign. Planned poses and measurements are those that a user would plan: once, for the
/// nominal robot and the scenario's noise; poses for the IKM method and without a tolerance. All robots of a
/// scenario are measured at the same joint angles then.
#[derive(Debug)]
pub(super) struct AllMeasuredAt {
    known: Vec<(Purpose, MeasuredAt)>,
    /// Scenarios before those that are known.
    finished: usize,
    of_scenarios: Vec<usize>,
}

impl AllMeasuredAt {
    /// Plans what is to be planned. Nobody is measured any more in the first scenarios, so many as `finished`.
    pub(super) fn of(plan: &Plan, finished: usize) -> Result<Self, CampaignError> {
        let mut all = Self {
            known: Vec::new(),
            finished,
            of_scenarios: Vec::new(),
        };
        for scenario in plan.scenarios().iter().skip(finished) {
            let purpose = Purpose::of(scenario);
            let known = all.known.iter().position(|(known, _)| *known == purpose);
            if known.is_none() {
                all.known.push((purpose, measured_at(plan, scenario)?));
            }
            let index = known.unwrap_or(all.known.len() - 1);
            all.of_scenarios.push(index);
        }
        Ok(all)
    }

    /// Of a scenario, by its index, that is not finished.
    pub(super) fn scenario(&self, index: usize) -> &MeasuredAt {
        &self.known[self.of_scenarios[index - self.finished]].1
    }
}

fn measured_at(plan: &Plan, scenario: &Scenario) -> Result<MeasuredAt, CampaignError> {
    let failed = |error: PlanError| {
        CampaignError::Input(
            InputError::new(&plan.robot.name, format!("planned = [true]: {error}"))
                .with_remedy(error.remedy()),
        )
    };
    match scenario.measure {
        Measure::Positions if !scenario.planned => Ok(MeasuredAt::RandomPoses),
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
                ..PlanRequest::new(&robot, Wishes::only(Kind::XYZ), scenario.poses)
            };
            let plan = planned(&request).map_err(failed)?;
            let joints = plan
                .measurements
                .iter()
                .map(|own| own.pose.joints)
                .collect();
            Ok(MeasuredAt::Poses(joints))
        }
        Measure::With(instrument) => {
            let sigma = match scenario.noise {
                Some(_) => scenario.noise_level.position_mm,
                None => EXACT,
            };
            let joint = scenario.noise.map_or(0.0, |noise| noise.joint());
            let robot = RobotFile {
                noise: Noise::new(sigma, joint).ok(),
                tolerance: scenario.tolerance,
                ..plan.robot.clone()
            };
            let robot = instrument.equips(&robot, sigma);
            let request = PlanRequest {
                seed: plan.seed,
                frame: instrument.frame,
                order: Order::Shortest,
                ..PlanRequest::new(&robot, Wishes::only(instrument.kind), scenario.poses)
            };
            let planned = if scenario.planned {
                Some(planned(&request).map_err(failed)?.measurements)
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
