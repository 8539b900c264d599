//! A [`CalibrationReport`](crate::CalibrationReport) for people and for programs.

pub mod check;
pub mod html;
pub mod json;
mod next;
pub(crate) mod page;
pub mod plan;
pub mod stream;
mod suspected;
pub mod table;
mod uncertain;

use crate::units::degrees;
use delta_cal::Parameter;
use delta_cal::calibration::{ArmOutcome, Solver, StartUsed, Termination};
use delta_cal::robot::{Arm, ParameterKind};

/// One parameter before and after, in the unit of the reports.
struct Comparison {
    parameter: Parameter,
    symbol: &'static str,
    unit: &'static str,
    before: f64,
    after: f64,
    change: f64,
    sigma: Option<f64>,
    prior_share: f64,
}

/// The eight parameters of an arm.
fn comparisons(before: &Arm<f64>, outcome: &ArmOutcome<f64>) -> [Comparison; 8] {
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

fn solver_name(solver: Solver) -> &'static str {
    match solver {
        Solver::GaussNewton => "gauss-newton",
        Solver::LevenbergMarquardt => "levenberg-marquardt",
    }
}

fn start_name(start: StartUsed) -> &'static str {
    match start {
        StartUsed::Nominal => "robot file",
        StartUsed::Free => "without a guess",
        StartUsed::Search => "search",
        StartUsed::Ikm => "IKM solution",
    }
}

fn termination_name(termination: Termination) -> &'static str {
    match termination {
        Termination::GradientVanished => "converged",
        Termination::RoundingReached => "rounding limit",
    }
}
