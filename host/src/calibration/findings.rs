//! Findings of a calibration beside its figures: a sentence each, with the figures that it is based on.

use super::tilt::of_rods;
use crate::accuracy::position_error::{BeforeAfter, PositionError, sigma_by_tolerance};
use crate::accuracy::repeats;
use crate::effects::{EffectKind, misplaced};
use crate::explain::{Diagnosis, beside_the_platform_point, shifted_rows};
use crate::files::{Kind, ONLY_TARGET, Reading, Readings, RobotFile, Row};
use crate::finding::{Finding, note, warning};
use crate::fit::datum::{CONTRADICTED, Datum};
use crate::fit::solution::RowFit;
use crate::fit::{Case, Frame};
use crate::judge::Judged;
use crate::judge::credibility::{NoiseVerdict, doubtful};
use crate::judge::known::Known;
use crate::text::{capitalised, count, in_lines, joint, probability, significant};
use delta_cal::Parameter;
use delta_cal::calibration::Start;
use serde_json::json;

/// Above this share, a parameter comes mostly from the tolerance.
const MOSTLY: f64 = 0.5;
/// Without a tolerance, fewer samples than this may allow several solutions.
const FEW_SAMPLES: usize = 12;
/// Below this, a condition number is good. Above, the parameters are known a hundred times worse than each would be
/// alone.
const GOOD_CONDITION: f64 = 100.0;
/// Standardised residual, in σ, above which a reading is an outlier.
const OUTLIER: f64 = 4.5;
/// Residuals above this fraction of what the tolerance allows leave little to the samples.
const LITTLE: f64 = 0.5;
/// Above this fraction of the stated noise, residuals suggest that 2 σ was stated instead of σ.
const HALF: f64 = 0.4;

/// A part of a statement's variance below which the readings say nothing about it.
const LEAST_SHOWN: f64 = 0.01;

/// Formats to two significant digits.
fn mm(value: f64) -> String {
    significant(value, 2)
}

/// All findings, most severe first.
pub(crate) fn findings(
    case: &Case<'_>,
    judged: &Judged,
    known: &Known,
    diagnosis: Option<&Diagnosis>,
) -> Vec<Finding> {
    let mut found = Vec::new();
    let explained = diagnosis.map(|own| format!("{own}. {}", own.advice()));
    found.extend(explained.map(|text| warning("diagnosis", json!({}), text)));
    let shifted = shifted_rows(&judged.solution);
    found.extend(shifted.clone());
    of_rows(case, judged, &mut found);
    of_files(case, &mut found);
    let kinds = Kind::ALL.into_iter();
    found.extend(kinds.filter_map(|kind| repeatability(case.readings, kind)));
    let causes = judged.causes.found.iter().filter(|_| shifted.is_none());
    for cause in causes {
        let [what, remedy] = [&cause.text, &cause.remedy].map(|own| capitalised(own));
        let text = match cause.kind {
            EffectKind::Size => {
                format!(
                    "{what}. The readings cannot tell which; the stated errors hold both. {remedy}."
                )
            }
            _ => format!(
                "{what}. The model cannot represent this error, so the parameters are biased. {remedy}."
            ),
        };
        found.push(warning(
            "cause",
            json!({ "cause_kind": cause.kind, "line": cause.line }),
            text,
        ));
    }
    let hidden = judged.causes.hidden_drift;
    if let Some(up_to) = hidden.filter(|_| case.readings.holds(Kind::Position)) {
        let text = format!(
            "In this order of the rows, up to {} mm of drift from the first row to the last would look like errors of the \
             robot. Measure in random order, and the first pose once more at the end.",
            mm(up_to)
        );
        found.push(note("drift_hidden", json!({ "up_to_mm": up_to }), text));
    }
    of_stated(case, judged, &mut found);
    of_rods(case, judged, &mut found);
    of_errors(case, judged, &mut found);
    of_noise(case, judged, &mut found);
    of_parameters(case, judged, known, &mut found);
    found
}

/// The lines of the chosen rows.
fn lines(case: &Case<'_>, judged: &Judged, chosen: fn(&RowFit) -> bool) -> Vec<u64> {
    let rows = case.readings.rows.iter().zip(&judged.solution.rows);
    let chosen = rows.filter(|(_, fit)| chosen(fit));
    chosen.map(|(row, _)| row.line).collect()
}

/// Findings about single rows.
fn of_rows(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    found.extend(beside_the_platform_point(case));
    let suspected = lines(case, judged, |fit| fit.suspected);
    if !suspected.is_empty() {
        let text = format!(
            "Left out because of disagreement with the others: {}. Measure again.",
            in_lines(&suspected)
        );
        found.push(warning("suspected", json!({ "lines": suspected }), text));
    }
    let left_out = lines(case, judged, |fit| fit.left_out);
    if !left_out.is_empty() {
        let text = format!(
            "The robot does not reach the joint angles in {}; excluded.",
            in_lines(&left_out)
        );
        found.push(warning("left_out", json!({ "lines": left_out }), text));
    }
    let rows = case.readings.rows.iter().zip(&judged.solution.rows);
    for (row, fit) in rows.filter(|(_, fit)| !fit.suspected) {
        let each = fit.whitened.iter().zip(fit.leverage);
        let standardised = each
            .map(|(residual, leverage)| residual.abs() / (1.0 - leverage).max(0.1).sqrt())
            .fold(0.0, f64::max);
        let sigmas = standardised / judged.widening;
        if sigmas > OUTLIER {
            let text = format!(
                "Line {}: residual {sigmas:.1} σ, much larger than the others. Measure it again.",
                row.line
            );
            let figures = json!({ "line": row.line, "sigmas": sigmas });
            found.push(warning("outlier", figures, text));
        }
    }
}

/// Findings about the content of the files.
fn of_files(case: &Case<'_>, found: &mut Vec<Finding>) {
    let readings = case.readings;
    if let Some(joined) = &readings.joined {
        let by = match &joined.by {
            Some(column) => format!("by {column}"),
            None => "in the order of the rows".to_owned(),
        };
        let unused = match joined.unused {
            0 => String::new(),
            all => format!("; nothing was measured at {} of joints", count(all, "row")),
        };
        let ignored = match joined.ignored.as_slice() {
            [] => String::new(),
            columns => format!(" Columns not used: {}.", columns.join(", ")),
        };
        let text = format!(
            "{} matched with the joints of {} {by}{unused}.{ignored}",
            count(readings.rows.len(), "row"),
            joined.joints_file
        );
        let figures = json!({
            "joints_file": joined.joints_file,
            "by": joined.by,
            "unused": joined.unused,
            "ignored": joined.ignored,
            "rows": readings.rows.len(),
        });
        found.push(note("joined", figures, text));
    }
    let of_others = |row: &&Row<Reading>| row.value.kind() == Some(Kind::Position);
    let rows = readings.rows.iter().filter(of_others);
    let (whole, part): (Vec<&Row<_>>, Vec<_>) = rows.partition(|row| row.value.sample().is_some());
    if !whole.is_empty() && !part.is_empty() {
        let lines: Vec<_> = part.iter().map(|row| row.line).collect();
        let text = format!(
            "Blank cells of x, y and z count as not measured: {}.",
            in_lines(&lines)
        );
        found.push(note("blanks", json!({ "lines": lines }), text));
    }
    if let Ok(Some(datum)) = Datum::of(case.robot, case.options.frame) {
        let (points, rms) = (datum.residuals.len(), datum.rms());
        let text = format!(
            "The sensor frame is that of {} of [datum], which fit to {} mm: the result is absolute in the machine's frame.",
            count(points, "point"),
            mm(rms)
        );
        let figures = json!({ "points": points, "rms_mm": rms });
        found.push(note("datum", figures, text));
    }
    let lines = &readings.copies;
    if !lines.is_empty() {
        let text = format!(
            "Equal to an earlier row to the last digit, so counted as one measurement: {}.",
            in_lines(lines)
        );
        found.push(note("copies", json!({ "lines": lines }), text));
    }
}

fn repeatability(readings: &Readings, kind: Kind) -> Option<Finding> {
    let (sigma, freedom) = repeats::of_kind(readings, kind)?;
    let text = format!(
        "Repeatability of {}: {} mm (σ, {}).",
        kind.plural(),
        mm(sigma),
        crate::text::freedom(freedom)
    );
    let figures = json!({ "of": kind, "sigma_mm": sigma, "degrees_of_freedom": freedom });
    Some(note("repeatability", figures, text))
}

/// Stated places of targets and datum points, and a stated scale, that the readings contradict.
fn of_stated(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    let solution = &judged.solution;
    for own in &solution.effects {
        let each = own
            .places()
            .zip(own.by.iter().zip(&own.mean))
            .zip(&own.sigma);
        let sigmas = each.filter_map(|((place, (by, mean)), sigma)| {
            // What the estimate differs by is spread by what the readings add to the statement.
            let left = sigma * sigma - solution.covariance[(place, place)];
            let shown = sigma.is_finite() && left > LEAST_SHOWN * sigma * sigma;
            shown.then(|| (by - mean).abs() / left.sqrt())
        });
        let sigmas = sigmas.fold(0.0, f64::max) / judged.widening.max(1.0);
        // Nobody states a printer's; its report has its own words.
        let of_printer = case.options.of_printer && own.effect.kind == EffectKind::Tilt;
        if of_printer || !(sigmas > CONTRADICTED) {
            continue;
        }
        let figures = json!({ "of": own.effect.kind, "sigmas": sigmas });
        let text = match own.effect.kind {
            EffectKind::Target => {
                let name = case.readings.targets.get(own.effect.index);
                let name = name.map_or(ONLY_TARGET, String::as_str);
                let off = misplaced(case.robot, name, &own.by).unwrap_or_default();
                format!("{off} ({sigmas:.0} σ). Check the target's place and the robot file.")
            }
            EffectKind::Tilt => format!(
                "The rods of an arm differ by {sigmas:.0} σ of what parallelogram_mm and parallelogram_deg state. Check \
                 the rods, and the targets' places."
            ),
            kind => format!(
                "{}: fitted {} from what is stated ({sigmas:.0} σ). Measure a known length with the same instrument.",
                kind.name(),
                significant(own.by[0] - own.mean[0], 2)
            ),
        };
        found.push(warning("stated", figures, text));
    }
    let noise = solution.levels.position.position();
    if let (Ok(Some(datum)), Some(frame)) = (
        Datum::of(case.robot, case.options.frame),
        solution.places.frame,
    ) {
        let scale = solution.effect(EffectKind::Scale);
        let scale = scale.map_or(0.0, |own| own.by[0]);
        for (point, off, sigmas) in datum.contradicted(&frame, (noise, scale)) {
            let text = format!(
                "Datum {} is {} mm off: {sigmas:.0} σ. Measure it again.",
                point.name,
                mm(off)
            );
            let figures =
                json!({ "of": "datum", "point": point.name, "off_mm": off, "sigmas": sigmas });
            found.push(warning("stated", figures, text));
        }
    }
}

fn of_errors(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    let Some(BeforeAfter { before, after }) = &judged.errors else {
        return;
    };
    let not_improved = !(after.rms < before.rms);
    if not_improved && !judged.workspace.is_some_and(|own| own.unchanged()) {
        let text = format!(
            "The position error over the samples did not improve: {:.4} mm before, {:.4} mm after.",
            before.rms, after.rms
        );
        let figures = json!({ "before_mm": before.rms, "after_mm": after.rms });
        found.push(warning("not_improved", figures, text));
    }
    let unreachable = |error: &PositionError, calibrated: bool| {
        let text = format!(
            "The {} robot cannot reach the joint angles of {}; position errors exclude them.",
            if calibrated { "calibrated" } else { "nominal" },
            count(error.unreachable, "sample")
        );
        let figures = json!({ "calibrated": calibrated, "samples": error.unreachable });
        (error.unreachable > 0).then(|| warning("unreachable", figures, text))
    };
    found.extend(unreachable(before, false));
    found.extend(unreachable(after, true));
    let poses = case.readings.rows.iter().map(|row| row.value.joints);
    if before.contradicts(case.before, poses) {
        let median = before.median;
        let text = format!(
            "Half of the measured points were more than {median:.0} mm from where the robot file puts them. Check \
             units, joint order and frame (--frame sensor)."
        );
        found.push(warning("elsewhere", json!({ "median_mm": median }), text));
    }
}

fn of_noise(case: &Case<'_>, judged: &Judged, found: &mut Vec<Finding>) {
    for test in &judged.noise {
        let (of, key, ratio) = (test.kind.plural(), test.kind.key(), test.ratio);
        let (sigma, [low, high]) = (mm(test.sigma_mm), test.limits_mm.map(mm));
        match test.verdict {
            NoiseVerdict::Understated => {
                let widened_by = judged.widening;
                let text = format!(
                    "Residuals of {of} are {ratio:.1} × the stated noise ({sigma} mm, 95 % CI {low}–{high}). The readings' part of \
                     every σ is multiplied by {widened_by:.1}. Look for outliers and play; if there are none, set {key} = {sigma}."
                );
                let figures = json!({ "test": test, "widened_by": widened_by });
                found.push(warning("noise_understated", figures, text));
            }
            NoiseVerdict::Overstated => {
                let half = if ratio > HALF {
                    "Was it stated as 2 σ? "
                } else {
                    ""
                };
                let drive = case.robot.robot.drive();
                let joints = joint::key("joint", drive);
                let text = match test.joint_shown {
                    Some(shown) => format!(
                        "Residuals of {of} are only {ratio:.2} × the stated noise, because {joints} is too large. Set \
                         {joints} = {}.",
                        mm(joint::in_file(drive, shown))
                    ),
                    None => format!(
                        "Residuals of {of} are only {ratio:.2} × the stated noise ({sigma} mm). {half}If these rows were \
                         measured and not computed, set {key} = {sigma}."
                    ),
                };
                found.push(warning("noise_overstated", json!({ "test": test }), text));
            }
            NoiseVerdict::Agrees | NoiseVerdict::Estimated => {}
        }
    }
    if judged.solution.joint_noise_estimated {
        let drive = case.robot.robot.drive();
        let noise = judged.solution.levels.position;
        let own = joint::in_file(drive, noise.joint());
        let key = joint::key("joint", drive);
        let text = format!(
            "Estimated noise includes the joints: position_mm = {}, {key} = {}.",
            mm(noise.position()),
            mm(own)
        );
        let figures = json!({ "position_mm": noise.position(), "joint": own, "key": key });
        found.push(note("joint_noise", figures, text));
    }
    let mut noise = judged.noise.iter();
    let position = noise.find(|test| test.kind == Kind::Position && test.stated_mm.is_none());
    let joints = case.readings.rows.iter().map(|row| row.value.joints);
    if let Some(test) = position
        && let Some(tolerated) = sigma_by_tolerance(case.before, joints)
        && test.sigma_mm > LITTLE * tolerated
    {
        let text = format!(
            "Residuals ({} mm) are nearly as large as the tolerance allows ({} mm), so the samples have little weight. \
             Look for wrong samples, or state the [noise].",
            mm(test.sigma_mm),
            mm(tolerated)
        );
        let figures = json!({ "sigma_mm": test.sigma_mm, "tolerated_mm": tolerated });
        found.push(warning("says_little", figures, text));
    }
}

fn of_parameters(case: &Case<'_>, judged: &Judged, known: &Known, found: &mut Vec<Finding>) {
    let (robot, solution, readings) = (case.robot, &judged.solution, case.readings);
    let none = json!({});
    if let Some(own) = judged.tolerance.filter(|own| own.test.contradicts()) {
        let test = own.test;
        let tolerance = robot.tolerance.as_ref().filter(|_| own.widened);
        let used = tolerance.map(|own| test.statement(robot.robot.drive(), own));
        let calibrated = used.as_ref().map_or_else(String::new, |used| {
            format!(
                " Calibrated with {used}. Check the robot file and the frame; if the robot is that far off, state that."
            )
        });
        let text = format!(
            "The robot is {:.1} × farther from nominal than the [tolerance] allows ({} of {} combinations, probability {}).{calibrated}",
            test.ratio,
            test.combinations,
            test.of,
            probability(test.probability)
        );
        let figures = json!({ "test": test, "used": used });
        found.push(warning("tolerance_too_small", figures, text));
    }
    if let Some(explained) = &judged.explained {
        found.push(warning("explained", none.clone(), explained.clone()));
    }
    if let Some(workspace) = &judged.workspace {
        let (chance, moved) = (workspace.chance_of_harm.unwrap_or(1.0), workspace.judged);
        if workspace.unchanged() {
            let text =
                "The samples do not change the robot: it is already as accurate as they can show.";
            found.push(warning("unchanged", none.clone(), text));
        } else if workspace.may_be_worse() {
            let text = format!(
                "{} chance of making the robot worse: positions move {} mm but are known only to {} mm.",
                probability(chance),
                mm(moved.change),
                mm(moved.sigma)
            );
            let figures =
                json!({ "chance": chance, "change_mm": moved.change, "sigma_mm": moved.sigma });
            found.push(warning("may_be_worse", figures, text));
        }
    }
    if robot.tolerance.is_some() {
        if readings.is_complete() {
            found.extend(by_tolerance(robot, &solution.prior_share));
        }
        of_determined(known, readings, found);
    } else {
        if let Some(changes) = doubtful(robot, &solution.robot) {
            let text = format!(
                "The calibrated robot differs much from the robot file: {changes}. Check units, signs and frame of the samples."
            );
            let figures = json!({ "changes": changes });
            found.push(warning("large_changes", figures, text));
        }
        let samples = readings.rows.len();
        if samples < FEW_SAMPLES {
            let text = format!(
                "{} may have several solutions without a [tolerance]. Measure {FEW_SAMPLES} or more, or state the tolerance.",
                count(samples, "sample")
            );
            let figures = json!({ "samples": samples, "needed": FEW_SAMPLES });
            found.push(warning("few_samples", figures, text));
        }
        if case.options.frame == Frame::Sensor {
            let text = "No [tolerance] is stated: relative accuracy is measured, the place of the base in the sensor \
                        frame is not.";
            found.push(warning("no_place", none.clone(), text));
        }
    }
    for (arm, condition) in (1..).zip(solution.conditions) {
        if condition > GOOD_CONDITION && readings.is_complete() && solution.is_absolute() {
            let text = format!(
                "Arm {arm} is poorly determined (condition {condition:.0}). Spread the poses over the whole workspace."
            );
            let figures = json!({ "arm": arm, "condition": condition });
            found.push(warning("condition", figures, text));
        }
    }
    if solution.start == Start::Search {
        let text = "Several solutions fit the samples; this one fits best or is nearest to the robot file.";
        found.push(note("several_solutions", none.clone(), text));
    }
    if robot.sensor_frame.is_some() {
        let text =
            "[sensor_frame] of the robot file is not used; --frame sensor finds the frame again.";
        found.push(note("sensor_frame_ignored", none, text));
    }
}

/// What the tolerance decided overall.
fn of_determined(known: &Known, readings: &Readings, found: &mut Vec<Finding>) {
    if !known.place {
        let text = if readings.holds(Kind::Position) {
            "The place of the robot's base (six numbers) comes from the tolerance. If absolute positions matter, state \
             three [datum] points that the sensor measures too."
        } else {
            "The place of the robot's base (six numbers) comes from the tolerance. If absolute positions matter, measure \
             x, y and z of three poses."
        };
        found.push(note("place_unknown", json!({}), text));
    }
    if !known.scale {
        let distances = readings.holds(Kind::Distance);
        let text = if distances {
            "The scale comes from the tolerance: the distances are too few or too inexact. Measure more or longer ones."
        } else if readings.holds(Kind::Position) {
            "The scale comes from the tolerance: the coordinates do not determine it. Measure one known length with the \
             same instrument."
        } else {
            "The scale comes from the tolerance: touches of planes cannot show it. Measure one known length: a gauge block \
             (height_mm) or a distance between two poses."
        };
        let figures = json!({ "distances": distances });
        found.push(note("scale_unknown", figures, text));
    }
    let (determined, of, all) = (known.combinations, known.of, readings.readings());
    if determined < of {
        let text = format!(
            "The {all} readings improve {determined} of {of} parameter combinations; the rest stay at the tolerance."
        );
        let figures = json!({ "determined": determined, "of": of, "readings": all });
        found.push(note("combinations", figures, text));
    }
}

/// The parameters of each arm that the tolerance decided.
fn by_tolerance(robot: &RobotFile, shares: &[f64; 24]) -> Vec<Finding> {
    let places = robot.robot.drive().places();
    let tolerance = robot.tolerance;
    let in_polar_form = tolerance.is_some_and(|own| own.joint_zero().is_some());
    let name = |parameter: Parameter| match parameter {
        Parameter::LaX if in_polar_form => "upper arm",
        Parameter::LaY if in_polar_form => "joint zero",
        _ => parameter.symbol(),
    };
    let of_arm = |(arm, shares): (usize, &[f64])| {
        let all = places.iter().zip(shares);
        let all = all.filter_map(|(parameter, share)| Some((name((*parameter)?), *share)));
        let parameters: Vec<_> = all.filter(|(_, share)| *share > MOSTLY).collect();
        let named = parameters.iter();
        let named = named.map(|(symbol, share)| format!("{symbol} ({:.0} %)", 100.0 * share));
        let named: Vec<_> = named.collect();
        let text = format!(
            "Arm {arm}: mostly decided by the tolerance: {}.",
            named.join(", ")
        );
        let figures = json!({ "arm": arm, "parameters": parameters });
        (!named.is_empty()).then(|| note("by_tolerance", figures, text))
    };
    (1..).zip(shares.chunks(8)).filter_map(of_arm).collect()
}
