//! From an objection to the words.

use crate::calibration::advice::{CHECK, joined};
use crate::calibration::case::Case;
use crate::calibration::causes::Cause;
use crate::calibration::reason::{Reason, Refused};
use crate::calibration::target::beside_the_platform_point;

use crate::calibration::investigation::Findings;
use crate::calibration::objection::Objection;
use crate::fit::options::Frame;
use crate::text::words::{count, in_lines};

/// What was to be calibrated, and what was found out about samples that did not fit.
pub(crate) struct Explainer<'a> {
    pub(crate) case: &'a Case<'a>,
    pub(crate) findings: &'a Findings,
}

impl Explainer<'_> {
    /// The reason for the user.
    pub(crate) fn explain(&self, objection: &Objection) -> Reason {
        match objection {
            Objection::Sample(index, error) => {
                Reason::Input(self.case.samples.fault(*index, error.to_string()))
            }
            Objection::Fit(refusal) => self.fit(refusal).into(),
            Objection::Robust(refusal) => self.robust(refusal).into(),
            Objection::HeldOut(refusal) => self.held_out(*refusal).into(),
            Objection::Alarm { alarm, before, run } => self.alarm(*alarm, *before, *run).into(),
            Objection::TooManyRejected { rejected, samples } => {
                self.too_many_rejected(*rejected, *samples).into()
            }
            Objection::Implausible(change) => self.implausible(change).into(),
            Objection::NotReproduced(error) => self.not_reproduced(error).into(),
            Objection::Worse(comparison, error) => self.worse(comparison, error).into(),
            Objection::UnknownError => self.unknown_error().into(),
            Objection::NoiseBeyondTolerance(test) => self.noise_beyond_tolerance(test).into(),
            Objection::BeyondTolerance(test) => self.beyond_tolerance(test).into(),
        }
    }

    /// A refusal of what the core computed, with what the findings say.
    pub(super) fn refused(&self, cause: &str, remedy: String) -> Refused {
        let median = self.case.error_before.median;
        let elsewhere = !self.case.options.no_guess && self.case.starts_elsewhere();
        let worst = self.findings.worst_samples.clone();
        let hints = if let Some(target) = self.beside_the_platform_point() {
            [Some(target), worst, None]
        } else if elsewhere {
            let frame = match self.case.options.frame {
                Frame::Base => format!(
                    "half of the measured points are more than {median:.0} mm from where the robot \
                     of the file would be; if they are in the sensor's own frame, use {}; \
                     otherwise {CHECK}",
                    self.find_frame()
                ),
                Frame::Sensor => format!(
                    "even in the best sensor frame half of the measured points are more than \
                     {median:.0} mm from where the robot of the file would be; {CHECK}"
                ),
            };
            [Some(frame), worst, None]
        } else {
            let far_before = || {
                let outlier = self.case.error_before.outlier()?;
                Some(format!("{outlier}: measure that one again or leave it out"))
            };
            [None, worst.or_else(far_before), Some(remedy)]
        };
        let [first, second, third] = hints;
        let robust = self.without_wrong_samples();
        Refused {
            cause: format!("{}: {cause}", self.case.samples.name),
            remedy: joined(&[self.case.samples.unit_hint(), first, second, robust, third]),
        }
    }

    /// That a robust fit calibrates the robot, where one was tried and does.
    pub(super) fn without_wrong_samples(&self) -> Option<String> {
        // What explains most of the residuals of all samples makes some of them fit worst.
        if !self.findings.causes.is_empty() {
            return None;
        }
        let disagreeing = self.findings.disagreeing.as_ref()?;
        if let Some(shift) = &disagreeing.shift {
            return Some(shift.to_string());
        }
        let lines = &disagreeing.lines;
        let samples = self.case.samples.count();
        let (does, them) = if lines.len() == 1 {
            ("does", "it")
        } else {
            ("do", "them")
        };
        Some(format!(
            "{} of {} agree with each other, and {} {does} not: {} calibrates the robot \
                 without {them}",
            samples - lines.len(),
            count(samples, "sample"),
            in_lines(lines),
            self.case.command("--loss tukey"),
        ))
    }

    /// What explains the residuals and is not in the model, as the end of a sentence.
    pub(super) fn unmodelled(&self) -> String {
        let causes = self.findings.causes.iter();
        let found: Vec<_> = causes.map(ToString::to_string).collect();
        if found.is_empty() {
            String::new()
        } else {
            format!(
                ". Most of the residuals have a cause that the model does not hold: {}",
                found.join("; ")
            )
        }
    }

    /// What to do about that, before anything else is tried.
    pub(super) fn mend_first(&self, otherwise: String) -> String {
        let causes = self.findings.causes.iter();
        let mut remedies: Vec<_> = causes.map(Cause::remedy).collect();
        remedies.dedup();
        if remedies.is_empty() {
            otherwise
        } else {
            format!("{}; otherwise {otherwise}", remedies.join("; "))
        }
    }

    /// That a reflector or a tip may be measured.
    pub(super) fn beside_the_platform_point(&self) -> Option<String> {
        let (case, measured) = (self.case, self.case.measured.iter());
        beside_the_platform_point(case.robot, case.options.frame, measured)
    }

    pub(super) fn find_frame(&self) -> String {
        self.case.command("--frame sensor")
    }

    pub(super) fn or_state_tolerance(&self) -> &'static str {
        if self.case.robot.tolerance.is_none() && !self.case.options.no_guess {
            ", or state the robot's manufacturing [tolerance] in the robot file"
        } else {
            ""
        }
    }
}
