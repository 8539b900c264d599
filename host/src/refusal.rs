//! Why the measurements cannot calibrate this robot, in plain words, and what to do next.

use crate::{Frame, Options, PositionError, RobotFile, SamplesFile, WorkspaceComparison};
use delta_cal::{AlignmentError, Method, Parameter, ParameterKind, Refusal};
use std::error::Error;
use std::fmt;

/// Measured positions further than this part of the forearm from where the robot should be are in
/// another frame, another unit or of other joints.
const ELSEWHERE: f64 = 0.05;

const CHECK: &str = "check the units, the order of the joints and their sign (positive swings the arm \
                     towards the platform)";
const SPREAD: &str = "spread the poses over the whole workspace, each joint over its whole range";

/// A calibration that is refused: the robot keeps its parameters. Displayed as one line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    cause: String,
    remedy: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.cause)
    }
}

impl Error for Refused {}

/// A sample this many times as far off as the median sample is an outlier. The distances scatter with
/// the noise and with the pose, by less than this.
const OUTLIER: f64 = 6.0;

/// What was to be calibrated, from what.
pub(crate) struct Circumstances<'a> {
    pub(crate) robot: &'a RobotFile,
    pub(crate) samples: &'a SamplesFile,
    pub(crate) options: Options,
    pub(crate) error_before: PositionError,
}

impl Refused {
    /// What to do next.
    pub fn remedy(&self) -> &str {
        &self.remedy
    }

    pub(crate) fn alignment(samples: &str, error: AlignmentError, pairs: usize) -> Self {
        let cause = match error {
            AlignmentError::TooFewPoints => format!(
                "the sensor's frame needs at least 3 samples whose joint angles the robot of the \
                 file can reach, and there are {pairs}"
            ),
            error => format!("the sensor's frame cannot be found: {error}"),
        };
        Self {
            cause: format!("{samples}: {cause}"),
            remedy: format!("measure more poses; {SPREAD}"),
        }
    }
}

/// Whether the measured points lie where another frame, unit or order of joints would put them.
pub(crate) fn lies_elsewhere(robot: &RobotFile, error: &PositionError) -> bool {
    let [arm, ..] = robot.robot.arms();
    !(error.median <= ELSEWHERE * arm.lb())
}

/// The sample that is much further off than the others, if there is one.
pub(crate) fn outlier(error: &PositionError) -> Option<String> {
    let line = error.max_at_line?;
    (error.max > OUTLIER * error.median).then(|| {
        format!(
            "the sample in line {line} is {:.3} mm from where the robot would be, half of the \
             samples less than {:.3} mm",
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
                    "the {} poses do not determine the parameters of {arm}, {parameter} least \
                     of all (condition {condition:.1e})",
                    self.samples.rows.len()
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
                "each arm fits the samples, and together they put the platform on the other side of \
                 the elbows: the samples' frame is upside down or left-handed against the robot's"
                    .to_owned(),
                "state the samples in the robot's frame, or calibrate with --frame sensor".to_owned(),
            ),
            Refusal::NotConverged { arm, iterations } => (
                format!("the fit of {arm} did not settle in {iterations} iterations"),
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
                    "the residuals of {arm} are {ratio:.1} times what the stated [noise] allows"
                ),
                "look for outliers or a sensor that moved; if the measurements are in order, state \
                 a larger [noise], or delete it"
                    .to_owned(),
            ),
            Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances,
            } => (
                format!(
                    "{parameter} of {arm} came out {tolerances:.1} tolerances ({}) from nominal, \
                     more than the stated [tolerance] makes credible",
                    self.distance(parameter, tolerances)
                ),
                format!(
                    "{CHECK}; if the robot really is that far off, state a larger [tolerance]"
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
        Refused {
            cause: format!(
                "{}:{line}: the file ends after {samples} samples: each arm has 8 unknown \
                 parameters and needs {needed}",
                self.samples.name
            ),
            remedy: "measure more poses (20 or more are advisable), or state the robot's \
                     manufacturing [tolerance] in the robot file"
                .to_owned(),
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
        let cause = format!("the calibrated robot does not come to the measured points: {how}");
        self.refused(&cause, CHECK.to_owned())
    }

    /// The calibration would make the robot worse.
    pub(crate) fn explain_worse(&self, comparison: &WorkspaceComparison) -> Refused {
        let cause = format!(
            "the calibration is expected to make the robot worse: it would move the positions by \
             {:.3} mm (rms over the workspace) and is itself uncertain by {:.3} mm, so the error \
             expected before is {:.3} mm and after {:.3} mm",
            comparison.change,
            comparison.sigma,
            comparison.expected_error_before(),
            comparison.expected_error_after(),
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
        let remedy = if lies_elsewhere(self.robot, &self.error_before) {
            match self.options.frame {
                Frame::Base => format!(
                    "half of the measured points are more than {median:.0} mm from where the robot \
                     of the file would be; if they are in the sensor's own frame, use --frame \
                     sensor; else {CHECK}"
                ),
                Frame::Sensor => format!(
                    "even in the best sensor frame half of the measured points are more than \
                     {median:.0} mm from where the robot of the file would be; {CHECK}"
                ),
            }
        } else if let Some(outlier) = outlier(&self.error_before) {
            format!("{outlier}: measure that one again or leave it out; else {remedy}")
        } else {
            remedy
        };
        Refused {
            cause: format!("{}: {cause}", self.samples.name),
            remedy,
        }
    }

    fn or_state_tolerance(&self) -> &'static str {
        if self.robot.tolerance.is_none() {
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

/// Millimetres or degrees.
fn in_file_units(parameter: Parameter, value: f64) -> String {
    match parameter.kind() {
        ParameterKind::Length => format!("{value:.3} mm"),
        ParameterKind::Angle => format!("{:.3}°", value.to_degrees()),
    }
}
