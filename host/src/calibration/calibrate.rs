//! From a robot file and readings to a report, or to the reason why there is none.

use super::causes::CauseKind;
use super::credibility::{NoiseVerdict, PriorTest, doubtful};
use super::diagnosis::{Diagnosis, diagnose};
use super::findings::Finding;
use super::judge::{Case, Judged, attempt};
use super::one_number::explanation;
use super::refusal::{CalibrateError, Objection, Refused, explained};
use super::report::Report;
use super::step::{Step, step};
use super::wrong_rows::{Shift, beside_the_platform_point, explanations};
use crate::accuracy::position_error::PositionError;
use crate::accuracy::rigid_motion::degenerate;
use crate::files::input::{InputError, InputText};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, READINGS, Reading, ReadingFrom, Readings};
use crate::fit::datum::Datum;
use crate::fit::{Frame, Method, Options};
use crate::text::joint;
use delta_cal::calibration::StartUsed;
use delta_cal::{Noise, Parameter};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// A parameter is the tolerance's rather than the samples' beyond this share.
const MOSTLY: f64 = 0.5;
/// Without a tolerance, fewer samples than this may have several solutions.
const FEW_SAMPLES: usize = 12;
/// Below it a condition is good. Above, the parameters are known a hundred times worse than each
/// alone would be.
const GOOD_CONDITION: f64 = 100.0;
/// A standardised residual of more σ is an outlier.
const OUTLIER: f64 = 4.5;
/// Residuals above this part of what the tolerance allows leave little to the samples.
const LITTLE: f64 = 0.5;

/// Reads the samples of a robot that is to be calibrated. Where joint angles are outside its limits, what would explain
/// the file as a whole is said.
///
/// # Errors
/// As [`Readings::read`].
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
/// An input that cannot be used; readings that cannot calibrate this robot: they do not determine it, contradict what
/// is stated of it, or would probably make it worse.
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
    let moved = checked(robot, readings, options)?;
    let weighted = with_noise_of_rows(robot, readings);
    let robot = weighted.as_ref().unwrap_or(robot);
    let case = Case {
        robot,
        before: robot,
        readings: &moved,
        options: *options,
    };
    let diagnosis = || diagnose(robot, &moved, options);
    match attempt(&case) {
        Ok(judged) => Ok(reported(&case, judged, diagnosis())),
        Err(objection) => Err(refused(&case, &objection, diagnosis())),
    }
}

fn refused(case: &Case<'_>, objection: &Objection, diagnosis: Option<Diagnosis>) -> CalibrateError {
    let mut hints = Vec::new();
    if objection.may_be_wrong_rows() && diagnosis.is_none() {
        let target = beside_the_platform_point(case.robot, case.readings, case.options.frame);
        match target {
            Some(target) => hints.push(target.to_string()),
            None => match explanation(case).or_else(|| step(case).map(|own| own.to_string())) {
                Some(found) => hints.push(found),
                None => hints.extend(explanations(case.robot, case.readings, &case.options)),
            },
        }
    }
    let error = explained(
        case.robot,
        case.readings,
        case.options.frame,
        objection,
        &hints,
    );
    match error {
        CalibrateError::Refused(mut refused) => {
            refused.diagnosis = diagnosis;
            CalibrateError::Refused(refused)
        }
        error @ CalibrateError::Input(_) => error,
    }
}

/// The robot with the noise that rows state, `None` if none does. It takes the place of that of the robot file, and that of
/// a row then makes its weight.
fn with_noise_of_rows(robot: &RobotFile, readings: &Readings) -> Option<RobotFile> {
    let sigmas = Kind::ALL.map(|kind| readings.stated_sigma(kind));
    let [position, height, distance] = sigmas;
    if sigmas.iter().all(Option::is_none) {
        return None;
    }
    let facts = &robot.instruments;
    let joint = robot.noise.map(|noise| noise.joint()).or(facts.joint_noise);
    let noise = position.and_then(|sigma| Noise::new(sigma, joint.unwrap_or_default()).ok());
    let mut weighted = robot.clone();
    weighted.noise = noise.or(robot.noise);
    weighted.instruments.height_noise = height.or(facts.height_noise);
    weighted.instruments.distance_noise = distance.or(facts.distance_noise);
    Some(weighted)
}

/// The readings as they are to be used, once everything is right with the files and options.
fn checked(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Result<Readings, CalibrateError> {
    check_method(robot, readings, options)?;
    if options.robust && readings.rows.iter().any(|row| row.value.sigma.is_some()) {
        let cause = "--robust weighs the rows itself, and the file states the uncertainty of each";
        return Err(InputError::new(&readings.name, cause)
            .with_remedy("leave out --robust, or write _ before the name of the column")
            .into());
    }
    check_frame(readings, options.frame)?;
    check_names(robot, readings)?;
    if options.frame == Frame::Sensor {
        let [arm, ..] = robot.robot.arms();
        let points: Vec<_> = readings.samples().map(|row| row.value.position).collect();
        if let Some(how) = degenerate(points.iter().copied(), arm.lb()) {
            let cause = format!(
                "{}: the measured points lie {how}, so the sensor's frame is not determined.",
                readings.name
            );
            let refused = Refused::new(cause, "Measure poses all over the workspace.");
            return Err(refused.explained(diagnose(robot, readings, options)).into());
        }
    }
    let datum = datum(robot, readings, options.frame)?;
    let Some(target) = robot.instruments.target else {
        return Ok(readings.clone());
    };
    // Positions of the platform point in place of those of the target. In an unknown frame the place of the frame takes
    // it in, for the platform does not turn.
    let shift = match (options.frame, &datum) {
        (Frame::Base, _) => target,
        (Frame::Sensor, Some(datum)) => datum.frame.rotation * target,
        (Frame::Sensor, None) => Vector3::zeros(),
    };
    Ok(readings.clone().moved(&-shift))
}

/// The sensor's frame by the points of `[datum]`.
fn datum(
    robot: &RobotFile,
    readings: &Readings,
    frame: Frame,
) -> Result<Option<Datum>, InputError> {
    let Some(datum) = Datum::of(robot, frame)? else {
        return Ok(None);
    };
    let single = |row: &Reading| row.sample().is_none() && row.kind() == Some(Kind::Position);
    if let Some(index) = readings.rows.iter().position(|row| single(&row.value)) {
        return Err(readings.fault(index, "with [datum] a row needs all of x, y and z"));
    }
    Ok(Some(datum))
}

fn check_method(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Result<(), InputError> {
    let closures = matches!(options.method, Some(Method::Joint | Method::Ikm));
    if !closures {
        return Ok(());
    }
    let faults = [
        (
            options.frame == Frame::Sensor && robot.instruments.datum.is_empty(),
            &readings.name,
            "--method joint and ikm need positions in the robot's frame",
            "use --method fkm",
        ),
        (
            options.robust,
            &readings.name,
            "--robust is a loss function of the FKM method",
            "use --method fkm",
        ),
        (
            readings.rows.iter().any(|row| row.value.sigma.is_some()),
            &readings.name,
            "only the FKM method weighs each row by its own uncertainty",
            "use --method fkm, or write _ before the name of the column",
        ),
        (
            robot.transmission.is_some(),
            &robot.name,
            "only the FKM method finds transmissions",
            "use --method fkm, or delete transmission_deg",
        ),
        (
            !readings.is_complete(),
            &readings.name,
            "--method joint and ikm need x, y and z in every row",
            "use --method fkm",
        ),
    ];
    match faults.into_iter().find(|(faulty, ..)| *faulty) {
        Some((_, file, cause, remedy)) => Err(InputError::new(file, cause).with_remedy(remedy)),
        None => Ok(()),
    }
}

fn check_frame(readings: &Readings, frame: Frame) -> Result<(), InputError> {
    if frame == Frame::Sensor && !readings.holds(Kind::Position) {
        let cause = "no row holds x, y or z, so there is no frame to find";
        return Err(InputError::new(&readings.name, cause).with_remedy("leave out --frame sensor"));
    }
    Ok(())
}

/// Every plane and point of the robot file must occur.
fn check_names(robot: &RobotFile, readings: &Readings) -> Result<(), InputError> {
    let planes = robot.instruments.planes.iter();
    let planes = planes.map(|plane| ("planes", &plane.name, plane.line, &readings.planes));
    let points = robot.instruments.points.iter();
    let points = points.map(|point| ("points", &point.name, point.line, &readings.points));
    for (section, name, line, names) in planes.chain(points) {
        if let Some(others) = Readings::unused(names, name) {
            let cause = format!("no row of {} uses this name; {others}", readings.name);
            return Err(InputError::new(&robot.name, cause)
                .at_line(line)
                .at_key(format!("[{section}.{name}]"))
                .with_remedy("give both files the same names, or delete the section"));
        }
    }
    Ok(())
}

fn reported(case: &Case<'_>, judged: Judged, diagnosis: Option<Diagnosis>) -> Report {
    let findings = findings(case, &judged, diagnosis);
    Report::new(case, judged, findings)
}

/// Everything there is to say, the gravest first.
fn findings(case: &Case<'_>, judged: &Judged, diagnosis: Option<Diagnosis>) -> Vec<Finding> {
    let mut found = Vec::new();
    found.extend(diagnosis.map(|diagnosis| Finding::Diagnosis { diagnosis }));
    of_rows(case, judged, &mut found);
    let step = happened(case, judged);
    found.extend(step.map(|step| Finding::Step { step }));
    // A step looks like a drift as well.
    let causes = judged.causes.found.iter();
    let causes = causes.filter(|cause| step.is_none() || cause.kind != CauseKind::Drift);
    found.extend(causes.map(|cause| Finding::Cause {
        cause: cause.clone(),
        cause_kind: cause.kind.name(),
    }));
    let hidden = judged
        .causes
        .hidden_drift
        .filter(|_| case.readings.holds(Kind::Position));
    found.extend(hidden.map(|up_to_mm| Finding::DriftHidden { up_to_mm }));
    of_errors(case, judged, &mut found);
    of_noise(case, judged, &mut found);
    of_parameters(case, judged, &mut found);
    found
}

/// What happened at one row, where the residuals show that something is wrong.
fn happened(case: &Case<'_>, judged: &Judged) -> Option<Step> {
    let drifts = judged
        .causes
        .found
        .iter()
        .any(|cause| cause.kind == CauseKind::Drift);
    let large = judged
        .noise
        .iter()
        .any(|test| test.verdict == NoiseVerdict::Understated);
    if !(drifts || large) {
        return None;
    }
    step(case).filter(|own| !drifts || own.is_no_drift())
}

fn of_rows(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    let (readings, solution) = (case.readings, &judged.solution);
    let lines = |which: &dyn Fn(usize) -> bool| -> Vec<u64> {
        let rows = readings.rows.iter().enumerate();
        rows.filter(|(index, _)| which(*index))
            .map(|(_, row)| row.line)
            .collect()
    };
    let shift = case.options.robust.then(|| Shift::find(solution, readings));
    let shift = shift.flatten();
    found.extend(shift.map(|shift| Finding::Shift { shift }));
    found.extend(beside_the_platform_point(
        case.robot,
        readings,
        case.options.frame,
    ));
    let suspected = lines(&|index| solution.rows[index].suspected);
    if !suspected.is_empty() {
        found.push(Finding::Suspected { lines: suspected });
    }
    let left_out = lines(&|index| solution.rows[index].left_out);
    if !left_out.is_empty() {
        found.push(Finding::LeftOut { lines: left_out });
    }
    let standardised = |index: usize| {
        let fit = &solution.rows[index];
        let each = fit.whitened.iter().zip(fit.leverage);
        each.map(|(residual, leverage)| residual.abs() / (1.0 - leverage).max(0.1).sqrt())
            .fold(0.0, f64::max)
    };
    for (index, row) in readings.rows.iter().enumerate() {
        let sigmas = standardised(index) / judged.widening;
        if sigmas > OUTLIER && !solution.rows[index].suspected {
            found.push(Finding::Outlier {
                line: row.line,
                sigmas,
            });
        }
    }
    if let Some(joined) = &readings.joined {
        found.push(Finding::Joined {
            joined: joined.clone(),
            rows: readings.rows.len(),
        });
    }
    if let Ok(Some(datum)) = Datum::of(case.robot, case.options.frame) {
        found.push(Finding::Datum {
            points: datum.residuals.len(),
            rms_mm: datum.rms(),
        });
    }
    if !readings.copies.is_empty() {
        found.push(Finding::Copies {
            lines: readings.copies.clone(),
        });
    }
    found.extend(repeatability(readings));
}

/// Of poses that were measured more than once: how the readings scatter.
fn repeatability(readings: &Readings) -> Vec<Finding> {
    let mut poses: BTreeMap<_, Vec<&Reading>> = BTreeMap::new();
    for row in &readings.rows {
        let from = match row.value.distance {
            Some((ReadingFrom::Point(point), _)) => (point + 1, [0; 3]),
            Some((ReadingFrom::Pose(joints), _)) => (0, joints.map(f64::to_bits)),
            None => (0, [0; 3]),
        };
        let plane = row.value.height.map(|(plane, _)| plane);
        let key = (row.value.joints.map(f64::to_bits), plane, from);
        poses.entry(key).or_default().push(&row.value);
    }
    let of = |kind: Kind| {
        let (mut squares, mut freedom) = (0.0, 0.0);
        for repeated in poses.values().filter(|own| own.len() > 1) {
            for place in (0..READINGS).filter(|place| Kind::of_place(*place) == kind) {
                let values: Vec<f64> = repeated
                    .iter()
                    .filter_map(|own| own.read()[place])
                    .collect();
                let count = values.iter().fold(0.0, |count, _| count + 1.0);
                let mean = values.iter().sum::<f64>() / count;
                squares += values.iter().map(|own| (own - mean).powi(2)).sum::<f64>();
                freedom += f64::max(count - 1.0, 0.0);
            }
        }
        (freedom > 0.0).then(|| Finding::Repeatability {
            of: kind,
            sigma_mm: f64::sqrt(squares / freedom),
            degrees_of_freedom: freedom,
        })
    };
    Kind::ALL.into_iter().filter_map(of).collect()
}

fn of_errors(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    let (Some(before), Some(after)) = (&judged.error_before, &judged.error_after) else {
        return;
    };
    let not_improved = !(after.rms < before.rms);
    if not_improved && !judged.workspace.is_some_and(|own| own.unchanged()) {
        found.push(Finding::NotImproved {
            before_mm: before.rms,
            after_mm: after.rms,
        });
    }
    let unreachable = |error: &PositionError, calibrated| {
        (error.unreachable > 0).then_some(Finding::Unreachable {
            calibrated,
            samples: error.unreachable,
        })
    };
    found.extend(unreachable(before, false));
    found.extend(unreachable(after, true));
    let poses = case.readings.rows.iter().map(|row| row.value.joints);
    if before.contradicts(case.before, poses) {
        found.push(Finding::Elsewhere {
            median_mm: before.median,
        });
    }
}

fn of_noise(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    for test in &judged.noise {
        match test.verdict {
            NoiseVerdict::Understated => {
                found.push(Finding::NoiseUnderstated {
                    test: *test,
                    widened_by: judged.widening,
                });
            }
            NoiseVerdict::Overstated => found.push(Finding::NoiseOverstated { test: *test }),
            NoiseVerdict::Agrees | NoiseVerdict::Estimated => {}
        }
    }
    if judged.solution.joint_noise_estimated {
        let drive = case.robot.robot.drive();
        let noise = judged.solution.levels.position;
        found.push(Finding::JointNoise {
            position_mm: noise.position(),
            joint: joint::in_file(drive, noise.joint()),
            key: joint::key("joint", drive),
        });
    }
    let position = judged
        .noise
        .iter()
        .find(|test| test.kind == Kind::Position && test.stated_mm.is_none());
    let joints = case.readings.rows.iter().map(|row| row.value.joints);
    if let Some(test) = position
        && let Some(tolerated_mm) =
            crate::accuracy::position_error::sigma_by_tolerance(case.before, joints)
        && test.sigma_mm > LITTLE * tolerated_mm
    {
        found.push(Finding::SaysLittle {
            sigma_mm: test.sigma_mm,
            tolerated_mm,
        });
    }
}

fn of_parameters(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    let (robot, solution, readings) = (case.robot, &judged.solution, case.readings);
    let drive = robot.robot.drive();
    if let Some(test) = judged.prior_test.filter(PriorTest::contradicts) {
        let used = judged
            .widened
            .then(|| test.statement(drive, robot.tolerance.as_ref()));
        found.push(Finding::ToleranceTooSmall { test, used });
    }
    if let Some(workspace) = &judged.workspace {
        if workspace.unchanged() {
            found.push(Finding::Unchanged);
        } else if workspace.may_be_worse() {
            let chance = workspace.chance_of_harm.unwrap_or(1.0);
            found.push(Finding::MayBeWorse {
                chance,
                moved: workspace.judged,
            });
        }
    }
    if robot.tolerance.is_none() {
        if let Some(changes) = doubtful(&robot.robot, &solution.robot) {
            found.push(Finding::LargeChanges { changes });
        }
        if readings.rows.len() < FEW_SAMPLES {
            found.push(Finding::FewSamples {
                samples: readings.rows.len(),
                needed: FEW_SAMPLES,
            });
        }
        if case.options.frame == Frame::Sensor {
            found.push(Finding::NoPlace);
        }
    } else {
        if readings.is_complete() {
            found.extend(by_tolerance(robot, &solution.prior_share));
        }
        let known = &judged.known;
        if !known.place {
            found.push(Finding::PlaceUnknown);
        }
        if !known.scale {
            found.push(Finding::ScaleUnknown {
                distances: readings.holds(Kind::Distance),
            });
        }
        if known.combinations < known.of {
            found.push(Finding::Combinations {
                determined: known.combinations,
                of: known.of,
                readings: readings.readings(),
            });
        }
    }
    for (arm, condition) in (1..).zip(solution.conditions) {
        if condition > GOOD_CONDITION && readings.is_complete() {
            found.push(Finding::Condition { arm, condition });
        }
    }
    match solution.start {
        StartUsed::Nominal => {}
        StartUsed::Free => found.push(Finding::FarStart),
        StartUsed::Search => found.push(Finding::SeveralSolutions),
    }
    if robot.sensor_frame.is_some() {
        found.push(Finding::SensorFrameIgnored);
    }
}

fn by_tolerance(robot: &RobotFile, shares: &[f64; 24]) -> Vec<Finding> {
    let places = robot.robot.drive().places();
    let in_polar_form = robot
        .tolerance
        .is_some_and(|own| own.joint_zero().is_some());
    let name = |parameter: Parameter| match parameter {
        Parameter::LaX if in_polar_form => "upper arm",
        Parameter::LaY if in_polar_form => "joint zero",
        _ => parameter.symbol(),
    };
    let of_arm = |(arm, shares): (usize, &[f64])| {
        let parameters: Vec<_> = places
            .iter()
            .zip(shares)
            .filter(|(_, share)| **share > MOSTLY)
            .filter_map(|(parameter, share)| Some((name((*parameter)?), *share)))
            .collect();
        (!parameters.is_empty()).then_some(Finding::ByTolerance { arm, parameters })
    };
    (1..).zip(shares.chunks(8)).filter_map(of_arm).collect()
}
