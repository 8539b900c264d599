//! Parameters before and after.

use crate::calibration::report::CalibrationReport;
use crate::fit::outcome::Outcome;
use crate::text::units::{degrees, in_unit, unit};
use delta_cal::robot::ParameterKind;
use delta_cal::{Parameter, Robot};

/// One parameter before and after, in the unit of the reports.
pub(super) struct Comparison {
    /// 0, 1 or 2.
    pub(super) arm: usize,
    pub(super) parameter: Parameter,
    pub(super) unit: &'static str,
    pub(super) before: f64,
    pub(super) after: f64,
    pub(super) change: f64,
    pub(super) sigma: Option<f64>,
    pub(super) prior_share: f64,
}

impl Comparison {
    /// Those of a length or an angle are four, of a ratio near 1 six.
    pub(super) fn decimals(&self) -> usize {
        match self.parameter.kind() {
            ParameterKind::Length | ParameterKind::Angle => 4,
            ParameterKind::Ratio => 6,
        }
    }
}

/// How many of all parameters are of one arm.
pub(super) const fn of_an_arm(all: &[Comparison]) -> usize {
    if all.len() < 3 { 1 } else { all.len() / 3 }
}

/// All parameters, arm by arm.
pub(super) fn comparisons(report: &CalibrationReport) -> Vec<Comparison> {
    between(&report.before.robot, &report.outcome)
}

/// The same of a robot and what a calibration made of it.
pub(super) fn between(before: &Robot<f64>, outcome: &Outcome) -> Vec<Comparison> {
    let arms = before.arms().iter().zip(&outcome.fit.arms).enumerate();
    arms.flat_map(|(arm, (before, outcome))| {
        before.drive().parameters().iter().map(move |parameter| {
            let parameter = *parameter;
            let (from, to) = (before.get(parameter), outcome.arm.get(parameter));
            let in_file = |value| match parameter.kind() {
                ParameterKind::Length | ParameterKind::Ratio => value,
                ParameterKind::Angle => degrees(value),
            };
            let sigma = outcome.standard_deviation(parameter);
            Comparison {
                arm,
                parameter,
                unit: unit(parameter),
                before: in_file(from),
                after: in_file(to),
                change: in_unit(parameter, to - from),
                sigma: sigma.map(|sigma| in_unit(parameter, sigma)),
                prior_share: outcome.prior_share[parameter.index()],
            }
        })
    })
    .collect()
}
