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
                     parameters, so it needs {needed}",
                    self.case.samples.name,
                    count(samples, "sample")
                ),
                remedy: format!("measure more poses and {SPREAD}, or use --loss squared"),
            },
            RobustRefusal::TooManySuspected { suspected, samples } => self.refused(
                &format!(
                    "{suspected} of {samples} samples disagree with the others: with so many it \
                         is not known which are the wrong ones"
                ),
                format!("{CHECK}; did the sensor or the robot's base move meanwhile?"),
            ),
            ref other => self.refused(&other.to_string(), CHECK.to_owned()),
        }
    }
}
