//! The plan for programs.

use crate::poses::{Assumptions, Expectation, PlanRequest, PosePlan, PosesNeeded};
use crate::position_uncertainty::PositionSigma;
use crate::units::degrees;
use delta_cal::robot::ParameterKind;
use delta_cal::{Parameter, Sample};
use serde::Serialize;

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole plan. Lengths in millimetres, angles in degrees; `null` where a figure is unknown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonPlan {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The program's version.
    pub program_version: &'static str,
    /// Name of the robot file.
    pub robot_file: String,
    /// `ikm` or `fkm`.
    pub method: &'static str,
    /// `a` or `d`.
    pub criterion: &'static str,
    /// What the random numbers began with.
    pub seed: u64,
    /// As on the command line; `null` if the platform may be anywhere.
    pub within: Option<String>,
    /// What was planned for.
    pub assumptions: JsonAssumptions,
    /// From the limits and from singularities.
    pub margin_deg: JsonMargin,
    /// The poses in their order.
    pub poses: Vec<JsonPose>,
    /// Of the joint that moves furthest from pose to pose, summed up.
    pub travel_deg: f64,
    /// What to expect.
    pub planned: JsonExpectation,
    /// Whether the poses determine every parameter without the tolerance, too.
    pub determined_without_tolerance: bool,
    /// The median over sets of random poses.
    pub random: JsonExpectation,
    /// How many poses reach the wanted accuracy; `null` if none was wanted.
    pub accuracy: Option<JsonPosesNeeded>,
}

/// By how much the poses are inside the limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonMargin {
    /// From the joints' limits.
    pub joints: f64,
    /// From the forearms' limit.
    pub forearms: f64,
    /// Of a forearm from its upper arm's line.
    pub serial: f64,
    /// Of a forearm from the plane of the other two.
    pub parallel: f64,
}

/// Noise and tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonAssumptions {
    /// One σ of a coordinate.
    pub noise_position_mm: f64,
    /// One σ of a joint angle.
    pub noise_joint_deg: f64,
    /// Whether the robot file states them.
    pub noise_stated: bool,
    /// One σ of a length; `null` without a tolerance.
    pub tolerance_length_mm: Option<f64>,
    /// One σ of an angle.
    pub tolerance_angle_deg: Option<f64>,
}

/// One pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonPose {
    /// Joint angles.
    pub joints_deg: [f64; 3],
    /// Where the nominal robot is then.
    pub position_mm: [f64; 3],
}

/// What to expect, as standard deviations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonExpectation {
    /// √tr of the Cramér–Rao bound, angles times the upper arm's length.
    pub parameter_error_mm: Option<f64>,
    /// Of the position over the workspace.
    pub position_workspace: JsonPositionSigma,
    /// Of the position over the region; `null` without one.
    pub position_region: Option<JsonPositionSigma>,
    /// Of every parameter of every arm.
    pub parameters: Vec<JsonParameterSigma>,
}

/// σ of the position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonPositionSigma {
    /// √ of the mean square.
    pub rms_mm: Option<f64>,
    /// The largest.
    pub max_mm: Option<f64>,
}

/// σ of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonParameterSigma {
    /// 1, 2 or 3.
    pub arm: usize,
    /// `Dx, Dy, Dz, theta, alpha, La_x, La_y` or `Lb`.
    pub symbol: &'static str,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// One standard deviation.
    pub sigma: Option<f64>,
}

/// How many poses reach an accuracy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonPosesNeeded {
    /// The accuracy.
    pub position_sigma_mm: f64,
    /// For the rms.
    pub poses_rms: usize,
    /// For the worst place.
    pub poses_everywhere: usize,
}

impl JsonPlan {
    /// Of a plan.
    pub fn new(request: &PlanRequest<'_>, plan: &PosePlan, needed: Option<&PosesNeeded>) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION"),
            robot_file: request.robot.name.clone(),
            method: request.method.name(),
            criterion: request.criterion.name(),
            seed: request.seed,
            within: request.region.map(|region| region.to_string()),
            assumptions: JsonAssumptions::of(&plan.assumptions),
            margin_deg: JsonMargin {
                joints: degrees(plan.margin.joints),
                forearms: degrees(plan.margin.forearms),
                serial: degrees(plan.margin.serial),
                parallel: degrees(plan.margin.parallel),
            },
            poses: plan.poses.iter().map(JsonPose::of).collect(),
            travel_deg: degrees(plan.travel),
            planned: JsonExpectation::of(&plan.planned),
            determined_without_tolerance: plan.determined_alone,
            random: JsonExpectation::of(&plan.random),
            accuracy: needed.map(|needed| JsonPosesNeeded {
                position_sigma_mm: needed.accuracy,
                poses_rms: needed.rms,
                poses_everywhere: needed.everywhere,
            }),
        }
    }

    /// As text, indented, ending in a new line.
    ///
    /// # Errors
    /// None is known; the serialiser's, if it had one.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}

impl JsonAssumptions {
    pub(in crate::report) fn of(assumptions: &Assumptions) -> Self {
        let tolerance = assumptions.tolerance.as_ref();
        Self {
            noise_position_mm: assumptions.noise.position(),
            noise_joint_deg: degrees(assumptions.noise.joint()),
            noise_stated: assumptions.noise_stated,
            tolerance_length_mm: tolerance.map(|tolerance| tolerance.of(Parameter::Lb)),
            tolerance_angle_deg: tolerance.map(|tolerance| degrees(tolerance.of(Parameter::Theta))),
        }
    }
}

impl JsonPose {
    pub(in crate::report) fn of(pose: &Sample<f64>) -> Self {
        Self {
            joints_deg: pose.joints.map(degrees),
            position_mm: pose.position.data.0[0],
        }
    }
}

impl JsonExpectation {
    fn of(expectation: &Expectation) -> Self {
        let sigmas = expectation.parameters.iter().zip(1..);
        Self {
            parameter_error_mm: finite(expectation.bound),
            position_workspace: JsonPositionSigma::of(&expectation.workspace),
            position_region: expectation.region.as_ref().map(JsonPositionSigma::of),
            parameters: sigmas
                .flat_map(|(own, arm)| {
                    Parameter::ALL
                        .into_iter()
                        .zip(own)
                        .map(move |(parameter, sigma)| {
                            let (unit, factor) = match parameter.kind() {
                                ParameterKind::Length => ("mm", 1.0),
                                ParameterKind::Angle => ("deg", 1f64.to_degrees()),
                            };
                            JsonParameterSigma {
                                arm,
                                symbol: parameter.symbol(),
                                unit,
                                sigma: finite(factor * sigma),
                            }
                        })
                })
                .collect(),
        }
    }
}

impl JsonPositionSigma {
    fn of(sigma: &PositionSigma) -> Self {
        Self {
            rms_mm: finite(sigma.rms),
            max_mm: finite(sigma.max),
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
