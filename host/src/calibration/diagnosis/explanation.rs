//! What would explain samples that cannot be right as a whole.

use std::fmt;

/// Explanations that are named; others that are as good are counted.
const NAMED: usize = 4;

/// What would explain samples that cannot be right as a whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// Half of the measured points are within this distance of where the robot of the file would be,
    /// mm; infinite if it does not reach them or they are in one spot. With `evidence` [`Fit`](DiagnosisEvidence::Fit), of
    /// where the calibrated robot would be.
    pub as_they_are: f64,
    /// What the explanations were compared by.
    pub evidence: DiagnosisEvidence,
    /// What explains the samples, the best first, all about equally well. At least one.
    pub explanations: Vec<Explanation>,
}

/// What explanations are compared by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiagnosisEvidence {
    /// The distances of the measured points from where the robot of the file would be.
    RobotFile,
    /// The distances from where the robot would be that is fitted without a guess.
    Fit,
}

/// One fault, or two together.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// What is wrong, in words.
    pub cause: String,
    /// What to do about it.
    pub remedy: String,
    /// [`Diagnosis::as_they_are`] without the faults, mm.
    pub without: f64,
    /// The same after a calibration without the faults; `None` if that is refused.
    pub calibrated: Option<f64>,
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [best, others @ ..] = &self.explanations[..] else {
            return Ok(());
        };
        let whose = match self.evidence {
            DiagnosisEvidence::RobotFile => "the robot of the file",
            DiagnosisEvidence::Fit => "a robot fitted without a start value",
        };
        write!(
            formatter,
            "it looks as if {}. If that is undone, half of the measured points are within {} mm of \
             where {whose} would be",
            best.cause,
            figures(best.without),
        )?;
        if let Some(calibrated) = best.calibrated {
            let calibrated = figures(calibrated);
            write!(formatter, ", after a calibration within {calibrated} mm")?;
        }
        if self.as_they_are.is_finite() {
            write!(
                formatter,
                "; as the files are, within {} mm. ",
                figures(self.as_they_are)
            )?;
        } else {
            formatter.write_str("; as the files are, the two cannot be compared. ")?;
        }
        for other in others.iter().take(NAMED - 1) {
            write!(
                formatter,
                "Another explanation is as good: {}. ",
                other.cause
            )?;
        }
        if let Some(more) = others.len().checked_sub(NAMED - 1).filter(|more| *more > 0) {
            write!(formatter, "{more} more explanations are as good. ")?;
        }
        formatter.write_str("The program corrected nothing")
    }
}

/// Three significant digits.
fn figures(value: f64) -> String {
    match value {
        value if value >= 100.0 => format!("{value:.0}"),
        value if value >= 10.0 => format!("{value:.1}"),
        value if value >= 1.0 => format!("{value:.2}"),
        value if value >= 1e-3 => format!("{value:.4}"),
        value => format!("{value:.0e}"),
    }
}

impl Diagnosis {
    /// What to do about the first explanation, or the others.
    pub fn remedy(&self) -> String {
        let mut remedies: Vec<_> = Vec::new();
        for explanation in self.explanations.iter().take(NAMED) {
            if !remedies.contains(&explanation.remedy.as_str()) {
                remedies.push(&explanation.remedy);
            }
        }
        remedies.join("; or ")
    }
}
