//! The plan for programs.

use crate::accuracy::information::parameters;
use crate::accuracy::position_uncertainty::PositionSigma;
use crate::planning::poses::{Assumptions, Expectation, PlanRequest, PosePlan, PosesNeeded};
use crate::render::json;
use crate::text::joint;
use crate::text::units::{degrees, in_unit, unit};
use delta_cal::robot::Drive;
use delta_cal::{Parameter, Robot, Sample, Tolerance};
use serde_json::{Value, json};

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole plan. Lengths in millimetres, angles in degrees; `null` where a figure is unknown.
pub fn report(request: &PlanRequest<'_>, plan: &PosePlan, needed: Option<&PosesNeeded>) -> Value {
    let drive = request.robot.robot.drive();
    let contents = json!({
        "robot_file": request.robot.name,
        // `ikm` or `fkm`.
        "method": request.method.name(),
        // `a` or `d`.
        "criterion": request.criterion.name(),
        // What the random numbers began with.
        "seed": request.seed,
        // As on the command line; `null` if the platform may be anywhere.
        "within": request.region.map(|region| region.to_string()),
        // What was planned for.
        "assumptions": assumptions(drive, &plan.assumptions),
        // The least over all poses.
        "margin_deg": {
            // From the joints' limits.
            // Of linear drives mm.
            "joints": joint::in_file(drive, plan.margin.joints),
            // From the forearms' limit; `null` without one.
            "forearms": degrees(plan.margin.forearms),
            // Of a forearm from its upper arm's line.
            "serial": degrees(plan.margin.serial),
            // Of a forearm from the plane of the other two.
            "parallel": degrees(plan.margin.parallel),
        },
        // In their order.
        "poses": plan.poses.iter().map(|own| pose(drive, own)).collect::<Vec<_>>(),
        // Of the joint that moves furthest from pose to pose, summed up.
        joint::key("travel", drive): joint::in_file(drive, plan.travel),
        // What to expect.
        "planned": expectation(&request.robot.robot, &plan.planned),
        // Whether the poses determine every parameter without the tolerance, too.
        "determined_without_tolerance": plan.determined_alone,
        // The median over sets of random poses.
        "random": expectation(&request.robot.robot, &plan.random),
        // How many poses reach the wanted accuracy; `null` if none was wanted.
        "accuracy": needed.map(|needed| json!({
            "position_sigma_mm": needed.accuracy,
            "poses_rms": needed.rms,
            // For the worst place.
            "poses_everywhere": needed.everywhere,
        })),
    });
    json::report(SCHEMA_VERSION, contents)
}

/// One σ of the noise and of the tolerance, and whether the robot file states the noise.
pub(in crate::report) fn assumptions(drive: Drive, assumptions: &Assumptions) -> Value {
    let tolerance = |parameter| {
        let tolerance = assumptions.tolerance.as_ref();
        tolerance.map(|tolerance| tolerance.of(parameter))
    };
    json!({
        "noise_position_mm": assumptions.noise.position(),
        joint::key("noise_joint", drive): joint::in_file(drive, assumptions.noise.joint()),
        "noise_stated": assumptions.noise_stated,
        "tolerance_length_mm": tolerance(Parameter::Lb),
        "tolerance_angle_deg": tolerance(Parameter::Theta).map(degrees),
        "tolerance_radius_mm": common_radius(assumptions.tolerance.as_ref()),
    })
}

/// Of all towers; `null` if none is stated.
pub(in crate::report) fn common_radius(tolerance: Option<&Tolerance<f64>>) -> Option<f64> {
    let radius = tolerance?.radius();
    (radius > 0.0).then_some(radius)
}

/// Joint angles, and where the nominal robot is then.
pub(in crate::report) fn pose(drive: Drive, pose: &Sample<f64>) -> Value {
    json!({
        joint::key("joints", drive): pose.joints.map(|q| joint::in_file(drive, q)),
        "position_mm": pose.position.data.0[0],
    })
}

/// As standard deviations.
fn expectation(robot: &Robot<f64>, expectation: &Expectation) -> Value {
    let parameters = parameters(robot).map(|(arm, parameter)| {
        let sigma = expectation.parameters[arm.index()][parameter.index()];
        json!({
            "arm": arm.index() + 1,
            "symbol": parameter.symbol(),
            "unit": unit(parameter),
            "sigma": in_unit(parameter, sigma),
        })
    });
    let position = |sigma: &PositionSigma| json!({ "rms_mm": sigma.rms, "max_mm": sigma.max });
    json!({
        // √tr of the Cramér–Rao bound, angles times the upper arm's length.
        "parameter_error_mm": expectation.bound,
        // Of the position.
        "position_workspace": position(&expectation.workspace),
        // Of the position over the region; `null` without one.
        "position_region": expectation.region.as_ref().map(position),
        // Of every parameter of every arm.
        "parameters": parameters.collect::<Vec<_>>(),
    })
}
