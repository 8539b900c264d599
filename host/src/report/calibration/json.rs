//! The report for programs. Lengths in millimetres, angles in degrees; `null` where a figure is
//! unknown.

mod diagnosis;
mod noise;

use super::comparison::{Comparison, comparisons, of_an_arm};
use super::expanded;
use super::names::{solver_name, start_name, termination_name};
use super::suspected::{self, loss_name};
use crate::accuracy::distribution::Sampled;
use crate::accuracy::expected_error::ExpectedError;
use crate::accuracy::position_error::PositionError;
use crate::accuracy::sampled::Histogram;
use crate::accuracy::uncertainty_map::{Plane, Slice, UncertaintyMap};
use crate::calibration::error::CalibrateError;
use crate::calibration::report::CalibrationReport;
use crate::fit::options::Frame;
use crate::render::json;
use crate::report::document::{About, Document};
use crate::text::units::degrees;
use delta_cal::calibration::ArmOutcome;
use serde_json::{Value, json};

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The report of a calibration.
pub fn report(report: &CalibrationReport, about: &About) -> Value {
    let suspected = suspected::rows(report).into_iter();
    let suspected = suspected.filter(|sample| sample.weight.suspected);
    let suspected = suspected.map(|sample| {
        json!({
            "line": sample.line,
            // These three as `error_after_sigma`, `error_after_mm` and `weight` of the sample.
            "residual_sigma": sample.after_in_sigmas,
            "residual_mm": sample.after,
            "weight": sample.weight.weight,
        })
    });
    let samples = report.sample_errors.iter().map(|sample| {
        json!({
            "line": sample.line,
            // `null` if the parameters cannot reach the joint angles.
            "error_before_mm": sample.before,
            "error_after_mm": sample.after,
            // The latter in σ of the stated noise, or else of the estimated, at this pose: the rms
            // over three coordinates, 1 is expected; `null` if no noise is known.
            "error_after_sigma": sample.after_in_sigmas,
            // What the sample counted in the fit: 1 with the squared loss, 0 if it is suspected, with
            // `--forget` what the estimate remembers of it.
            "weight": sample.weight.weight,
        })
    });
    let contents = json!({
        "robot_file": report.before.name,
        "samples_file": report.samples_file,
        // `ikm` or `fkm`.
        "method": report.options.method.name(),
        // `levenberg-marquardt` or `gauss-newton`.
        "solver": solver_name(report.options.solver),
        "frame": match report.options.frame {
            Frame::Base => "base",
            Frame::Sensor => "sensor",
        },
        // Whether the robot file was no guess.
        "no_guess": report.options.no_guess,
        // `squared`, `huber` or `tukey`.
        "loss": loss_name(report.options.loss),
        "sample_count": report.samples,
        // The samples that a robust fit did not count, the farthest off first; they are no part of
        // `position_error_mm`.
        "suspected_samples": suspected.collect::<Vec<_>>(),
        // Of a robust fit, the samples before or after some line that all disagree with the others; `null`
        // if there is no such line.
        "shift": report.shift.map(|shift| json!({
            "line": shift.line,
            // Whether those from this line on disagree, or those before.
            "after": shift.after,
            "samples": shift.samples,
            // Their mean distance from the calibrated robot, in its frame.
            "mean_mm": shift.mean,
            // rms about that.
            "scatter_mm": shift.scatter,
        })),
        // What came of the samples because they came in an order.
        "stream": super::stream::json(report),
        "arms": arms(report),
        // Distance between measured and computed positions over the samples; with `--forget` each as
        // far as the estimate remembers it.
        "position_error_mm": {
            "before": position_error(&report.error_before),
            "after": position_error(&report.error_after),
        },
        // The same for every sample, in the file's order; of more than 10,000 for those that `sampled` names.
        "samples": samples.collect::<Vec<_>>(),
        // Of more than 10,000 samples, of which `samples`, `suspected_samples` and `stream.gate.rejected`
        // hold some; `null` if they hold all.
        "sampled": report.sampled.as_ref().map(|all| sampled(report, all)),
        // The position error that the calibrated robot is expected to have; `null` if the uncertainty
        // is unknown.
        "expected_error": report.uncertainty.as_ref().map(|map| expected_error(&map.expected)),
        // That error as an expanded uncertainty; `null` if the uncertainty or the noise is unknown.
        "expanded_uncertainty": expanded::json(report.expanded().as_ref(), false),
        // Whether it is within `--limit`; `null` without.
        "acceptance": expanded::acceptance_json(about.acceptance),
        // What the robot says of the stated tolerance; `null` without one, or if the samples say
        // nothing of it.
        "tolerance": report.prior_test.map(|test| json!({
            // How many tolerances the parameters are off, rms: 1 is expected.
            "ratio": test.ratio,
            // Over how many combinations of parameters.
            "combinations": test.combinations,
            // Of a ratio as large, if the tolerance is as stated.
            "probability": test.probability,
            // Whether the calibration used the tolerance times `ratio`.
            "widened": report.tolerance_widened,
        })),
        // What the calibration means over a grid of poses within the joint limits; `null` if the
        // uncertainty is unknown.
        "workspace": report.workspace.map(|comparison| json!({
            // Of the grid.
            "poses": comparison.poses,
            // rms standard deviation of the calibrated positions.
            "position_sigma_mm": comparison.sigma,
            // rms distance by which the calibration moved the positions.
            "change_mm": comparison.change,
            // The probability that the robot is worse after the calibration than before; with `--frame sensor` that
            // its positions relative to each other are.
            "chance_of_harm": comparison.chance_of_harm,
        })),
        "position_uncertainty": report.uncertainty.as_ref().map(uncertainty),
        // X_sensor = rotation · X_robot + translation_mm; `null` with `--frame base`.
        "sensor_frame": report.after.sensor_frame.map(|frame| json!({
            // Row by row.
            "rotation": frame.rotation.transpose().data.0,
            "translation_mm": frame.translation.data.0[0],
        })),
        // What the residuals say of the noise; `null` if no sample is left over.
        "noise": report.noise_test.as_ref().map(|test| noise::json(report.before.robot.drive(), test, report.before.noise.as_ref())),
        // Errors that the model does not hold, the one that explains most first; `null` if nothing was
        // looked for.
        "causes": super::causes::json(&report.causes),
        // Why nothing was looked for; `null` if something was.
        "causes_not_tested": report.causes.not_tested,
        // By how much the causes put the calibrated positions off, rms over the workspace.
        "causes_position_error_mm": report.causes.position_error,
        // By what every σ is multiplied because the residuals exceed the stated noise, have a cause that was found, or,
        // without a stated noise, show a part of the joints; 1 if none.
        "sigma_widened_by": report.widening,
        // What would explain the samples better; `null` if nothing is wrong with them as a whole.
        "diagnosis": report.diagnosis.as_ref().map(diagnosis::json),
        // Anything doubtful, in plain words.
        "warnings": report.warnings,
        // Robot, measurement, files and date; `null` of a calibration on a controller.
        "document": about.document.map(Document::json),
    });
    json::report(SCHEMA_VERSION, contents)
}

/// What is known of samples that are not in the report one by one.
fn sampled(report: &CalibrationReport, all: &Sampled) -> Value {
    let histogram = |histogram: &Histogram| {
        json!({
            // Of each bar; the first begins at 0.
            "width": histogram.width,
            "counts": histogram.counts,
            // Farther off than the last bar, or not known.
            "beyond": histogram.beyond,
        })
    };
    json!({
        // How many `samples` holds: those with the largest `error_after_mm`, and others spread evenly.
        "shown": report.sample_errors.len(),
        "of": report.samples,
        // How many a robust fit did not count.
        "suspected": all.suspected,
        // Over all samples.
        "error_after_mm": histogram(&all.after),
        // `null` if no noise is known.
        "error_after_sigma": all.after_in_sigmas.as_ref().map(histogram),
    })
}

/// A calibration that is refused.
pub fn refusal(error: &CalibrateError) -> Value {
    let diagnosis = error.diagnosis.as_deref().map(diagnosis::json);
    refused(
        &error.to_string(),
        error.remedy().as_deref(),
        diagnosis.as_ref(),
    )
}

/// Something is refused.
pub fn refused(cause: &str, remedy: Option<&str>, diagnosis: Option<&Value>) -> Value {
    let contents = json!({
        // Why there is no calibration.
        "refused": cause,
        // What to do next.
        "remedy": remedy.unwrap_or_default(),
        // What would explain the samples; `null` if nothing is wrong with them as a whole, or
        // nothing explains it.
        "diagnosis": diagnosis,
    });
    json::report(SCHEMA_VERSION, contents)
}

fn arms(report: &CalibrationReport) -> Vec<Value> {
    let parameters = comparisons(report);
    let each = of_an_arm(&parameters);
    let arms = report.outcome.fit.arms.iter().zip(parameters.chunks(each));
    let stated_noise = report.before.noise.is_some();
    arms.map(|(outcome, parameters)| arm(outcome, parameters, stated_noise))
        .collect()
}

/// All eight, in the order Dx, Dy, Dz, theta, alpha, La_x, La_y, Lb; with linear drives Dx, Dy, Dz, lean_x, lean_y,
/// scale, Lb.
pub(super) fn parameters_of(comparisons: &[Comparison]) -> Value {
    let parameters = comparisons.iter().map(|c| {
        json!({
            "symbol": c.parameter.symbol(),
            // `mm` or `deg`; nothing of a scale.
            "unit": c.unit,
            "before": c.before,
            "after": c.after,
            "change": c.change,
            // One standard deviation.
            "sigma": c.sigma,
            // The part, 0 to 1, that the stated tolerance decided and not the samples.
            "prior_share": c.prior_share,
        })
    });
    parameters.collect()
}

fn arm(outcome: &ArmOutcome<f64>, parameters: &[Comparison], stated_noise: bool) -> Value {
    let number = parameters.first().map(|parameter| parameter.arm + 1);
    json!({
        // 1, 2 or 3.
        "arm": number,
        "parameters": parameters_of(parameters),
        // Condition number of the scaled problem, 1 at best.
        "condition": outcome.condition,
        // rms of the residuals; the whole robot's with `fkm`.
        "residual": outcome.residual_rms,
        // σ of the stated noise, or mm without one: along the forearm (`ikm`), in each coordinate
        // of the position (`fkm`).
        "residual_unit": if stated_noise { "sigma" } else { "mm" },
        // One σ, of the same, estimated from the residuals; `null` with a stated noise.
        "estimated_noise_mm": outcome.estimated_noise,
        // Samples less the parameters that they and not the tolerance determine.
        "degrees_of_freedom": outcome.degrees_of_freedom,
        // Linearisations.
        "iterations": outcome.iterations,
        // `converged` or `rounding limit`.
        "termination": termination_name(outcome.termination),
        // `robot file`, `without a guess`, `search` or `IKM solution`.
        "start": start_name(outcome.start),
    })
}

fn position_error(error: &PositionError) -> Value {
    json!({
        // √ of the mean square; `null` if no sample is reachable.
        "rms": error.rms,
        "max": error.max,
        // The line in the samples file of the sample that has it.
        "max_at_line": error.max_at_line,
        // Samples left out because the geometry cannot reach their joint angles.
        "unreachable": error.unreachable,
    })
}

/// One σ of the calibrated positions, √tr of their covariance, place by place, where the robot is
/// clear of singularities.
fn uncertainty(map: &UncertaintyMap) -> Value {
    let slice = |slice: &Slice| {
        let (rms, max) = slice.rms_and_max()?;
        let z = match slice.plane {
            Plane::Horizontal(z) => Some(z),
            Plane::Vertical => None,
        };
        // `z_mm` is `null` for the vertical plane at y = 0.
        Some(json!({ "z_mm": z, "rms_mm": rms, "max_mm": max }))
    };
    json!({
        // Over a grid of joint angles.
        "rms_mm": map.expected.absolute.rms,
        "max_mm": map.expected.absolute.max,
        "max_at_mm": map.expected.absolute.max_at.data.0[0],
        // Planes through the workspace, each over a grid of positions in it.
        "slices": map.slices.iter().filter_map(slice).collect::<Vec<_>>(),
    })
}

/// The numbers of a transmission: angle of the arm = q + gain · q + cos_deg · cos q + sin_deg · sin q
/// + cos2_deg · cos 2q + sin2_deg · sin 2q.
pub(crate) fn transmission(numbers: [f64; 5]) -> Value {
    let [gain, harmonics @ ..] = numbers;
    let [cos, sin, cos2, sin2] = harmonics.map(degrees);
    json!({ "gain": gain, "cos_deg": cos, "sin_deg": sin, "cos2_deg": cos2, "sin2_deg": sin2 })
}

/// One σ over poses evenly spread in joint space within the limits and clear of singularities, and at
/// the worst place.
pub(in crate::report) fn expected_error(expected: &ExpectedError) -> Value {
    let (absolute, intrinsic) = (&expected.absolute, &expected.intrinsic);
    json!({
        "absolute_rms_mm": absolute.rms,
        "absolute_worst_mm": absolute.max,
        "absolute_worst_at_mm": absolute.max_at.data.0[0],
        // After the best rigid motion: what counts where the robot's place in space is not measured.
        "intrinsic_rms_mm": intrinsic.rms,
        "intrinsic_worst_mm": intrinsic.max,
        "intrinsic_worst_at_mm": intrinsic.max_at.data.0[0],
    })
}
