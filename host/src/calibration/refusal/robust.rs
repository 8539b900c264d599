//! Why a robust fit is refused.

use super::explain::Explainer;
use crate::calibration::advice::{CHECK, SPREAD};
use crate::calibration::reason::Refused;
use crate::text::words::count;
use delta_cal::robust::RobustRefusal;

impl Explainer<'_> {
    /// The core's refusal of a robust fit.
    pub(super) fn robust(&self, refusal: &RobustRefusal) -> Refused {
        match *refusal {
            RobustRefusal::TooFewSamples { samples, needed } => Refused {
                cause: format!(
                    "{}: {} are too few for a robust fit: half of them must determine an arm's 8 \
                     parameters, so it needs {needed} samples",
                    self.case.samples.name,
                    count(samples, "sample")
                ),
                remedy: format!("measure more poses and {SPREAD}, or use --loss squared"),
            },
            RobustRefusal::TooManySuspected { suspected, samples } => self.refused(
                &format!(
                    "{suspected} of {samples} samples disagree with the others: with so many \
                         the program cannot tell which ones are wrong"
                ),
                format!(
                    "{CHECK}; check whether the sensor or the robot's base moved during \
                             the measurement"
                ),
            ),
            ref other => self.refused(&other.to_string(), CHECK.to_owned()),
        }
    }
}
