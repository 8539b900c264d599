//! What is wrong with a file of samples as a whole: columns exchanged, a wrong sign, another unit,
//! a mirrored frame. Each fault is undone and the samples compared with the robot of the file; the
//! faults without which they agree clearly better are named. Nothing is ever corrected.

mod evidence;
mod hypothesis;
mod words;

use crate::{Frame, InputError, InputText, Options, RobotFile, SamplesFile};
use evidence::{Evidence, Scored, calibrated};
use hypothesis::{AngleUnit, Fault};
use std::fmt;
use words::Words;

/// Explanations that are named; others that are as good are counted.
const NAMED: usize = 4;
/// A fit without a guess explains the samples if it is this many times nearer…
const CLEARLY: f64 = 4.0;
/// …and leaves no more than this part of the forearm.
const FITS: f64 = 0.01;

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

    /// Of samples that are in a file, whether a calibration accepts them or not; `None` if nothing is
    /// wrong with the file as a whole, or no fault explains what is.
    pub(crate) fn of(robot: &RobotFile, samples: &SamplesFile, options: Options) -> Option<Self> {
        let evidence = Evidence::new(robot, samples, options)?;
        let as_they_are = evidence.median(&[]);
        let found = evidence.explanations(as_they_are);
        let (as_they_are, kind, found) = if found.is_empty() && options.no_guess {
            let (as_they_are, found) = by_fits(robot, samples, options);
            (as_they_are, DiagnosisEvidence::Fit, found)
        } else {
            (as_they_are, DiagnosisEvidence::RobotFile, found)
        };
        if found.is_empty() {
            return None;
        }
        let explain = |scored: &Scored| explanation(robot, samples, options, scored);
        Some(Self {
            as_they_are,
            evidence: kind,
            explanations: found.iter().map(explain).collect(),
        })
    }

    /// The fault of a file whose joint angles are outside the limits, with what would explain the
    /// file as a whole.
    pub(crate) fn of_unread(
        robot: &RobotFile,
        input: &InputText,
        options: Options,
        error: InputError,
    ) -> InputError {
        let diagnosis = SamplesFile::read_any(input)
            .ok()
            .and_then(|samples| Self::of(robot, &samples, options));
        match diagnosis {
            Some(diagnosis) => error.with_diagnosis(diagnosis),
            None => error,
        }
    }
}

fn explanation(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
    scored: &Scored,
) -> Explanation {
    let words = Words {
        robot: &robot.name,
        samples,
        frame: if scored.faults.contains(&Fault::Elsewhere) {
            Frame::Sensor
        } else {
            options.frame
        },
    };
    let all = |of: &dyn Fn(&Fault) -> String, between: &str| {
        let parts: Vec<_> = scored.faults.iter().map(of).collect();
        parts.join(between)
    };
    Explanation {
        cause: all(&|fault| words.cause(fault), " and "),
        remedy: all(&|fault| words.remedy(fault), ", and "),
        without: scored.median,
        calibrated: calibrated(robot, samples, options, &scored.faults),
    }
}

/// The robot file being no guess, only what no robot could do tells: joint angles in another unit.
fn by_fits(robot: &RobotFile, samples: &SamplesFile, options: Options) -> (f64, Vec<Scored>) {
    let fitted = |faults: &[Fault]| calibrated(robot, samples, options, faults);
    let as_they_are = fitted(&[]).unwrap_or(f64::INFINITY);
    let [arm, ..] = robot.robot.arms();
    let least = FITS * arm.lb();
    if as_they_are <= least {
        return (as_they_are, Vec::new());
    }
    let found = [AngleUnit::Radians, AngleUnit::Degrees]
        .into_iter()
        .filter_map(|unit| {
            let faults = vec![Fault::Angles([true; 3], unit)];
            let median = fitted(&faults)?;
            let explains = median <= least && median * CLEARLY <= as_they_are;
            explains.then_some(Scored { faults, median })
        });
    (as_they_are, found.collect())
}
