//! Parameters before and after.

use crate::text::units::degrees;
use delta_cal::{Arm, ArmOutcome, Parameter, ParameterKind};

/// One parameter before and after, in the unit of the reports.
pub(super) struct Comparison {
    pub(super) parameter: Parameter,
    pub(super) symbol: &'static str,
    pub(super) unit: &'static str,
    pub(super) before: f64,
    pub(super) after: f64,
    pub(super) change: f64,
    pub(super) sigma: Option<f64>,
    pub(super) prior_share: f64,
}

/// The eight parameters of an arm.
pub(super) fn comparisons(before: &Arm<f64>, outcome: &ArmOutcome<f64>) -> [Comparison; 8] {
    Parameter::ALL.map(|parameter| {
        let (from, to) = (before.get(parameter), outcome.arm.get(parameter));
        let sigma = outcome.standard_deviation(parameter);
        let prior_share = outcome.prior_share[parameter.index()];
        let symbol = parameter.symbol();
        match parameter.kind() {
            ParameterKind::Length => Comparison {
                parameter,
                symbol,
                unit: "mm",
                before: from,
                after: to,
                change: to - from,
                sigma,
                prior_share,
            },
            ParameterKind::Angle => Comparison {
                parameter,
                symbol,
                unit: "deg",
                before: degrees(from),
                after: degrees(to),
                change: (to - from).to_degrees(),
                sigma: sigma.map(f64::to_degrees),
                prior_share,
            },
        }
    })
}
