//! What samples in their order have to say against a calibration.

use super::explain::Explainer;
use crate::calibration::advice::{CHECK, SPREAD};
use crate::calibration::reason::Refused;
use crate::text::words::count;
use delta_cal::stream::{Alarm, HeldOutRefusal};

impl Explainer<'_> {
    pub(super) fn alarm(&self, alarm: Alarm, before: u64, run: u64) -> Refused {
        let first = usize::try_from(alarm.first()).unwrap_or(usize::MAX);
        let line = self.case.samples.rows.get(first).map_or(0, |row| row.line);
        let before = usize::try_from(before).unwrap_or(usize::MAX);
        let disagree = format!("from line {line} on {run} samples in a row disagree with");
        let (cause, remedy) = match alarm {
            Alarm::RobotChanged { .. } => (
                format!(
                    "{disagree} the {} before that agree with each other: there the robot has \
                     changed, or the frame that it is measured in",
                    count(before, "sample")
                ),
                format!(
                    "calibrate the rows before line {line} and those from there on each by \
                     themselves; a robot that changes slowly is followed by --forget"
                ),
            ),
            _ => (
                format!(
                    "{disagree} the robot file and the {} before: too few to say which are right",
                    count(before, "sample")
                ),
                format!(
                    "{CHECK}; measure the rows before line {line} again, or begin with that line; or \
                     the stated [tolerance] or [noise] is too small"
                ),
            ),
        };
        Refused {
            cause: format!("{}: {cause}", self.case.samples.name),
            remedy,
        }
    }

    pub(super) fn held_out(&self, refusal: HeldOutRefusal) -> Refused {
        let remedy = match refusal {
            HeldOutRefusal::Contradicted { .. } => {
                "find out what differs between the samples: --gate names the rows that disagree \
                 with those before, --loss tukey those that disagree with all others"
                    .to_owned()
            }
            HeldOutRefusal::Overfitted { .. } | HeldOutRefusal::NoNoise { .. } => {
                format!("measure more poses and {SPREAD}, or hold fewer out")
            }
            _ => "measure more poses, or hold more of them out".to_owned(),
        };
        Refused {
            cause: format!("{}: {refusal}", self.case.samples.name),
            remedy,
        }
    }
}
