//! The planned poses of a campaign.

use super::CampaignError;
use super::plan::{Plan, Scenario};
use crate::files::input_error::InputError;
use crate::files::robot_file::RobotFile;
use crate::planning::poses::{PlanRequest, plan as plan_poses};

/// Joint angles (radians) of one plan.
pub(super) type Joints = Vec<[f64; 3]>;

/// What a plan is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Purpose {
    poses: usize,
    position_mm: f64,
    joint_deg: f64,
}

impl Purpose {
    fn of(scenario: &Scenario) -> Self {
        Self {
            poses: scenario.poses,
            position_mm: scenario.noise_level.position_mm,
            joint_deg: scenario.noise_level.joint_deg,
        }
    }
}

/// For every number of poses and noise of a campaign the poses that a user would plan: once, for
/// the nominal robot, the IKM method and the scenario's noise, without a tolerance. All robots of a
/// scenario are measured at the same joint angles.
#[derive(Debug, Default)]
pub(super) struct PlannedPoses(Vec<(Purpose, Joints)>);

impl PlannedPoses {
    /// Plans for the scenarios that ask for it.
    pub(super) fn of(plan: &Plan) -> Result<Self, CampaignError> {
        let mut planned = Self::default();
        for scenario in plan.scenarios().iter().filter(|scenario| scenario.planned) {
            if planned.joints(scenario).is_some() {
                continue;
            }
            let robot = RobotFile {
                noise: scenario.noise,
                tolerance: None,
                ..plan.robot.clone()
            };
            let request = PlanRequest {
                count: scenario.poses,
                seed: plan.seed,
                ..PlanRequest::new(&robot)
            };
            let poses = plan_poses(&request).map_err(|error| {
                CampaignError::Input(
                    InputError::new(&robot.name, format!("planned = [true]: {error}"))
                        .with_remedy(error.remedy()),
                )
            })?;
            let joints = poses.poses.iter().map(|pose| pose.joints).collect();
            planned.0.push((Purpose::of(scenario), joints));
        }
        Ok(planned)
    }

    /// The poses of a scenario that asks for planned ones; `None` if it does not.
    pub(super) fn joints(&self, scenario: &Scenario) -> Option<&Joints> {
        let purpose = Purpose::of(scenario);
        let known = self.0.iter().find(|(known, _)| *known == purpose);
        known.filter(|_| scenario.planned).map(|(_, joints)| joints)
    }
}
