//! A fit that is judged not to be good.

use super::explain::Explainer;
use crate::accuracy::position_error::PositionError;
use crate::accuracy::workspace_comparison::WorkspaceComparison;
use crate::calibration::advice::{CHECK, SPREAD, joined};
use crate::calibration::prior_test::PriorTest;
use crate::calibration::reason::Refused;
use crate::calibration::thresholds::FEW_SAMPLES;
use crate::fit::options::Frame;
use crate::text::numbers::significant;
use crate::text::words::count;

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
                self.beside_the_platform_point(),
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

    /// The calibration may make the robot worse.
    pub(super) fn worse(&self, comparison: &WorkspaceComparison, after: &PositionError) -> Refused {
        let (change, sigma) = (comparison.judged.change, comparison.judged.sigma);
        let relative = self.case.options.frame.relative();
        let worst = after.max_at_line.map_or(String::new(), |line| {
            format!(
                "; after it the samples would still be off by {:.3} mm (rms), and the one in line \
                 {line} by {:.3} mm",
                after.rms, after.max
            )
        });
        let cause = format!(
            "the calibration may make the robot worse, with a probability of {} %: it would move the \
             positions{relative} by {change:.3} mm (rms over the workspace), and the new positions are \
             themselves uncertain by {sigma:.3} mm (one sigma){worst}",
            significant(100.0 * comparison.chance_of_harm.unwrap_or(1.0), 2)
        );
        let remedy = format!(
            "if the robot was calibrated before, it is as good as these samples can make it; \
             otherwise measure more poses and {SPREAD}{}",
            if self.case.robot.tolerance.is_some() {
                ", or state in [tolerance] how far off the robot can be now, if that is less than when it was made"
            } else {
                self.or_state_tolerance()
            }
        );
        self.refused(&cause, remedy)
    }

    /// Nothing says how uncertain the result is.
    pub(super) fn unknown_error(&self) -> Refused {
        let samples = count(self.case.samples.count(), "sample");
        let Self { case, .. } = self;
        if case.robot.tolerance.is_some() && case.robot.noise.is_none() {
            let cause = format!(
                "no [noise] is stated, and {samples} are too few to estimate it. So the error of the result is not known"
            );
            let remedy = format!(
                "state the [noise] of the measurements, or measure {FEW_SAMPLES} poses or more, 20 if possible"
            );
            return self.refused(&cause, remedy);
        }
        let (cause, noise) = if case.robot.noise.is_some() {
            (
                format!(
                    "no [tolerance] is stated, and {samples} fit several robots exactly. So the \
                     error of the result is not known"
                ),
                "",
            )
        } else {
            (
                format!(
                    "neither a [noise] nor a [tolerance] is stated, and {samples} are too few to \
                     estimate the noise. So the error of the result is not known"
                ),
                ", or state the [noise] of the measurements and measure 9 poses or more",
            )
        };
        let remedy = format!(
            "measure {FEW_SAMPLES} poses or more, 20 if possible{noise}{}",
            self.or_state_tolerance()
        );
        self.refused(&cause, remedy)
    }

    /// The parameters are further from nominal than the stated tolerance allows.
    pub(super) fn beyond_tolerance(&self, test: &PriorTest) -> Refused {
        let cause = format!(
            "{}, and the samples are too few to do without it",
            test.found()
        );
        let remedy = format!(
            "{CHECK}; if the robot really is that far off, {}, or measure more poses and {SPREAD}",
            test.statement(
                self.case.robot.robot.drive(),
                self.case.robot.tolerance.as_ref()
            )
        );
        self.refused(&cause, remedy)
    }
}
