//! What to measure next, in words: which arm and which combination of its parameters the samples
//! determine worst, and which poses would tell most.

use crate::accuracy::information;
use crate::accuracy::information::ARM;
use crate::calibration::report::CalibrationReport;
use crate::calibration::thresholds::{GOOD_CONDITION, MOSTLY};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, Reading, Row};
use crate::fit::options::Frame;
use crate::geometry::range::range;
use crate::planning::{Determined, SamplesRequest};
use crate::report::calibration::combination::Combination;
use crate::report::calibration::uncertain::uncertain;
use crate::text::joint;
use crate::text::numbers::small;
use crate::text::words::{capitalised, count, in_lines, list};
use delta_cal::calibration::ArmOutcome;
use delta_cal::{ArmIndex, Noise, Robot, Tolerance};
use nalgebra::{DVector, SMatrix, SVector, SymmetricEigen};

/// A joint that the samples move through less than this part of its range is moved too little.
const WIDE: f64 = 0.6;
/// Poses that are proposed.
const ADDED: usize = 4;

/// Sentences on what to measure next; the first says whether anything needs to be.
pub(super) fn advice(report: &CalibrationReport) -> Vec<String> {
    let arms = ArmIndex::ALL.into_iter().zip(&report.outcome.fit.arms);
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
    found.extend(best_added(report));
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
        .filter(|sample| report.stands_out(sample))
        .map(|sample| sample.line)
        .collect();
    let (samples, them, far) = match lines.len() {
        0 => return None,
        1 => ("the sample", "it", "it is far off"),
        _ => ("the samples", "them", "they are far off"),
    };
    let named = in_lines(&lines);
    let do_without = match report.suspected_count() {
        0 => format!(", or leave {them} out, because {far} all others"),
        _ => format!("; this calibration left {them} out, because {far} all others"),
    };
    Some(format!(
        "First measure {samples} of {named} again{do_without}."
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
            ", and the tolerance decided {decided} of its 8 parameters more than the samples did"
        ),
    };
    let tolerance = report.before.tolerance.as_ref();
    let known = weakest(&report.after.robot, arm, outcome, tolerance).map_or_else(
        || "Its uncertainty is not known, because too few samples are left over".to_owned(),
        |weakest| in_words(&weakest, tolerance.is_some()),
    );
    let condition = outcome.condition;
    capitalised(&format!(
        "{arm} has a condition of {condition:.0}{decided}. {known}."
    ))
}

/// What is known worst of an arm, in words.
fn in_words(weakest: &Combination, in_tolerances: bool) -> String {
    let size = if in_tolerances {
        format!("{:.2} tolerances", weakest.sigma)
    } else {
        format!("{} mm", small(weakest.sigma))
    };
    let words = weakest.in_words();
    if weakest.is_several() {
        format!(
            "These samples hardly distinguish {words}: a change of all of them together is known \
             worst (one sigma {size})"
        )
    } else {
        format!("The least known parameter is {words} (one sigma {size})")
    }
}

/// The eigenvector of the largest eigenvalue of the covariance, in units in which the parameters
/// compare.
fn weakest(
    robot: &Robot<f64>,
    arm: ArmIndex,
    outcome: &ArmOutcome<f64>,
    tolerance: Option<&Tolerance<f64>>,
) -> Option<Combination> {
    let covariance = outcome.covariance.as_ref()?;
    let units = information::units(robot);
    let places = robot.drive().places();
    let scales = SVector::<f64, 8>::from_fn(|place, _| match (places[place], tolerance) {
        (Some(parameter), Some(tolerance)) => tolerance.of_arm(robot.arm(arm), parameter),
        (Some(_), None) => units[ARM * arm.index() + place].recip(),
        (None, _) => 1.0,
    });
    let scaled = SMatrix::<f64, 8, 8>::from_fn(|i, j| covariance[(i, j)] / (scales[i] * scales[j]));
    let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?;
    let (index, variance) = eigen.eigenvalues.argmax();
    let direction = DVector::from_column_slice(eigen.eigenvectors.column(index).as_slice());
    let sigma = variance.max(0.0).sqrt();
    let named = places.map(|parameter| Some((arm, parameter?)));
    Some(Combination::new(&named, &direction, sigma))
}

fn narrow_joints(report: &CalibrationReport) -> Option<String> {
    let limits = &report.before.limits;
    let full = limits.maximum() - limits.minimum();
    let shown = |q: f64| joint::whole(limits.drive(), q);
    let narrow: Vec<_> = ArmIndex::ALL
        .into_iter()
        .enumerate()
        .filter_map(|(joint, arm)| {
            let angles = report.sample_errors.iter();
            let angles = angles.map(|sample| sample.measured.joints[joint]);
            let (low, high) = range(angles);
            (high - low < WIDE * full)
                .then(|| format!("{arm} from {} to {}", shown(low), shown(high)))
        })
        .collect();
    (!narrow.is_empty()).then(|| {
        format!(
            "The samples move these joints through only a small part of their range of {} to \
             {}: {}. Add poses outside that part, as far as the robot gets.",
            shown(limits.minimum()),
            shown(limits.maximum()),
            list(&narrow)
        )
    })
}

/// The poses that tell most beyond the samples, and what they would be worth.
fn best_added(report: &CalibrationReport) -> Option<String> {
    let estimated = report.outcome.fit.arms[0].estimated_noise;
    let estimated = estimated.and_then(|position| Noise::new(position, 0.0).ok());
    let robot = RobotFile {
        noise: report.after.noise.or(estimated),
        ..report.after.clone()
    };
    let rows = report.sample_errors.iter().map(|sample| Row {
        line: sample.line,
        value: Reading {
            joints: sample.measured.joints,
            position: sample.measured.position.data.0[0].map(Some),
            height: None,
            distance: None,
        },
    });
    let file = ObservationsFile {
        name: String::new(),
        rows: rows.collect(),
        planes: Vec::new(),
        points: Vec::new(),
    };
    let request = SamplesRequest {
        frame: Frame::Base,
        add: ADDED,
        region: None,
        absolute: true,
    };
    let next = Determined::by(&robot, &file, &[], &request).ok()?;
    if next.next.is_empty() {
        return None;
    }
    let named: Vec<_> = next
        .next
        .iter()
        .map(|own| {
            let joints = own
                .pose
                .joints
                .map(|q| joint::whole(robot.robot.drive(), q));
            joints.join(", ")
        })
        .collect();
    let worth = match (&next.now, &next.with_next) {
        (Some(before), Some(after)) => format!(
            " They \
             would bring the standard uncertainty of the position to {} mm instead of {} mm (rms over the workspace).",
            small(after.absolute.rms),
            small(before.absolute.rms)
        ),
        _ => String::new(),
    };
    Some(format!(
        "These joint angles would tell most about the robot, the best first: {}.{worth} `delta-cal plan --samples` \
         proposes more.",
        named.join("; ")
    ))
}
