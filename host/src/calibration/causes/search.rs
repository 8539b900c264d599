//! What the residuals of a fit show that the model does not hold.

use super::cause::Cause;
use super::selection::select;
use super::subject::{ArmResiduals, Subject};
use delta_cal::Sample;

/// A cause that moves the positions by less, mm rms, is one of the arithmetic.
const NEGLIGIBLE: f64 = 1e-6;

/// What was looked for in the residuals, and what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Causes {
    /// The causes found, the one that explains most first.
    pub found: Vec<Cause>,
    /// Why nothing was looked for, if that is so.
    pub not_tested: Option<&'static str>,
    /// The part of the residuals' sum of squares that the causes explain together, 0 to 1.
    pub explained: f64,
    /// By how much the causes put the calibrated robot's positions off, rms over the workspace, mm: by
    /// themselves and by what the parameters have taken up of them. 0 if none was found.
    pub position_error: f64,
    /// What is left of each arm's closure error, over its joint angle.
    pub arms: [ArmResiduals; 3],
}

/// Tests every hypothesis; `poses` are all over the workspace.
pub(crate) fn causes(subject: &Subject<'_>, poses: &[Sample<f64>]) -> Causes {
    let counted = subject.counted();
    let mut causes = Causes {
        found: Vec::new(),
        not_tested: None,
        explained: 0.0,
        position_error: 0.0,
        arms: subject.arms(&counted, &[], None),
    };
    let solution = subject.solution;
    let least = solution
        .noise
        .iter()
        .map(|own| own.sigma)
        .fold(f64::INFINITY, f64::min);
    let stated = solution.estimated_freedom().is_none();
    let ranges = subject.ranges();
    let joints = (solution.robot.drive(), &ranges);
    match select(
        &subject.regression(&counted),
        joints,
        stated,
        NEGLIGIBLE / least,
    ) {
        Err(why) => causes.not_tested = Some(why),
        Ok(None) => {}
        Ok(Some(selection)) => {
            causes.explained = selection.explained;
            causes.position_error =
                subject.discrepancy(&selection.found, &selection.coefficients, poses);
            causes.arms = subject.arms(&counted, &selection.found, Some(&selection.coefficients));
            causes.found = selection.found;
        }
    }
    causes
}
