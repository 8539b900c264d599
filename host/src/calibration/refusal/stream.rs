//! What samples in their order have to say against a calibration.

use super::explain::Explainer;
use crate::calibration::advice::{CHECK, SPREAD};
use crate::calibration::reason::Refused;
use crate::text::words::count;
use delta_cal::stream::{Alarm, HeldOutRefusal};

impl Explainer<'_> {
    pub(super) fn alarm(&self, alarm: Alarm, before: u64, run: u64) -> Refused {
        let first = usize::try_from(alarm.first()).unwrap_or(usize::MAX);
        let line = self.case.samples.line(first).unwrap_or_default();
        let before = usize::try_from(before).unwrap_or(usize::MAX);
        let disagree = format!("the {run} samples from line {line} on disagree with");
        let (cause, remedy) = match alarm {
            Alarm::RobotChanged { .. } => (
                format!(
                    "{disagree} the {} before them, which agree with each other: at this line the \
                     robot has changed, or the frame in which it is measured",
                    count(before, "sample")
                ),
                format!(
                    "calibrate the rows before line {line} and the rows from that line on \
                     separately; if the robot changes slowly, use --forget"
                ),
            ),
            _ => (
                format!(
                    "{disagree} the robot file and the {} before them, which are too few to tell \
                     which of them are right",
                    count(before, "sample")
                ),
                format!(
                    "{CHECK}; measure the rows before line {line} again, or delete them; or state \
                     a larger [tolerance] or [noise] if the stated one is too small"
                ),
            ),
        };
        Refused {
            cause: format!("{}: {cause}", self.case.samples.name),
            remedy,
        }
    }

    pub(super) fn too_many_rejected(&self, rejected: u64, samples: u64) -> Refused {
        self.refused(
            &format!(
                "the gate rejected {rejected} of {samples} samples: the samples that it took in are \
                 only those that happen to agree with each other"
            ),
            format!(
                "calibrate without --gate to see what the residuals say; {CHECK}; state a larger \
                 [noise] if the stated one is too small"
            ),
        )
    }

    pub(super) fn held_out(&self, refusal: HeldOutRefusal) -> Refused {
        let remedy = match refusal {
            HeldOutRefusal::Contradicted { .. } => {
                "find out what differs between the samples: --gate names the rows that disagree \
                 with those before them, and --loss tukey the rows that disagree with all others"
                    .to_owned()
            }
            HeldOutRefusal::Overfitted { .. } | HeldOutRefusal::NoNoise { .. } => {
                format!("measure more poses and {SPREAD}, or hold out fewer samples")
            }
            _ => "measure more poses, or hold out more of them".to_owned(),
        };
        Refused {
            cause: format!("{}: {refusal}", self.case.samples.name),
            remedy,
        }
    }
}
