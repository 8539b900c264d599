//! A fit that is judged not to be good.

use super::explain::Explainer;
use crate::accuracy::position_error::PositionError;
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::calibration::advice::{CHECK, SPREAD, joined};
use crate::calibration::reason::Refused;
use crate::fit::options::Frame;

impl Explainer<'_> {
    /// Without a tolerance, a result that is no error of manufacture.
    pub(super) fn implausible(&self, cause: &str) -> Refused {
        let frame = match self.case.options.frame {
            Frame::Base => format!(
                "; if the samples are in another frame, use {}",
                self.find_frame()
            ),
            Frame::Sensor => String::new(),
        };
        Refused {
            cause: format!("{}: {cause}", self.case.samples.name),
            remedy: joined(&[
                self.case.samples.unit_hint(),
                self.findings.worst_samples.clone(),
                self.without_wrong_samples(),
                Some(format!(
                    "{CHECK}{frame}; if the robot file is only a rough guess, add --no-guess"
                )),
            ]),
        }
    }

    /// Each arm closes on its own, and together they come out elsewhere: on the other side of the
    /// elbows' plane, as happens if the samples' frame is tilted by more than a right angle.
    pub(super) fn not_reproduced(&self, after: &PositionError) -> Refused {
        let how = if after.median.is_finite() {
            format!(
                "half of them are more than {:.1} mm from where it would be",
                after.median
            )
        } else {
            "it cannot reach any of them".to_owned()
        };
        let cause = format!("the calibrated robot does not reach the measured points: {how}");
        self.refused(&cause, CHECK.to_owned())
    }

    /// The calibration would make the robot worse.
    pub(super) fn worse(&self, comparison: &WorkspaceComparison, after: &PositionError) -> Refused {
        let (change, sigma) = (comparison.change, comparison.sigma);
        let so = if change <= sigma {
            "so these samples cannot improve it".to_owned()
        } else {
            format!(
                "so the error expected before is {:.3} mm and after {:.3} mm",
                comparison.expected_error_before(),
                comparison.expected_error_after()
            )
        };
        let worst = after.max_at_line.map_or(String::new(), |line| {
            format!(
                "; after it the samples would still be off by {:.3} mm (rms), and the one in line \
                 {line} by {:.3} mm",
                after.rms, after.max
            )
        });
        let cause = format!(
            "the calibration is expected to make the robot worse: it would move the positions by \
             {change:.3} mm (rms over the workspace), and the new positions are themselves \
             uncertain by {sigma:.3} mm, {so}{worst}"
        );
        let remedy = format!(
            "if the robot was calibrated before, it is as good as these samples can make it; \
             otherwise measure more poses and {SPREAD}{}",
            self.or_state_tolerance()
        );
        self.refused(&cause, remedy)
    }
}
