//! From readings to a good calibration, or to the reasons why there is none.
//!
//! ```text
//! RobotFile, Readings, Options ─→ explain ─→ fit ─→ Solution ─→ judge ─→ Judged ─→ findings ─→ Report
//!                                                                  └→ Objection ─→ refusal, with the diagnosis
//! ```

mod findings;
pub mod refusal;
pub mod report;
mod tilt;

use crate::accuracy::rigid_motion::degenerate;
use crate::explain::{
    Diagnosis, FEWEST, Found, MOST_WRONG, beside_the_platform_point, commanded, diagnose,
    explained_by_rods, mistake, search, shifted, shifted_rows,
};
use crate::files::{InputError, InputText, Kind, Readings, RobotFile};
use crate::fit::checks::{check_datum, checked};
use crate::fit::datum::Datum;
use crate::fit::jointly::of_platform_point;
use crate::fit::{Case, Frame, Options, Unsolved};
use crate::judge::{Judged, Objection, attempt, is_understated};
use crate::text::significant;
use delta_cal::Refusal;
use refusal::explained;
pub use refusal::{CalibrateError, Refused};
pub use report::Report;
pub(crate) use tilt::{NAMED, unused_rotations};

/// Reads the samples of a robot to be calibrated. If joint angles are outside its limits, the error says what would
/// explain the file as a whole.
///
/// # Errors
/// Those of [`Readings::read`].
pub fn read_samples(
    input: &InputText,
    robot: &RobotFile,
    options: &Options,
) -> Result<Readings, CalibrateError> {
    Readings::read(input, robot).map_err(|error| {
        let diagnosis = Readings::read_any(input, &robot.convention)
            .ok()
            .and_then(|readings| diagnose(robot, &readings, options));
        match diagnosis {
            Some(diagnosis) => {
                let remedy = format!("{diagnosis}: {}", diagnosis.remedy());
                error.with_remedy(remedy).into()
            }
            None => error.into(),
        }
    })
}

/// Calibrates the robot of a file from readings.
///
/// # Errors
/// Unusable input; readings that cannot calibrate this robot because they do not determine it, contradict what is
/// stated about it, or would probably make it worse.
///
/// ```
/// use delta_cal_host::files::example;
/// use delta_cal_host::{Options, calibrate};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (robot, readings) = example::load()?;
/// let report = calibrate(&robot, &readings, &Options::default())?;
/// assert!(report.expected_error.is_some_and(|expected| expected.absolute_rms_mm < 0.1));
/// # Ok(())
/// # }
/// ```
pub fn calibrate(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Result<Report, CalibrateError> {
    let robot = &readings.noise_into(robot);
    check(robot, readings, options)?;
    let case = Case::new(robot, readings, *options);
    let known = Datum::known_frame(robot, options.frame)?;
    // A printer that prints has no exchanged joints or wrong signs, and what its towers could do to a touch of the bed, the
    // bed's own shape does as well.
    let explained = !options.of_printer;
    let diagnosis = explained
        .then(|| diagnose(robot, &of_platform_point(robot, readings, known), options))
        .flatten();
    // A mistake in all rows needs no further explanation.
    let found = (explained && diagnosis.is_none())
        .then(|| search(&case))
        .flatten();
    let found = found.as_ref();
    match attempt(&case, found).and_then(|judged| explained_otherwise(&case, judged, found)) {
        Ok(judged) => Ok(Report::new(&case, judged, diagnosis)),
        Err(objection) => Err(refused(&case, &objection, found, diagnosis)),
    }
}

/// Looks for what else explains readings that contradict noise or tolerance, or rows that a robust fit left out. An error
/// that is then unknown is not stated.
fn explained_otherwise(
    case: &Case<'_>,
    mut judged: Judged,
    found: Option<&Found>,
) -> Result<Judged, Objection> {
    let explanation = || found.and_then(|own| own.explained(case));
    let rows = &judged.solution.rows;
    let suspected = rows.iter().filter(|fit| fit.suspected).count();
    let shifted = shifted_rows(&judged.solution).is_some();
    let best = found.and_then(|own| Some(&own.best.as_ref()?.hypothesis));
    let explained = || best.is_some_and(|own| !own.effects.is_empty());
    if suspected >= FEWEST && !shifted && (MOST_WRONG * suspected > rows.len() || explained()) {
        let objection = Unsolved::TooManySuspected(suspected, rows.len());
        return Err(Objection::Unsolved(objection));
    }
    let beyond = judged.tolerance.filter(|own| own.test.contradicts());
    // Causes are findings of their own. What is none, such as wrong rows or a wrong length, makes an estimated noise larger.
    let is_said = !judged.causes.found.is_empty() && best.is_none_or(|own| own.rows.is_empty());
    let unsaid = (suspected == 0 && !is_said)
        .then(|| found?.excess())
        .flatten();
    let contradicted = beyond.is_some() || unsaid.is_some() || is_understated(&judged.solution);
    let explained = contradicted.then(explanation).flatten();
    if !explained.as_ref().is_some_and(|own| own.is_scale) {
        judged.explained = explained.filter(|_| !is_said).map(|own| own.text);
        return Ok(judged);
    }
    if let (Some(own), Some(tolerance)) = (beyond, &case.robot.tolerance) {
        let statement = own.test.statement(case.robot.robot.drive(), tolerance);
        return Err(Objection::BeyondTolerance(own.test, statement));
    }
    let ratios = judged.noise.iter().map(|test| test.ratio);
    #[expect(clippy::cast_possible_truncation, reason = "two digits are shown")]
    let ratio = ratios.fold(unsaid.unwrap_or_default(), f64::max) as f32;
    let refusal = Refusal::ResidualContradictsNoise { arm: None, ratio };
    Err(Objection::Unsolved(refusal.into()))
}

fn refused(
    case: &Case<'_>,
    objection: &Objection,
    found: Option<&Found>,
    diagnosis: Option<Diagnosis>,
) -> CalibrateError {
    let by_one = || Some(found?.explained(case)?.text);
    let shifted = || {
        let best = found?.best.as_ref()?;
        let rows = &best.hypothesis.rows;
        Some(shifted(&best.solution, case.readings, rows)?.text)
    };
    let hint = diagnosis.is_none().then(|| match objection {
        Objection::Worse(..) => by_one(),
        own if !own.may_be_wrong_rows() => None,
        // Twelve numbers of the rods explain some of what a single cause does.
        // A mistake in all rows looks like many wrong ones.
        _ => mistake(case, found)
            .or_else(shifted)
            .or_else(by_one)
            .or_else(|| explained_by_rods(case))
            .or_else(|| Some(beside_the_platform_point(case)?.text)),
    });
    explained(case, objection, hint.flatten(), diagnosis)
}

fn check(robot: &RobotFile, readings: &Readings, options: &Options) -> Result<(), CalibrateError> {
    checked(robot, readings, options)?;
    if let Some((names, rms)) = commanded(robot, readings) {
        let cause = format!(
            "{}: {names} is where the robot file puts the platform, to {} mm: commanded, not measured.",
            readings.name,
            significant(rms, 1)
        );
        let remedy = format!("Write - for {names} in every row, or measure {names}.");
        return Err(Refused::new(cause, remedy).into());
    }
    if options.frame == Frame::Sensor {
        if !readings.holds(Kind::Position) {
            let cause = "no row holds x, y or z, so there is no frame to find";
            let error = InputError::new(&readings.name, cause);
            return Err(error.with_remedy("leave out --frame sensor").into());
        }
        let [arm, ..] = robot.robot.arms();
        let points: Vec<_> = readings.samples().map(|row| row.value.position).collect();
        if let Some(how) = degenerate(points.iter().copied(), arm.lb()) {
            let cause = format!(
                "{}: the measured points lie {how}, so the sensor frame is not determined.",
                readings.name
            );
            let refused = Refused::new(cause, "Measure poses all over the workspace.");
            return Err(refused.explained(diagnose(robot, readings, options)).into());
        }
    }
    Ok(check_datum(robot, readings, options.frame)?)
}
