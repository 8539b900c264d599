//! What to measure next, in words: which arm and which combination of its parameters the samples
//! determine worst, and which joint angles no sample has.

use crate::CalibrationReport;
use crate::report::uncertain::uncertain;
use crate::units::degrees;
use crate::warnings::{GOOD_CONDITION, MOSTLY, stands_out};
use crate::words::{count, list};
use delta_cal::{Arm, ArmIndex, ArmOutcome, Parameter, ParameterKind, Tolerance};
use nalgebra::{SMatrix, SVector, SymmetricEigen};

/// A parameter belongs to a combination if its part is at least this part of the largest.
const BELONGS: f64 = 0.4;
/// A joint that the samples move through less than this part of its range is moved too little.
const WIDE: f64 = 0.6;
/// Regions without a sample that are named.
const NAMED: usize = 4;

/// The combination of an arm's parameters that is known worst.
struct Weakest {
    /// Parameters and their parts, the largest first and positive.
    parts: Vec<(Parameter, f64)>,
    /// One σ of it: in tolerances if they are stated, otherwise mm with angles times the upper arm.
    sigma: f64,
}

/// Sentences on what to measure next; the first says whether anything needs to be.
pub(super) fn advice(report: &CalibrationReport) -> Vec<String> {
    let arms = ArmIndex::ALL.into_iter().zip(&report.outcome.robot.arms);
    let (weak, others): (Vec<_>, Vec<_>) = arms.partition(|(_, outcome)| is_weak(outcome));
    let uncertain = uncertain(report, others.into_iter());
    let mut found: Vec<_> = outlying(report).into_iter().collect();
    if weak.is_empty() && !found.is_empty() {
        return found;
    }
    if weak.is_empty() && uncertain.is_none() {
        found.push(format!(
            "Nothing needs to be measured: every arm's condition is below {GOOD_CONDITION:.0}, and \
             the samples decided every parameter. Four times as many samples, spread like these, \
             would halve every σ."
        ));
        return found;
    }
    for (arm, outcome) in weak {
        found.push(weakness(report, arm, outcome));
    }
    found.extend(uncertain);
    found.extend(narrow_joints(report));
    found.extend(empty_regions(report));
    if report.samples < 20 {
        found.push(format!(
            "{} are few: measure 20 or more, spread over the whole workspace.",
            count(report.samples, "sample")
        ));
    }
    found
}

/// Samples that stand out spoil more than any new one can mend.
fn outlying(report: &CalibrationReport) -> Option<String> {
    let samples = report.sample_errors.iter();
    let lines: Vec<_> = samples
        .filter(|sample| stands_out(report, sample))
        .map(|sample| sample.line.to_string())
        .collect();
    let (them, line) = match lines.len() {
        0 => return None,
        1 => ("the sample", "line"),
        _ => ("the samples", "lines"),
    };
    let named = list(lines.get(..NAMED).unwrap_or(&lines));
    let others = match lines.len().saturating_sub(NAMED) {
        0 => String::new(),
        others => format!(" (and {others} more)"),
    };
    let do_without = match report.suspected().count() {
        0 => ", or do without: far off all others",
        _ => ": far off all others, and of no use to this calibration",
    };
    Some(format!(
        "First measure {them} of {line} {named}{others} again{do_without}."
    ))
}

fn is_weak(outcome: &ArmOutcome<f64>) -> bool {
    !(outcome.condition < GOOD_CONDITION)
        || outcome.covariance.is_none()
        || outcome.prior_share.iter().any(|share| *share > MOSTLY)
}

fn weakness(report: &CalibrationReport, arm: ArmIndex, outcome: &ArmOutcome<f64>) -> String {
    let decided = outcome.prior_share.iter().filter(|share| **share > MOSTLY);
    let decided = match decided.count() {
        0 => String::new(),
        decided => format!(
            ", and the tolerance more than the samples decided {decided} of its 8 parameters"
        ),
    };
    let tolerance = report.before.tolerance.as_ref();
    let known = weakest(outcome, tolerance).map_or_else(
        || "Its uncertainty is not known: too few samples are left over".to_owned(),
        |weakest| weakest.in_words(tolerance.is_some()),
    );
    let condition = outcome.condition;
    capitalised(&format!(
        "{arm} has a condition of {condition:.0}{decided}. {known}."
    ))
}

impl Weakest {
    fn in_words(&self, in_tolerances: bool) -> String {
        let size = if in_tolerances {
            format!("{:.2} tolerances", self.sigma)
        } else {
            format!("{} mm", super::table::small(self.sigma))
        };
        let signed = |(parameter, part): &(Parameter, f64)| {
            let sign = if *part < 0.0 { "\u{2212}" } else { "+" };
            format!("{sign}{parameter}")
        };
        match self.parts.as_slice() {
            [(alone, _)] => format!("Known worst is {alone} (one sigma {size})"),
            parts => format!(
                "Known worst is a change of {} together (one sigma {size}): these samples hardly \
                 tell one from the other",
                list(&parts.iter().map(signed).collect::<Vec<_>>())
            ),
        }
    }
}

/// The eigenvector of the largest eigenvalue of the covariance, in units in which the parameters
/// compare.
fn weakest(outcome: &ArmOutcome<f64>, tolerance: Option<&Tolerance<f64>>) -> Option<Weakest> {
    let covariance = outcome.covariance.as_ref()?;
    let units = SVector::from(Parameter::ALL.map(|parameter| {
        tolerance.map_or_else(
            || unit(&outcome.arm, parameter),
            |tolerance| tolerance.of(parameter),
        )
    }));
    let scaled = SMatrix::<f64, 8, 8>::from_fn(|i, j| covariance[(i, j)] / (units[i] * units[j]));
    let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?;
    let (index, variance) = eigen.eigenvalues.argmax();
    let direction = eigen.eigenvectors.column(index);
    let largest = direction[direction.iamax()];
    let mut parts: Vec<_> = Parameter::ALL
        .into_iter()
        .map(|parameter| (parameter, direction[parameter.index()] / largest))
        .filter(|(_, part)| part.abs() >= BELONGS)
        .collect();
    parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    Some(Weakest {
        parts,
        sigma: variance.max(0.0).sqrt(),
    })
}

/// What changes the arm by a millimetre.
pub(super) fn unit(arm: &Arm<f64>, parameter: Parameter) -> f64 {
    match parameter.kind() {
        ParameterKind::Length => 1.0,
        ParameterKind::Angle => arm.upper_arm_length().recip(),
    }
}

fn narrow_joints(report: &CalibrationReport) -> Option<String> {
    let limits = &report.before.limits;
    let full = limits.maximum() - limits.minimum();
    let narrow: Vec<_> = ArmIndex::ALL
        .into_iter()
        .enumerate()
        .filter_map(|(joint, arm)| {
            let angles = report.sample_errors.iter();
            let angles = angles.map(|sample| sample.measured.joints[joint]);
            let low = angles.clone().fold(f64::INFINITY, f64::min);
            let high = angles.fold(f64::NEG_INFINITY, f64::max);
            (high - low < WIDE * full)
                .then(|| format!("{arm} from {:.0}° to {:.0}°", degrees(low), degrees(high)))
        })
        .collect();
    (!narrow.is_empty()).then(|| {
        format!(
            "The samples move the joints through a small part of their range of {:.0}° to {:.0}°: \
             {}. Add poses beyond, as far as the robot gets.",
            degrees(limits.minimum()),
            degrees(limits.maximum()),
            list(&narrow)
        )
    })
}

/// Of the eight combinations of each joint being low or high, those that the robot reaches and no
/// sample has.
fn empty_regions(report: &CalibrationReport) -> Option<String> {
    let limits = &report.before.limits;
    let middle = limits.at(0.5);
    let region = |joints: [f64; 3]| joints.map(|angle| angle > middle);
    let empty: Vec<_> = [
        [false, false, false],
        [true, false, false],
        [false, true, false],
        [false, false, true],
        [true, true, false],
        [true, false, true],
        [false, true, true],
        [true, true, true],
    ]
    .into_iter()
    .filter(|highs| {
        let centre = highs.map(|high| limits.at(if high { 0.75 } else { 0.25 }));
        let taken = |sample: &crate::SampleErrors| region(sample.measured.joints) == *highs;
        report.after.robot.forward(&centre).is_ok() && !report.sample_errors.iter().any(taken)
    })
    .collect();
    if empty.is_empty() {
        return None;
    }
    let named: Vec<_> = empty
        .iter()
        .take(NAMED)
        .map(|highs| joints(*highs))
        .collect();
    let others = match empty.len() - named.len() {
        0 => String::new(),
        others => format!("; and {others} more"),
    };
    Some(format!(
        "No sample lies in {} of the 8 regions of joint angles (each joint below or above {:.0}°): \
         measure with {}{others}.",
        empty.len(),
        degrees(middle),
        named.join("; ")
    ))
}

fn joints(highs: [bool; 3]) -> String {
    let which = |wanted: bool| {
        let joints = (1..).zip(highs).filter(|(_, high)| *high == wanted);
        joints
            .map(|(joint, _)| format!("q{joint}"))
            .collect::<Vec<_>>()
    };
    match (which(true), which(false)) {
        (high, low) if low.is_empty() => format!("{} high", list(&high)),
        (high, low) if high.is_empty() => format!("{} low", list(&low)),
        (high, low) => format!("{} high, {} low", list(&high), list(&low)),
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
