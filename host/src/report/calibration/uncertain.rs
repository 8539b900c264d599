//! Parameters that are known badly although the poses tell them apart well: the noise is large, or
//! the samples are few.

use crate::accuracy::information;
use crate::calibration::report::CalibrationReport;
use crate::text::words::{in_file_units, list};
use delta_cal::calibration::ArmOutcome;
use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Parameter};

/// A σ of more than this part of a tolerance is large. The samples then decided less than three
/// quarters of the parameter.
const LARGE: f64 = 0.5;
/// How many parameters are named.
const NAMED: usize = 4;

struct Uncertain {
    arm: ArmIndex,
    parameter: Parameter,
    sigma: f64,
    /// σ over what makes it large.
    ratio: f64,
}

/// The parameters of these arms with a large σ: against the tolerance or, where none is stated,
/// against the median change of all 24 parameters, angles times the upper arm. `None` if there are
/// none, or if the samples leave the robot where it was, so that every change is small.
pub(super) fn uncertain<'a>(
    report: &CalibrationReport,
    arms: impl Iterator<Item = (ArmIndex, &'a ArmOutcome<f64>)>,
) -> Option<String> {
    let tolerance = report.before.tolerance.as_ref();
    if tolerance.is_none() && report.workspace.is_none_or(|w| w.unchanged()) {
        return None;
    }
    let median = median_change(report);
    let limit = |arm: &Arm<f64>, parameter| match tolerance {
        Some(tolerance) => LARGE * tolerance.of_arm(arm, parameter),
        None => median / information::unit(arm, parameter),
    };
    let mut found: Vec<_> = arms
        .flat_map(|(arm, outcome)| {
            outcome
                .arm
                .drive()
                .parameters()
                .iter()
                .filter_map(move |parameter| {
                    let parameter = *parameter;
                    let sigma = outcome.standard_deviation(parameter)?;
                    let ratio = sigma / limit(&outcome.arm, parameter);
                    (ratio > 1.0).then_some(Uncertain {
                        arm,
                        parameter,
                        sigma,
                        ratio,
                    })
                })
        })
        .collect();
    if found.is_empty() {
        return None;
    }
    found.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    let named: Vec<_> = found.iter().take(NAMED).map(Uncertain::in_words).collect();
    let others = match found.len().saturating_sub(NAMED) {
        0 => String::new(),
        others => format!(", and {others} more"),
    };
    let against = if tolerance.is_some() {
        "half its tolerance"
    } else {
        "the change of the median parameter"
    };
    Some(format!(
        "The σ of these parameters is larger than {against}, the largest first: {}{others}. Four \
         times as many samples, spread like these, would halve every σ.",
        list(&named)
    ))
}

impl Uncertain {
    fn in_words(&self) -> String {
        let size = in_file_units(self.parameter, self.sigma);
        format!("{} of {} (σ {size})", self.parameter, self.arm)
    }
}

/// The median size of all changes, mm.
fn median_change(report: &CalibrationReport) -> f64 {
    let arms = report.before.robot.arms().iter();
    let mut changes: Vec<_> = arms
        .zip(report.after.robot.arms())
        .flat_map(|(before, after)| {
            after.drive().parameters().iter().map(|parameter| {
                (after.get(*parameter) - before.get(*parameter)).abs()
                    * information::unit(after, *parameter)
            })
        })
        .collect();
    changes.sort_by(f64::total_cmp);
    changes[changes.len() / 2]
}
