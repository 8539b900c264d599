//! What would explain samples that cannot be right as a whole.

use serde::Serialize;
use std::fmt;

/// Explanations that are named; others that are as good are counted.
const NAMED: usize = 4;

/// What would explain samples that cannot be right as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Half of the measured points are within this distance of where the robot of the file would be,
    /// mm; infinite if it does not reach them or they are in one spot.
    pub as_they_are: f64,
    /// What explains the samples, the best first, all about equally well. At least one.
    pub explanations: Vec<Explanation>,
}

/// One fault, or two together.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
        write!(
            formatter,
            "Probably {}. Without it half of the points are within {} mm of the robot file",
            best.cause,
            figures(best.without),
        )?;
        if let Some(calibrated) = best.calibrated {
            let calibrated = figures(calibrated);
            write!(formatter, " ({calibrated} mm after calibration)")?;
        }
        if self.as_they_are.is_finite() {
            write!(
                formatter,
                "; as they are, {} mm. ",
                figures(self.as_they_are)
            )?;
        } else {
            formatter.write_str(". ")?;
        }
        for other in others.iter().take(NAMED - 1) {
            write!(formatter, "Equally likely: {}. ", other.cause)?;
        }
        if let Some(more) = others.len().checked_sub(NAMED - 1).filter(|more| *more > 0) {
            write!(formatter, "{more} more are as likely. ")?;
        }
        formatter.write_str("Nothing was corrected")
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
