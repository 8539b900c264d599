//! What would explain a file that cannot be right as a whole, and refusals.

use super::SCHEMA_VERSION;
use crate::calibration::diagnosis::{Diagnosis, DiagnosisEvidence};
use crate::calibration::error::CalibrateError;
use serde::Serialize;

/// What would explain samples that cannot be right as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonDiagnosis {
    /// All of it in one sentence.
    pub text: String,
    /// `robot file` or `fit without a guess`: from where the distances are.
    pub evidence: &'static str,
    /// Half of the measured points are nearer than this; `null` if the robot does not reach them.
    pub median_error_mm: Option<f64>,
    /// The best first, all about equally good.
    pub explanations: Vec<JsonExplanation>,
}

/// One fault, or two together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonExplanation {
    /// What is wrong.
    pub cause: String,
    /// What to do about it.
    pub remedy: String,
    /// The median error without the fault.
    pub median_error_mm: f64,
    /// The same after a calibration; `null` if that is refused.
    pub calibrated_median_error_mm: Option<f64>,
}

impl JsonDiagnosis {
    pub(crate) fn new(diagnosis: &Diagnosis) -> Self {
        Self {
            text: diagnosis.to_string(),
            evidence: match diagnosis.evidence {
                DiagnosisEvidence::RobotFile => "robot file",
                DiagnosisEvidence::Fit => "fit without a guess",
            },
            median_error_mm: Some(diagnosis.as_they_are).filter(|error| error.is_finite()),
            explanations: diagnosis
                .explanations
                .iter()
                .map(|explanation| JsonExplanation {
                    cause: explanation.cause.clone(),
                    remedy: explanation.remedy.clone(),
                    median_error_mm: explanation.without,
                    calibrated_median_error_mm: explanation.calibrated,
                })
                .collect(),
        }
    }
}

/// A calibration that is refused, for programs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonRefusal {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The program's version.
    pub program_version: &'static str,
    /// Why there is no calibration.
    pub refused: String,
    /// What to do next.
    pub remedy: String,
    /// What would explain the samples; `null` if nothing is wrong with them as a whole, or nothing
    /// explains it.
    pub diagnosis: Option<JsonDiagnosis>,
}

impl JsonRefusal {
    /// Of a refusal.
    pub fn new(error: &CalibrateError) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION"),
            refused: error.to_string(),
            remedy: error.remedy().unwrap_or_default(),
            diagnosis: error.diagnosis.as_deref().map(JsonDiagnosis::new),
        }
    }

    /// As [`JsonReport::to_text`](super::JsonReport::to_text).
    ///
    /// # Errors
    /// None is known; the serialiser's, if it had one.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}
