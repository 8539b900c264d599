//! What the residuals of a fit show that the model does not hold.

use super::cause::Cause;
use super::discrepancy::Discrepancy;
use super::residuals::{self, ArmResiduals};
use super::selection::select;
use super::subject::Subject;
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
    /// By what the σ of the positions, of a fit that takes a noise that is not stated as even, is too small, because
    /// the residuals show that the joints' part of it is not; 1 if they do not.
    pub uneven_noise: f64,
    /// What is left of each arm's closure error, over its joint angle.
    pub arms: [ArmResiduals; 3],
}

impl Causes {
    /// Nothing was looked for.
    pub(crate) fn not_tested(why: &'static str) -> Self {
        Self {
            found: Vec::new(),
            not_tested: Some(why),
            explained: 0.0,
            position_error: 0.0,
            uneven_noise: 1.0,
            arms: Default::default(),
        }
    }
}

/// Tests every hypothesis; `poses` are all over the workspace.
pub(crate) fn causes(subject: &Subject<'_>, poses: &[Sample<f64>]) -> Causes {
    let counted = subject.counted();
    let mut causes = Causes {
        found: Vec::new(),
        not_tested: None,
        explained: 0.0,
        position_error: 0.0,
        uneven_noise: 1.0,
        arms: residuals::arms(subject.calibrated, &counted, &[], None),
    };
    let Some((regression, scale, noise)) = subject.regression(&counted) else {
        causes.not_tested = Some("too few samples are left over to tell causes from noise");
        return causes;
    };
    if subject.noise.is_none()
        && !subject.arms_apart
        && let Some(widening) = subject.widening_by_uneven_noise(&counted, scale, &noise, poses)
    {
        causes.uneven_noise = widening;
    }
    let ranges = subject.ranges();
    let joints = (subject.calibrated.drive(), &ranges);
    match select(
        &regression,
        joints,
        subject.noise.is_some(),
        NEGLIGIBLE / scale,
    ) {
        Err(why) => causes.not_tested = Some(why),
        Ok(None) => {}
        Ok(Some(selection)) => {
            let corrections = subject.corrections(&selection.coefficients);
            causes.explained = selection.explained;
            let discrepancy = Discrepancy {
                robot: subject.calibrated,
                found: &selection.found,
                corrections: &corrections,
                radius_squared: subject.radius_squared(),
            };
            causes.position_error = discrepancy.rms(poses);
            causes.arms = residuals::arms(
                subject.calibrated,
                &counted,
                &selection.found,
                Some(&corrections),
            );
            causes.found = selection.found;
        }
    }
    causes
}
