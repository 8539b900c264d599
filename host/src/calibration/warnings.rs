//! What is doubtful about a calibration that was not refused.

use crate::calibration::plausibility::doubtful;
use crate::calibration::report::CalibrationReport;
use crate::calibration::target::beside_the_platform_point;
use crate::calibration::thresholds::{FEW_SAMPLES, GOOD_CONDITION, MOSTLY};
use crate::fit::options::Frame;
use crate::text::joint;
use crate::text::numbers::significant;
use crate::text::words::{count, in_lines_of};
use delta_cal::ArmIndex;
use delta_cal::calibration::{ArmOutcome, StartUsed};

/// A σ that is larger by less is not spoken of.
const NOTABLE: f64 = 1.1;

/// Every doubt, the gravest first.
pub(crate) fn warnings(report: &CalibrationReport) -> Vec<String> {
    let mut found = Vec::new();
    found.extend(report.shift.map(|shift| shift.to_string()));
    let measured = report.sample_errors.iter().map(|sample| &sample.measured);
    found.extend(beside_the_platform_point(
        &report.before,
        report.options.frame,
        measured,
    ));
    suspected_samples(report, &mut found);
    causes(report, &mut found);
    position_error(report, &mut found);
    large_changes(report, &mut found);
    few_samples(report, &mut found);
    residual_warnings(report, &mut found);
    for (arm, outcome) in ArmIndex::ALL.into_iter().zip(&report.outcome.fit.arms) {
        arm_warnings(report, arm, outcome, &mut found);
    }
    if let Some(test) = &report.prior_test
        && test.contradicts()
    {
        let so = if report.tolerance_widened {
            format!(
                ", so the result was computed with {:.1} times the stated tolerance",
                test.ratio
            )
        } else {
            String::new()
        };
        let frame = match report.options.frame {
            Frame::Base => "; if the samples' frame is not exactly the robot's, use --frame sensor",
            Frame::Sensor => "",
        };
        found.push(format!(
            "{}. The samples determine all parameters better than the tolerance does{so}. Check the \
             robot file{frame}; if the robot really is that far off, {}",
            test.found(),
            test.statement(report.before.robot.drive(), report.before.tolerance.as_ref())
        ));
    }
    if let Some(comparison) = &report.workspace
        && comparison.may_be_worse()
        && report.before.tolerance.is_some()
    {
        found.push(format!(
            "the samples add little to the robot file: the calibration moves the positions{} by \
             {:.3} mm (rms over the workspace), and the new positions are themselves uncertain by \
             {:.3} mm. With a probability of {} % the robot becomes worse",
            report.options.frame.relative(),
            comparison.judged.change,
            comparison.judged.sigma,
            significant(100.0 * comparison.chance_of_harm.unwrap_or(1.0), 2)
        ));
    }
    if report.before.noise.is_none() && report.causes.uneven_noise > NOTABLE {
        found.push(format!(
            "no [noise] is stated, and the residuals are larger where errors of the joints count more: every sigma was \
             multiplied by {:.2}. State position_mm and {} in [noise]: the samples are then weighed by them, and the \
             result is better too",
            report.causes.uneven_noise,
            joint::key("joint", report.before.robot.drive())
        ));
    }
    if let Some(comparison) = &report.workspace
        && comparison.unchanged()
    {
        found.push(
            "the samples do not change the robot: it was calibrated with them before, or it is as \
             accurate as they can show"
                .to_owned(),
        );
    }
    if report.before.sensor_frame.is_some() {
        found.push(match report.options.frame {
            Frame::Base => "the robot file's [sensor_frame] was not used: without --frame sensor \
                            the positions are taken to be in the robot's frame"
                .to_owned(),
            Frame::Sensor => {
                "the robot file's [sensor_frame] was not used: the program found the frame again"
                    .to_owned()
            }
        });
    }
    found
}

fn suspected_samples(report: &CalibrationReport, found: &mut Vec<String>) {
    let lines: Vec<_> = report.suspected().map(|sample| sample.line).collect();
    if !lines.is_empty() {
        let they = if lines.len() == 1 {
            "it disagrees"
        } else {
            "they disagree"
        };
        found.push(format!(
            "the fit left out {}, because {they} with the others: {}",
            count(report.suspected_count(), "sample"),
            in_lines_of(&lines, report.suspected_count())
        ));
    }
}

fn causes(report: &CalibrationReport, found: &mut Vec<String>) {
    for cause in &report.causes.found {
        found.push(format!(
            "{cause}. The parameters do not hold such an error; it spoils them as well: {}",
            cause.remedy()
        ));
    }
}

fn position_error(report: &CalibrationReport, found: &mut Vec<String>) {
    let (before, after) = (&report.error_before, &report.error_after);
    if !(after.rms < before.rms) {
        found.push(format!(
            "the position error over the samples did not improve: {:.4} mm before, {:.4} mm after",
            before.rms, after.rms
        ));
    }
    for (error, which) in [(before, "original"), (after, "calibrated")] {
        if error.unreachable > 0 {
            found.push(format!(
                "the {which} geometry cannot reach the joint angles of {} of {}; its \
                 position error leaves them out",
                error.unreachable,
                count(report.samples, "sample")
            ));
        }
    }
    // Below twelve samples the fit gets arbitrarily near to some of them.
    if report.samples >= FEW_SAMPLES
        && let Some(outlier) = after.outlier()
    {
        found.push(format!(
            "after the calibration, {outlier}: it may be an outlier"
        ));
    }
    let poses = report.sample_errors.iter();
    let poses = poses.map(|sample| sample.measured.joints);
    if !report.options.no_guess && before.contradicts(&report.before, poses) {
        let hint = match report.options.frame {
            Frame::Base => "they may be in the sensor's frame (--frame sensor) or in another unit",
            Frame::Sensor => "check the units and the order of the joints",
        };
        found.push(format!(
            "half of the measured points were more than {:.0} mm from where the robot of the file \
             would be: {hint}",
            before.median
        ));
    }
}

fn large_changes(report: &CalibrationReport, found: &mut Vec<String>) {
    if report.before.tolerance.is_none()
        && !report.options.no_guess
        && let Some(changes) = doubtful(&report.before.robot, &report.after.robot)
    {
        found.push(format!(
            "the calibrated robot differs much from the robot file. Either it was assembled with \
             these errors, or the units, the signs or the frame of the samples are wrong: \
             {changes}"
        ));
    }
}

fn few_samples(report: &CalibrationReport, found: &mut Vec<String>) {
    let samples = report.samples;
    if report.before.tolerance.is_some() {
        if samples < 8 {
            found.push(format!(
                "{} cannot determine the 8 parameters of an arm: the tolerance decided the rest",
                count(samples, "sample")
            ));
        }
    } else if samples < FEW_SAMPLES {
        found.push(format!(
            "{} are few: {FEW_SAMPLES} or more exclude a wrong solution that fits as well, and 20 \
             or more average the noise",
            count(samples, "sample")
        ));
    }
    let frame_taken_for_granted =
        report.options.frame == Frame::Sensor && report.options.method.separates_arms();
    if frame_taken_for_granted && samples < FEW_SAMPLES {
        found.push(format!(
            "the sigmas do not contain the uncertainty of the sensor's frame, which has six more \
             unknowns; with only {} that matters",
            count(samples, "sample")
        ));
    }
    if report.distinct_poses < samples {
        found.push(format!(
            "{} at {}: measuring a pose again averages the noise, but adds nothing about the \
             geometry",
            count(samples, "sample"),
            count(report.distinct_poses, "distinct pose")
        ));
    }
    if report
        .outcome
        .fit
        .arms
        .iter()
        .any(|arm| arm.covariance.is_none())
    {
        found.push(
            "the sigma of the parameters is not known, because too few samples are left over to \
             estimate the noise. Measure more poses or state the [noise]"
                .to_owned(),
        );
    }
}

/// The residuals against the stated noise.
fn residual_warnings(report: &CalibrationReport, found: &mut Vec<String>) {
    if let (Some(noise), Some(test)) = (&report.before.noise, &report.noise_test) {
        found.extend(test.doubt(
            report.before.robot.drive(),
            noise,
            report.before.tolerance.is_some(),
            !report.causes.found.is_empty(),
        ));
    }
    if let Some(test) = &report.noise_test {
        found.extend(test.says_little());
    }
}

fn arm_warnings(
    report: &CalibrationReport,
    arm: ArmIndex,
    outcome: &ArmOutcome<f64>,
    found: &mut Vec<String>,
) {
    let parameters = outcome.arm.drive().parameters().iter();
    let decided: Vec<_> = parameters
        .map(|parameter| (parameter, outcome.prior_share[parameter.index()]))
        .filter(|(_, share)| *share > MOSTLY)
        .map(|(parameter, share)| format!("{parameter} ({:.0} %)", 100.0 * share))
        .collect();
    if !decided.is_empty() {
        found.push(format!(
            "{arm}: the tolerance decided these parameters more than the samples did: {}",
            decided.join(", ")
        ));
    }
    if outcome.condition > GOOD_CONDITION {
        found.push(format!(
            "{arm}: the poses determine the parameters badly (condition {:.0}): spread them over \
             the whole workspace",
            outcome.condition
        ));
    }
    match outcome.start {
        StartUsed::Nominal => {}
        StartUsed::Free if report.options.no_guess => {}
        StartUsed::Free => found.push(format!(
            "{arm}: the fit that started from the robot file did not find the solution, but the \
             fit without a start value did. The geometry of the robot file is far off, or some rows are wrong, or the \
             robot has an error that the model does not hold"
        )),
        StartUsed::Joint => found.push(format!(
            "{arm}: the fit that started from the robot file did not find the best solution, but \
             the fit that started from the result of the joint method did"
        )),
        StartUsed::Search => found.push(format!(
            "{arm}: several solutions fit the samples. This is the one that fits best or, of \
             equally good ones, the one nearest to the robot file"
        )),
    }
}
