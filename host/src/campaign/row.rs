//! One row of `robots.csv`: one robot, calibrated one way.

use super::plan::{Plan, Scenario, Variant};
use super::planned::MeasuredAt;
use super::simulation::{SimulatedRobot, seed, simulate};
use super::status::Status;
use super::trial::{achieved, bound, calibrate, error_before};
use crate::accuracy::information;
use crate::fit::options::CalibrationMethod;
use delta_cal::Parameter;
use serde::Serialize;
use std::time::Duration;

/// The columns that tell one case from another, in `robots.csv`, `summary.csv` and `timing.csv`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CaseColumns {
    /// Counted from 1.
    pub case: usize,
    /// `ikm`, `ikm-f32`, `ikm-no-guess`, `fkm` or `fkm-no-guess`.
    pub method: &'static str,
    /// `lm` or `gn`.
    pub solver: &'static str,
    /// Measured poses a robot.
    pub poses: usize,
    /// Of every length.
    pub start_error_mm: f64,
    /// Of every angle.
    pub start_error_deg: f64,
    /// One σ of each coordinate.
    pub noise_position_mm: f64,
    /// One σ of each joint angle.
    pub noise_joint_deg: f64,
    /// Whether the calibration knew the noise.
    pub weights: bool,
    /// Whether it knew the tolerance.
    pub prior: bool,
    /// Whether the poses were chosen.
    pub planned: bool,
    /// `xyz`, or the instrument that was measured with.
    pub measure: &'static str,
    /// Of the radius that all towers have in common.
    pub start_error_radius_mm: f64,
    /// One σ of each travel.
    pub noise_joint_mm: f64,
}

/// Every case of a campaign: the variants of the first scenario, then of the second.
pub(super) fn cases(plan: &Plan) -> Vec<CaseColumns> {
    let variants = plan.variants();
    let pairs = plan
        .scenarios()
        .iter()
        .flat_map(|scenario| variants.iter().map(move |variant| (scenario, variant)));
    pairs
        .enumerate()
        .map(|(index, (scenario, variant))| case(index + 1, scenario, *variant))
        .collect()
}

fn case(number: usize, scenario: &Scenario, variant: Variant) -> CaseColumns {
    CaseColumns {
        case: number,
        method: variant.method.name(),
        solver: variant.solver.name(),
        poses: scenario.poses,
        start_error_mm: scenario.start_error.length_mm,
        start_error_deg: scenario.start_error.angle_deg,
        noise_position_mm: scenario.noise_level.position_mm,
        noise_joint_deg: scenario.noise_level.joint_deg,
        weights: variant.weights,
        prior: variant.prior,
        planned: scenario.planned,
        measure: scenario.measure.name(),
        start_error_radius_mm: scenario.start_error.radius_mm,
        noise_joint_mm: scenario.noise_level.joint_mm,
    }
}

/// The columns of [`CaseColumns`].
pub(super) const CASE_COLUMNS: [&str; 14] = [
    "case",
    "method",
    "solver",
    "poses",
    "start_error_mm",
    "start_error_deg",
    "noise_position_mm",
    "noise_joint_deg",
    "weights",
    "prior",
    "planned",
    "measure",
    "start_error_radius_mm",
    "noise_joint_mm",
];

/// The columns of `robots.csv` after those of the case, without each parameter's gain.
const ROW_COLUMNS: [&str; 15] = [
    "robot",
    "seed",
    "status",
    "returned",
    "from_nominal",
    "iterations",
    "gain_percent",
    "error_before_mm",
    "error_after_mm",
    "parameter_error_mm",
    "bound_mm",
    "bound_ratio",
    "condition",
    "relative_before_mm",
    "relative_after_mm",
];

/// With noise, a robot is the true one if its parameter error is below this many times the bound.
const RETURNED: f64 = 5.0;

/// The columns of `robots.csv`.
pub(super) fn columns(plan: &Plan) -> Vec<String> {
    let fixed = CASE_COLUMNS.into_iter().chain(ROW_COLUMNS);
    let mut columns: Vec<_> = fixed.map(str::to_owned).collect();
    if plan.parameters {
        columns.extend(parameters(plan).map(|(arm, parameter)| gain_column(arm, parameter)));
    }
    columns
}

/// Every arm, counted from 1, and its parameters.
pub(super) fn parameters(plan: &Plan) -> impl Iterator<Item = (usize, Parameter)> {
    information::parameters(&plan.robot.robot).map(|(arm, parameter)| (arm.index() + 1, parameter))
}

/// `gain_1_Dx_percent`.
pub(super) fn gain_column(arm: usize, parameter: Parameter) -> String {
    format!("gain_{arm}_{}_percent", parameter.symbol())
}

/// What came of one robot. Empty where there is nothing to state.
#[derive(Debug, Serialize)]
struct Row {
    /// Counted from 0.
    robot: u64,
    seed: u64,
    status: Status,
    /// Whether the calibrated robot is the true one: to the arithmetic's accuracy without noise,
    /// within five times the bound with it.
    returned: Option<bool>,
    /// Whether no other start than the nominal robot was needed.
    from_nominal: Option<bool>,
    iterations: Option<u16>,
    gain_percent: Option<f64>,
    error_before_mm: Option<f64>,
    error_after_mm: Option<f64>,
    parameter_error_mm: Option<f64>,
    bound_mm: Option<f64>,
    bound_ratio: Option<f64>,
    condition: Option<f64>,
    relative_before_mm: Option<f64>,
    relative_after_mm: Option<f64>,
}

/// One robot's rows, one for each variant, and how long each calibration took.
#[derive(Debug)]
pub(super) struct RobotRows {
    pub(super) text: Vec<u8>,
    pub(super) times: Vec<Duration>,
}

/// Simulates a robot and calibrates it in every way. `first` is the case of the first variant.
pub(super) fn robot_rows(
    plan: &Plan,
    at: &MeasuredAt,
    (first, scenario): (usize, &Scenario),
    variants: &[Variant],
    robot: u64,
) -> Result<RobotRows, csv::Error> {
    let seed = seed(plan, scenario, robot);
    let simulated = simulate(plan, scenario, at, seed);
    let error_before = simulated.as_ref().map(|robot| error_before(plan, robot));
    let mut bounds = Bounds::default();
    let mut times = Vec::with_capacity(variants.len());
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(Vec::new());
    for (index, variant) in variants.iter().enumerate() {
        let mut row = Row {
            robot,
            seed,
            status: Status::NO_ROBOT,
            returned: None,
            from_nominal: None,
            iterations: None,
            gain_percent: None,
            error_before_mm: error_before
                .map(|error| error.rms)
                .filter(|error| error.is_finite()),
            error_after_mm: None,
            parameter_error_mm: None,
            bound_mm: None,
            bound_ratio: None,
            condition: None,
            relative_before_mm: error_before
                .map(|error| error.intrinsic_rms)
                .filter(|error| error.is_finite()),
            relative_after_mm: None,
        };
        let mut gains = vec![None; if plan.parameters { 24 } else { 0 }];
        let mut time = Duration::ZERO;
        if let Some(simulated) = &simulated {
            let trial = calibrate(plan, scenario, *variant, &simulated.read);
            time = trial.time;
            row.status = trial.status;
            row.bound_mm = bounds.of(plan, scenario, simulated, *variant);
            if let Some(calibrated) = &trial.calibrated {
                let achieved = achieved(plan, simulated, &calibrated.robot);
                let largest = match scenario.noise {
                    None => Some(variant.method.exact()),
                    Some(_) => row.bound_mm.map(|bound| RETURNED * bound),
                };
                row.returned = largest.map(|largest| achieved.parameter_error <= largest);
                for (cell, gain) in gains.iter_mut().zip(achieved.parameter_gains) {
                    *cell = Some(gain).filter(|gain| gain.is_finite());
                }
                row.from_nominal = Some(calibrated.from_nominal);
                row.iterations = Some(calibrated.iterations);
                row.condition = Some(calibrated.condition);
                row.gain_percent = Some(achieved.gain);
                row.error_after_mm =
                    Some(achieved.position_error.rms).filter(|error| error.is_finite());
                row.relative_after_mm =
                    Some(achieved.position_error.intrinsic_rms).filter(|error| error.is_finite());
                row.parameter_error_mm = Some(achieved.parameter_error);
                row.bound_ratio = row.bound_mm.map(|bound| achieved.parameter_error / bound);
            }
        }
        writer.serialize((case(first + index, scenario, *variant), row, gains))?;
        times.push(time);
    }
    let text = writer
        .into_inner()
        .map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(RobotRows { text, times })
}

/// Bounds of one robot, each computed once: they depend on neither solver nor weights.
#[derive(Default)]
struct Bounds(Vec<((CalibrationMethod, bool), Option<f64>)>);

impl Bounds {
    fn of(
        &mut self,
        plan: &Plan,
        scenario: &Scenario,
        robot: &SimulatedRobot,
        variant: Variant,
    ) -> Option<f64> {
        let key = (variant.method.calibration_method(), variant.prior);
        if let Some((_, known)) = self.0.iter().find(|(known, _)| *known == key) {
            return *known;
        }
        let bound = bound(plan, scenario, robot, variant);
        self.0.push((key, bound));
        bound
    }
}
