//! Why the measurements cannot calibrate this robot, in plain words, and what to do next.

mod noise;
mod robust;
mod stream;

use crate::outliers::Fit;
use crate::words::{count, in_file_units};
use crate::{
    Diagnosis, Frame, Options, PositionError, RobotFile, SamplesFile, WorkspaceComparison,
};
use delta_cal::{Method, Parameter, Refusal, Robot, Sample};
use std::error::Error;
use std::fmt;

/// Measured positions further than this part of the forearm from where the robot should be are in
/// another frame, another unit or of other joints.
const ELSEWHERE: f64 = 0.05;

const CHECK: &str = "check the units, the order of the joints and their sign (a positive angle \
                     swings the arm towards the platform)";
const SPREAD: &str = "spread the poses over the whole workspace, each joint over its whole range";

/// A calibration that is refused: the robot keeps its parameters. Displayed as one line.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    cause: String,
    remedy: String,
    diagnosis: Option<Box<Diagnosis>>,
}

impl fmt::Display for Refused {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.cause)
    }
}

impl Error for Refused {}

/// A sample this many times as far off as the median sample is an outlier. The distances scatter with
/// the noise and with the pose, by less than this.
pub(crate) const OUTLIER: f64 = 6.0;

/// What was to be calibrated, from what.
pub(crate) struct Circumstances<'a> {
    pub(crate) robot: &'a RobotFile,
    pub(crate) samples: &'a SamplesFile,
    /// The samples in the robot's frame.
    pub(crate) measured: &'a [Sample<f64>],
    pub(crate) options: Options,
    pub(crate) error_before: PositionError,
    /// The option that finds the sensor's frame.
    pub(crate) find_frame: &'static str,
    /// The option that leaves out wrong samples.
    pub(crate) robust_fit: &'static str,
}

impl Refused {
    /// What to do next.
    pub fn remedy(&self) -> &str {
        &self.remedy
    }

    /// What would explain the samples as a whole, if anything does.
    pub fn diagnosis(&self) -> Option<&Diagnosis> {
        self.diagnosis.as_deref()
    }

    pub(crate) fn with_diagnosis(self, diagnosis: Option<Diagnosis>) -> Self {
        let remedy = match &diagnosis {
            // It says better what the general advice guesses at.
            Some(diagnosis) => diagnosis.remedy(),
            None => self.remedy,
        };
        Self {
            remedy,
            diagnosis: diagnosis.map(Box::new),
            ..self
        }
    }

    /// The points do not fix the sensor's frame.
    pub(crate) fn sensor_frame(samples: &SamplesFile, cause: &str) -> Self {
        Self {
            cause: format!("{}: {cause}", samples.name),
            remedy: joined(&[
                samples.unit_hint(),
                Some(format!("measure more poses and {SPREAD}")),
            ]),
            diagnosis: None,
        }
    }
}

/// The first hint that applies, and the others after it.
fn joined(hints: &[Option<String>]) -> String {
    let hints: Vec<_> = hints.iter().flatten().map(String::as_str).collect();
    hints.join("; otherwise ")
}

/// Whether the measured points lie where another frame, unit or order of joints would put them.
pub(crate) fn lies_elsewhere(robot: &Robot<f64>, error: &PositionError) -> bool {
    let [arm, ..] = robot.arms();
    !(error.median <= ELSEWHERE * arm.lb())
}

/// Whether a sample this far off is an outlier among the others.
pub(crate) fn is_outlier(error: &PositionError, distance: f64) -> bool {
    distance > OUTLIER * error.median
}

/// The sample that is much further off than the others, if there is one.
pub(crate) fn outlier(error: &PositionError) -> Option<String> {
    let line = error.max_at_line?;
    is_outlier(error, error.max).then(|| {
        format!(
            "the sample in line {line} is {:.3} mm from where the robot would be, while half of \
             the samples are off by less than {:.3} mm",
            error.max, error.median
        )
    })
}

impl Circumstances<'_> {
    /// The core's refusal with its figures and a remedy.
    pub(crate) fn explain(&self, refusal: &Refusal) -> Refused {
        let (cause, remedy) = match *refusal {
            Refusal::TooFewSamples {
                samples, needed, ..
            } => return self.too_few(samples, needed),
            Refusal::Undetermined {
                arm,
                parameter,
                condition,
            } => (
                format!(
                    "the {} do not determine the parameters of {arm}, {parameter} least of all \
                     (condition {condition:.1e})",
                    count(self.samples.rows.len(), "pose")
                ),
                format!(
                    "measure more poses and {SPREAD}{}",
                    self.or_state_tolerance()
                ),
            ),
            Refusal::Uncertain {
                arm,
                parameter,
                sigma,
            } => (
                format!(
                    "the samples are too noisy or too few to determine {parameter} of {arm}: its \
                     sigma is {}",
                    in_file_units(parameter, f64::from(sigma))
                ),
                format!(
                    "measure more poses, or more exactly, and {SPREAD}{}",
                    self.or_state_tolerance()
                ),
            ),
            Refusal::WrongSide => (
                "each arm by itself fits the samples, but together they put the platform above the \
                 elbows: the samples' frame is upside down or left-handed"
                    .to_owned(),
                format!("state the samples in the robot's frame, or use {}", self.find_frame),
            ),
            Refusal::NotConverged { arm, iterations } => (
                format!(
                    "the fit of {arm} did not settle in {}",
                    count(usize::from(iterations), "iteration")
                ),
                match self.options.solver {
                    Method::GaussNewton => {
                        "try again with --solver lm, which cannot diverge".into()
                    }
                    Method::LevenbergMarquardt => {
                        format!("{SPREAD}; {CHECK}")
                    }
                },
            ),
            Refusal::ResidualContradictsNoise { arm, ratio } => (
                format!(
                    "the residuals of {arm} are {ratio:.1} times what the stated [noise] allows{}",
                    self.residuals_say(f64::from(ratio))
                ),
                "look for an outlier, or for a sensor that moved; state the [noise] that repeated \
                 measurements of one pose show"
                    .to_owned(),
            ),
            Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances,
            } => (
                format!(
                    "the fit puts {parameter} of {arm} {tolerances:.1} tolerances ({}) away from \
                     nominal, which the stated [tolerance] makes incredible",
                    self.distance(parameter, tolerances)
                ),
                format!(
                    "{CHECK}{}; if the robot really is that far off, state a larger [tolerance]",
                    match self.options.frame {
                        Frame::Base => format!(
                            "; if the samples' frame is not exactly the robot's, use {}",
                            self.find_frame
                        ),
                        Frame::Sensor => String::new(),
                    }
                ),
            ),
            Refusal::ImpossibleGeometry { arm, error } => (
                format!("the best fit of {arm} is not the geometry of an arm: {error}"),
                CHECK.to_owned(),
            ),
            Refusal::ImpossibleRobot(error) => (
                format!("the three fitted arms do not make a robot: {error}"),
                CHECK.to_owned(),
            ),
            Refusal::NonFinite { arm } => (
                format!("the samples of {arm} are too large to compute with"),
                "check the units in the header (_mm or _m, _deg or _rad)".to_owned(),
            ),
            ref other => (other.to_string(), CHECK.to_owned()),
        };
        self.refused(&cause, remedy)
    }

    fn too_few(&self, samples: u64, needed: u64) -> Refused {
        let line = self.samples.rows.last().map_or(1, |row| row.line);
        let found = count(usize::try_from(samples).unwrap_or(usize::MAX), "sample");
        let (why, remedy) = if self.options.no_guess {
            (
                "without a start value each arm needs",
                "or leave out --no-guess, so that the fit starts from the robot file",
            )
        } else {
            (
                "each arm has 8 unknown parameters and needs",
                "or state the robot's manufacturing [tolerance] in the robot file",
            )
        };
        Refused {
            cause: format!(
                "{}:{line}: the file ends after {found}: {why} {needed} samples",
                self.samples.name
            ),
            remedy: format!("measure more poses (20 or more are advisable), {remedy}"),
            diagnosis: None,
        }
    }

    /// Without a tolerance, a result that is no error of manufacture.
    pub(crate) fn explain_implausible(&self, cause: &str) -> Refused {
        let frame = match self.options.frame {
            Frame::Base => format!(
                "; if the samples are in another frame, use {}",
                self.find_frame
            ),
            Frame::Sensor => String::new(),
        };
        Refused {
            cause: format!("{}: {cause}", self.samples.name),
            remedy: joined(&[
                self.samples.unit_hint(),
                self.worst_samples(),
                self.without_wrong_samples(),
                Some(format!(
                    "{CHECK}{frame}; if the robot file is only a rough guess, add --no-guess"
                )),
            ]),
            diagnosis: None,
        }
    }

    /// Each arm closes on its own, and together they come out elsewhere: on the other side of the
    /// elbows' plane, as happens if the samples' frame is tilted by more than a right angle.
    pub(crate) fn explain_not_reproduced(&self, after: &PositionError) -> Refused {
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
    pub(crate) fn explain_worse(
        &self,
        comparison: &WorkspaceComparison,
        after: &PositionError,
    ) -> Refused {
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

    fn refused(&self, cause: &str, remedy: String) -> Refused {
        let median = self.error_before.median;
        let elsewhere =
            !self.options.no_guess && lies_elsewhere(&self.robot.robot, &self.error_before);
        let worst = self.worst_samples();
        let hints = if elsewhere {
            let frame = match self.options.frame {
                Frame::Base => format!(
                    "half of the measured points are more than {median:.0} mm from where the robot \
                     of the file would be; if they are in the sensor's own frame, use {}; \
                     otherwise {CHECK}",
                    self.find_frame
                ),
                Frame::Sensor => format!(
                    "even in the best sensor frame half of the measured points are more than \
                     {median:.0} mm from where the robot of the file would be; {CHECK}"
                ),
            };
            [Some(frame), worst, None]
        } else {
            let far_before = || {
                let outlier = outlier(&self.error_before)?;
                Some(format!("{outlier}: measure that one again or leave it out"))
            };
            [None, worst.or_else(far_before), Some(remedy)]
        };
        let [first, second, third] = hints;
        let robust = self.without_wrong_samples();
        Refused {
            cause: format!("{}: {cause}", self.samples.name),
            remedy: joined(&[self.samples.unit_hint(), first, second, robust, third]),
            diagnosis: None,
        }
    }

    fn worst_samples(&self) -> Option<String> {
        let fit = Fit {
            nominal: &self.robot.robot,
            measured: self.measured,
            rows: &self.samples.rows,
            options: self.options,
        };
        fit.worst_samples()
    }

    fn or_state_tolerance(&self) -> &'static str {
        if self.robot.tolerance.is_none() && !self.options.no_guess {
            ", or state the robot's manufacturing [tolerance] in the robot file"
        } else {
            ""
        }
    }

    /// Tolerances in the parameter's unit.
    fn distance(&self, parameter: Parameter, tolerances: f32) -> String {
        let Some(tolerance) = &self.robot.tolerance else {
            return "no tolerance is stated".to_owned();
        };
        in_file_units(parameter, tolerance.of(parameter) * f64::from(tolerances))
    }
}
