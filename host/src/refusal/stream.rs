//! What samples in their order have to say against a calibration.

use super::{CHECK, Circumstances, Refused, SPREAD};
use crate::CalibrateError;
use crate::stream::StreamRefusal;
use crate::words::count;
use delta_cal::{Alarm, HeldOutRefusal};

impl Circumstances<'_> {
    /// The refusal of a calibration that depends on the samples' order.
    pub(crate) fn explain_stream(&self, refusal: &StreamRefusal) -> CalibrateError {
        match *refusal {
            StreamRefusal::Fit(ref refusal) => self.explain(refusal).into(),
            StreamRefusal::Sample(index, error) => {
                CalibrateError::Input(self.samples.fault(index, error.to_string()))
            }
            StreamRefusal::Alarm { alarm, before, run } => self.alarm(alarm, before, run).into(),
            StreamRefusal::HeldOut(refusal) => self.held_out(refusal).into(),
        }
    }

    fn alarm(&self, alarm: Alarm, before: u64, run: u64) -> Refused {
        let first = usize::try_from(alarm.first()).unwrap_or(usize::MAX);
        let line = self.samples.rows.get(first).map_or(0, |row| row.line);
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
            cause: format!("{}: {cause}", self.samples.name),
            remedy,
            diagnosis: None,
        }
    }

    fn held_out(&self, refusal: HeldOutRefusal) -> Refused {
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
            cause: format!("{}: {refusal}", self.samples.name),
            remedy,
            diagnosis: None,
        }
    }
}
