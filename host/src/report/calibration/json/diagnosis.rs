//! What would explain a file that cannot be right as a whole.

use crate::calibration::diagnosis::{Diagnosis, DiagnosisEvidence};
use serde_json::{Value, json};

pub(super) fn json(diagnosis: &Diagnosis) -> Value {
    let explanations = diagnosis.explanations.iter().map(|explanation| {
        json!({
            // What is wrong: one fault, or two together.
            "cause": explanation.cause,
            // What to do about it.
            "remedy": explanation.remedy,
            // The median error without the fault.
            "median_error_mm": explanation.without,
            // The same after a calibration; `null` if that is refused.
            "calibrated_median_error_mm": explanation.calibrated,
        })
    });
    json!({
        // All of it in one sentence.
        "text": diagnosis.to_string(),
        // From where the distances are.
        "evidence": match diagnosis.evidence {
            DiagnosisEvidence::RobotFile => "robot file",
            DiagnosisEvidence::Fit => "fit without a guess",
        },
        // Half of the measured points are nearer than this; `null` if the robot does not reach them.
        "median_error_mm": diagnosis.as_they_are,
        // The best first, all about equally good.
        "explanations": explanations.collect::<Vec<_>>(),
    })
}
