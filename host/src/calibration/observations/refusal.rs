//! Why observations cannot calibrate a robot, and which single mistake in the file would explain it.

use super::report::ObservationsReport;
use crate::calibration::plausibility::implausible;
use crate::calibration::reason::Refused;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{ObservationsFile, Reading, ReadingFrom};
use crate::fit::observations::calibrate;
use crate::fit::options::Options;
use crate::text::numbers::significant;
use crate::text::words::{count, in_file_units};
use delta_cal::Refusal;
use delta_cal::observations::Instrument;
use delta_cal::robust::RobustRefusal;

const INCH: f64 = 25.4;
/// A gauge block that serves a purpose is higher, mm.
const LEAST_BLOCK: f64 = 20.0;
/// Rows that are left out one by one at most.
const ROWS_TRIED: usize = 200;

const STATE_TOLERANCE: &str = "state the [tolerance] that the robot was made to: heights and distances alone \
                               never tell where the robot stands in space";

type Change = fn(&mut Reading);

/// Mistakes that change all rows alike.
const MISTAKES: [(&str, &str, Change); 7] = [
    (
        "the heights have the wrong sign",
        "change their signs",
        |row| {
            row.height = row.height.map(|(plane, height)| (plane, -height));
        },
    ),
    (
        "the heights are in inches",
        "convert them to millimetres",
        |row| {
            row.height = row.height.map(|(plane, height)| (plane, INCH * height));
        },
    ),
    (
        "the distances are in inches",
        "convert them to millimetres",
        |row| {
            row.distance = row.distance.map(|(from, distance)| (from, INCH * distance));
        },
    ),
    (
        "the joint angles have the wrong sign",
        "change their signs",
        |row| {
            each_pose(row, |joints| joints.map(|q| -q));
        },
    ),
    (
        "the joint columns 1 and 2 are exchanged",
        "exchange the names of these columns",
        |row| each_pose(row, |[a, b, c]| [b, a, c]),
    ),
    (
        "the joint columns 2 and 3 are exchanged",
        "exchange the names of these columns",
        |row| each_pose(row, |[a, b, c]| [a, c, b]),
    ),
    (
        "the joint columns 1 and 3 are exchanged",
        "exchange the names of these columns",
        |row| each_pose(row, |[a, b, c]| [c, b, a]),
    ),
];

fn each_pose(row: &mut Reading, change: fn([f64; 3]) -> [f64; 3]) {
    row.joints = change(row.joints);
    if let Some((ReadingFrom::Pose(joints), _)) = &mut row.distance {
        *joints = change(*joints);
    }
}

/// The reason, with the mistake that explains it, if there is one.
pub(super) fn refused(
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
    refusal: Refusal,
) -> Refused {
    let (cause, remedy) = words(robot, samples, &refusal);
    let contradiction = matches!(
        refusal,
        Refusal::ResidualContradictsNoise { .. }
            | Refusal::FarFromNominal { .. }
            | Refusal::NotConverged { .. }
            | Refusal::ImpossibleGeometry { .. }
            | Refusal::ImpossibleRobot(_)
    );
    let explanation = contradiction
        .then(|| explanation(robot, samples, options))
        .flatten();
    let (cause, remedy) = match explanation {
        Some((mistake, mend)) => (format!("{mistake} ({cause})"), mend),
        None if contradiction && without_blocks(samples) => (
            cause,
            format!("{remedy}; is the height of the gauge block in height_mm?"),
        ),
        None => (cause, remedy),
    };
    Refused {
        cause: format!("{}: {cause}", samples.name),
        remedy,
    }
}

/// What speaks against a calibration without a tolerance, which nothing keeps near the robot file.
pub(super) fn objection(report: &ObservationsReport) -> Option<Refused> {
    if report.before.tolerance.is_some() {
        return None;
    }
    let refused = |cause: String| {
        let remedy = "state the [tolerance] that the robot was made to, or measure more poses, spread over the whole \
                      workspace";
        Some(Refused::new(
            format!("{}: {cause}", report.samples.name),
            remedy,
        ))
    };
    let (before, after) = (&report.before.robot, &report.after.robot);
    if let Some(change) = implausible(before, after) {
        return refused(format!("the result is not credible: {change}"));
    }
    let Some(comparison) = report
        .workspace
        .filter(|_| report.degrees_of_freedom >= 1.0)
    else {
        return refused(
            "the readings are as many as they determine, so that nothing says how far off the result is".to_owned(),
        );
    };
    comparison.may_be_worse().then(|| {
        refused(format!(
            "the calibration may make the robot worse, with a probability of {} %: it would move the positions, relative to \
             each other, by {:.3} mm (rms over the workspace), and they would be uncertain by {:.3} mm (one sigma)",
            significant(100.0 * comparison.chance_of_harm.unwrap_or(1.0), 2),
            comparison.judged.change,
            comparison.judged.sigma
        ))
    })?
}

/// Whether no height is that of a gauge block, as if the blocks had been left out.
fn without_blocks(samples: &ObservationsFile) -> bool {
    let rows = samples.rows.iter();
    let heights: Vec<_> = rows.filter_map(|row| Some(row.value.height?.1)).collect();
    !heights.is_empty() && heights.iter().all(|height| height.abs() < LEAST_BLOCK)
}

/// Why there is no robust fit.
pub(super) fn robust(samples: &ObservationsFile, refusal: &RobustRefusal) -> Refused {
    let (cause, remedy) = match *refusal {
        RobustRefusal::TooFewSamples { samples, needed } => (
            format!("{} are too few for a robust fit, which needs {needed}", count(samples, "row")),
            "measure at more poses, or use --loss squared".to_owned(),
        ),
        RobustRefusal::TooManySuspected { suspected, samples } => (
            format!(
                "{suspected} of {samples} rows disagree with the others: with so many the program cannot tell \
                 which ones are wrong"
            ),
            "check the units and signs in the file, and whether the plate, a point or the robot's base moved"
                .to_owned(),
        ),
        ref other => (other.to_string(), "use --loss squared".to_owned()),
    };
    Refused {
        cause: format!("{}: {cause}", samples.name),
        remedy,
    }
}

fn words(robot: &RobotFile, samples: &ObservationsFile, refusal: &Refusal) -> (String, String) {
    let name = |instrument: Instrument| match instrument {
        Instrument::Frame => "the sensor's frame".to_owned(),
        Instrument::Plane(index) => match samples.planes.get(usize::from(index)) {
            Some(name) if samples.planes.len() > 1 => format!("plane {name}"),
            _ => "the plane".to_owned(),
        },
        Instrument::Point(index) => {
            let name = samples.points.get(usize::from(index));
            format!("point {}", name.map_or("", String::as_str))
        }
        Instrument::Transmission(arm) => format!("the transmission of {arm}"),
    };
    match *refusal {
        Refusal::TooFewObservations {
            instrument,
            observations,
            needed,
        } => (
            format!(
                "{} has {} and needs {needed}, as many as its place has unknown numbers",
                name(instrument),
                count(usize::try_from(observations).unwrap_or(usize::MAX), "reading"),
            ),
            "measure it at more poses, or leave out its rows".to_owned(),
        ),
        Refusal::UndeterminedInstrument(instrument) => (
            format!("the poses do not determine where {} is", name(instrument)),
            if robot.tolerance.is_none() {
                STATE_TOLERANCE.to_owned()
            } else {
                "measure it at poses that are not on one line and well apart".to_owned()
            },
        ),
        Refusal::TooFewSamples { samples, needed, .. } => (
            format!(
                "the file holds {} and needs {needed} rows without a [tolerance]",
                count(usize::try_from(samples).unwrap_or(usize::MAX), "row")
            ),
            "state the [tolerance] that the robot was made to, which decides what the rows leave \
             open, or measure more poses"
                .to_owned(),
        ),
        Refusal::Undetermined { arm, parameter, .. } => (
            format!(
                "the measurements do not determine the robot, {parameter} of {arm} least of all"
            ),
            if robot.tolerance.is_none() {
                STATE_TOLERANCE.to_owned()
            } else {
                "measure at poses that differ more".to_owned()
            },
        ),
        Refusal::Uncertain {
            arm,
            parameter,
            sigma,
        } => (
            format!(
                "the measurements leave {parameter} of {arm} unknown: its sigma is {}",
                in_file_units(parameter, f64::from(sigma))
            ),
            "state the [tolerance] that the robot was made to, or measure more poses".to_owned(),
        ),
        Refusal::ResidualContradictsNoise { ratio, .. } => (
            format!("the residuals are {ratio:.1} times what the stated [noise] allows"),
            "look for a wrong row or a plate that moved (--loss tukey leaves wrong rows out and names them); \
             state the [noise] that repeated readings of one pose show"
                .to_owned(),
        ),
        Refusal::FarFromNominal {
            arm,
            parameter,
            tolerances,
        } => (
            format!(
                "the fit puts {parameter} of {arm} {tolerances:.1} tolerances away from nominal, which \
                 the stated [tolerance] makes incredible"
            ),
            "check the units and signs in the file, and the dimensions in the robot file".to_owned(),
        ),
        other => (
            other.to_string(),
            "check the units and signs in the file, and the dimensions in the robot file".to_owned(),
        ),
    }
}

/// A mistake without which the file calibrates this robot: one of all rows, or a single wrong row.
fn explanation(
    robot: &RobotFile,
    samples: &ObservationsFile,
    options: Options,
) -> Option<(String, String)> {
    let fits = |file: &ObservationsFile| {
        calibrate(robot, file, options.frame, options.solver)
            .ok()
            .map(|fit| fit.residuals.iter().flatten().map(|own| own * own).sum())
    };
    let mut best: Option<(f64, &str, &str)> = None;
    for (mistake, mend, change) in MISTAKES {
        let mut changed = samples.clone();
        changed
            .rows
            .iter_mut()
            .for_each(|row| change(&mut row.value));
        if changed == *samples {
            continue;
        }
        if let Some(squares) = fits(&changed)
            && best.is_none_or(|(least, ..)| squares < least)
        {
            best = Some((squares, mistake, mend));
        }
    }
    if let Some((_, mistake, mend)) = best {
        return Some((mistake.to_owned(), mend.to_owned()));
    }
    if samples.rows.len() > ROWS_TRIED {
        return None;
    }
    let mut wrong: Option<(f64, u64)> = None;
    for index in 0..samples.rows.len() {
        let mut others = samples.clone();
        let row = others.rows.remove(index);
        if let Some(squares) = fits(&others)
            && wrong.is_none_or(|(least, _)| squares < least)
        {
            wrong = Some((squares, row.line));
        }
    }
    let (_, line) = wrong?;
    Some((
        format!("line {line} disagrees with all others"),
        "measure that row again, or delete it; a gauge block counted twice or a wrong plane has this \
         effect"
            .to_owned(),
    ))
}
