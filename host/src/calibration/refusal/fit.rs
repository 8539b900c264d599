//! What the core refuses, with its figures and a remedy.

use super::explain::Explainer;
use crate::calibration::advice::{CHECK, SPREAD};
use crate::calibration::reason::Refused;
use crate::fit::options::Frame;
use crate::text::words::{count, in_file_units};
use delta_cal::calibration::Solver;
use delta_cal::{ArmIndex, Parameter, Refusal};

type CauseAndRemedy = (String, String);

impl Explainer<'_> {
    pub(super) fn fit(&self, refusal: &Refusal) -> Refused {
        let (cause, remedy) = match *refusal {
            Refusal::TooFewSamples {
                samples, needed, ..
            } => return self.too_few(samples, needed),
            Refusal::Undetermined { .. } | Refusal::Uncertain { .. } => self.undetermined(refusal),
            Refusal::ResidualContradictsNoise { .. } | Refusal::FarFromNominal { .. } => {
                self.contradicts_robot_file(refusal)
            }
            Refusal::NotConverged { arm, iterations } => (
                format!(
                    "the fit of {arm} did not settle in {}",
                    count(usize::from(iterations), "iteration")
                ),
                match self.case.options.solver {
                    Solver::GaussNewton => {
                        "try again with --solver lm, which cannot diverge".into()
                    }
                    Solver::LevenbergMarquardt => {
                        format!("{SPREAD}; {CHECK}")
                    }
                },
            ),
            _ => self.impossible(refusal),
        };
        self.refused(&cause, remedy)
    }

    fn undetermined(&self, refusal: &Refusal) -> CauseAndRemedy {
        match *refusal {
            Refusal::Undetermined {
                arm,
                parameter,
                condition,
            } => (
                format!(
                    "the {} do not determine the parameters of {arm}, {parameter} least of all \
                     (condition {condition:.1e})",
                    count(self.case.samples.count(), "pose")
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
            other => (other.to_string(), CHECK.to_owned()),
        }
    }

    fn contradicts_robot_file(&self, refusal: &Refusal) -> CauseAndRemedy {
        match *refusal {
            Refusal::ResidualContradictsNoise { arm, ratio } => (
                format!(
                    "the residuals{} are {ratio:.1} times what the stated [noise] allows{}{}",
                    arm.map_or_else(String::new, |arm| format!(" of {arm}")),
                    self.residuals_say(f64::from(ratio)),
                    self.unmodelled()
                ),
                self.mend_first(
                    "look for an outlier, or for a sensor that moved; state the [noise] that \
                     repeated measurements of one pose show"
                        .to_owned(),
                ),
            ),
            Refusal::FarFromNominal {
                arm,
                parameter,
                tolerances,
            } => (
                format!(
                    "the fit puts {parameter} of {arm} {tolerances:.1} tolerances ({}) away from \
                     nominal, which the stated [tolerance] makes incredible",
                    self.distance(arm, parameter, tolerances)
                ),
                format!(
                    "{CHECK}{}; if the robot really is that far off, state a larger [tolerance]",
                    match self.case.options.frame {
                        Frame::Base => format!(
                            "; if the samples' frame is not exactly the robot's, use {}",
                            self.find_frame()
                        ),
                        Frame::Sensor => String::new(),
                    }
                ),
            ),
            other => (other.to_string(), CHECK.to_owned()),
        }
    }

    fn impossible(&self, refusal: &Refusal) -> CauseAndRemedy {
        match *refusal {
            Refusal::WrongSide => (
                "each arm by itself fits the samples, but together they put the platform above the \
                 elbows: the samples' frame is upside down or left-handed"
                    .to_owned(),
                format!("state the samples in the robot's frame, or use {}", self.find_frame()),
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
            other => (other.to_string(), CHECK.to_owned()),
        }
    }

    fn too_few(&self, samples: u64, needed: u64) -> Refused {
        let line = self.case.samples.rows.last().map_or(1, |row| row.line);
        let found = count(usize::try_from(samples).unwrap_or(usize::MAX), "sample");
        let (why, remedy) = if self.case.options.no_guess {
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
                self.case.samples.name
            ),
            remedy: format!("measure more poses (20 or more are advisable), {remedy}"),
        }
    }

    /// Tolerances in the parameter's unit.
    fn distance(&self, arm: ArmIndex, parameter: Parameter, tolerances: f32) -> String {
        let Some(tolerance) = &self.case.robot.tolerance else {
            return "no tolerance is stated".to_owned();
        };
        let sigma = tolerance.of_arm(self.case.robot.robot.arm(arm), parameter);
        in_file_units(parameter, sigma * f64::from(tolerances))
    }
}
