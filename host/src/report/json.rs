//! The report for programs.

mod diagnosis;
mod noise;

use super::suspected::{self, loss_name};
use super::{comparisons, solver_name, start_name, termination_name};
use crate::position_uncertainty::{Plane, UncertaintyMap};
use crate::{CalibrationReport, Frame, PositionError};
use serde::Serialize;

pub use diagnosis::{JsonDiagnosis, JsonExplanation, JsonRefusal};
pub use noise::{JsonNoise, JsonStatedNoise};

/// Changes whenever a field changes its name or meaning or is removed.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole report. Lengths in millimetres, angles in degrees; `null` where a figure is unknown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonReport {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The program's version.
    pub program_version: &'static str,
    /// Name of the robot file.
    pub robot_file: String,
    /// Name of the samples file.
    pub samples_file: String,
    /// `ikm` or `fkm`.
    pub method: &'static str,
    /// `levenberg-marquardt` or `gauss-newton`.
    pub solver: &'static str,
    /// `base` or `sensor`.
    pub frame: &'static str,
    /// Whether the robot file was no guess.
    pub no_guess: bool,
    /// `squared`, `huber` or `tukey`.
    pub loss: &'static str,
    /// Number of samples.
    pub sample_count: usize,
    /// The samples that a robust fit did not count, the farthest off first; they are no part of
    /// `position_error_mm`.
    pub suspected_samples: Vec<JsonSuspected>,
    /// What came of the samples because they came in an order: with `--gate`, `--held-out` or
    /// `--forget`, otherwise `null`.
    pub stream: Option<super::stream::JsonStream>,
    /// The three arms.
    pub arms: Vec<JsonArm>,
    /// Distance between measured and computed positions over the samples.
    pub position_error_mm: JsonBeforeAfter,
    /// The same for every sample, in the file's order.
    pub samples: Vec<JsonSample>,
    /// What the calibration means over a grid of poses within the joint limits; `null` if the
    /// uncertainty is unknown.
    pub workspace: Option<JsonWorkspace>,
    /// How uncertain the calibrated positions are, place by place, where the robot is clear of
    /// singularities; `null` as above.
    pub position_uncertainty: Option<JsonUncertainty>,
    /// From the robot's frame to the sensor's; `null` with `--frame base`.
    pub sensor_frame: Option<JsonFrame>,
    /// What the residuals say of the noise; `null` if no sample is left over.
    pub noise: Option<JsonNoise>,
    /// What would explain the samples better; `null` if nothing is wrong with them as a whole.
    pub diagnosis: Option<JsonDiagnosis>,
    /// Anything doubtful, in plain words.
    pub warnings: Vec<String>,
}

/// One arm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonArm {
    /// 1, 2 or 3.
    pub arm: usize,
    /// All eight, in the order `Dx, Dy, Dz, theta, alpha, La_x, La_y, Lb`.
    pub parameters: Vec<JsonParameter>,
    /// Condition number of the scaled problem, 1 at best.
    pub condition: f64,
    /// rms of the residuals, in `residual_unit`; the whole robot's with `fkm`.
    pub residual: f64,
    /// `sigma` of the stated noise, or `mm` without one: along the forearm (`ikm`), in each
    /// coordinate of the position (`fkm`).
    pub residual_unit: &'static str,
    /// One σ, of the same, estimated from the residuals; `null` with a stated noise.
    pub estimated_noise_mm: Option<f64>,
    /// Samples less the parameters that they and not the tolerance determine.
    pub degrees_of_freedom: f64,
    /// Linearisations.
    pub iterations: u16,
    /// Why it stopped: `converged` or `rounding limit`.
    pub termination: &'static str,
    /// Where it had started: `robot file`, `without a guess`, `search` or `IKM solution`.
    pub start: &'static str,
}

/// One parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonParameter {
    /// `Dx, Dy, Dz, theta, alpha, La_x, La_y` or `Lb`.
    pub symbol: &'static str,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// In the robot file.
    pub before: f64,
    /// Calibrated.
    pub after: f64,
    /// After less before.
    pub change: f64,
    /// One standard deviation; `null` if unknown.
    pub sigma: Option<f64>,
    /// The part, 0 to 1, that the stated tolerance decided and not the samples.
    pub prior_share: f64,
}

/// A position error before and after.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonBeforeAfter {
    /// With the robot file's parameters.
    pub before: JsonPositionError,
    /// With the calibrated ones.
    pub after: JsonPositionError,
}

/// A position error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonPositionError {
    /// √ of the mean square; `null` if no sample is reachable.
    pub rms: Option<f64>,
    /// The largest.
    pub max: Option<f64>,
    /// The line in the samples file of the sample that has it.
    pub max_at_line: Option<u64>,
    /// Samples left out because the geometry cannot reach their joint angles.
    pub unreachable: usize,
}

/// A sample that disagrees with all others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonSuspected {
    /// Its line in the samples file.
    pub line: u64,
    /// As `error_after_sigma` of the sample.
    pub residual_sigma: Option<f64>,
    /// As `error_after_mm` of the sample.
    pub residual_mm: Option<f64>,
    /// As `weight` of the sample: 0.
    pub weight: f64,
}

/// Distance between the measured and the computed position of one sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JsonSample {
    /// Its line in the samples file.
    pub line: u64,
    /// With the robot file's parameters; `null` if they cannot reach the joint angles.
    pub error_before_mm: Option<f64>,
    /// With the calibrated ones.
    pub error_after_mm: Option<f64>,
    /// The latter in σ of the stated noise, or else of the estimated, at this pose: the rms over three
    /// coordinates, 1 is expected; `null` if no noise is known.
    pub error_after_sigma: Option<f64>,
    /// What the sample counted in the fit: 1 with the squared loss, 0 if it is suspected.
    pub weight: f64,
}

/// The calibration over the workspace.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonWorkspace {
    /// Poses of the grid.
    pub poses: u32,
    /// rms standard deviation of the calibrated positions.
    pub position_sigma_mm: f64,
    /// rms distance by which the calibration moved the positions.
    pub change_mm: f64,
}

/// One σ of the calibrated positions: √tr of their covariance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonUncertainty {
    /// Over a grid of joint angles.
    pub rms_mm: f64,
    /// The largest of them.
    pub max_mm: f64,
    /// Where that is.
    pub max_at_mm: [f64; 3],
    /// Planes through the workspace.
    pub slices: Vec<JsonSlice>,
}

/// One σ of the calibrated positions in a plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonSlice {
    /// Of a horizontal plane; `null` for the vertical one at y = 0.
    pub z_mm: Option<f64>,
    /// Over a grid of positions in it.
    pub rms_mm: f64,
    /// The largest of them.
    pub max_mm: f64,
}

/// `X_sensor = rotation · X_robot + translation_mm`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonFrame {
    /// Row by row.
    pub rotation: [[f64; 3]; 3],
    /// Millimetres.
    pub translation_mm: [f64; 3],
}

impl JsonReport {
    /// The report of a calibration.
    pub fn new(report: &CalibrationReport) -> Self {
        let robot_arms = report.before.robot.arms();
        let stated_noise = report.before.noise.is_some();
        let arms = robot_arms
            .iter()
            .zip(&report.outcome.fit.arms)
            .zip(1..)
            .map(|((before, outcome), arm)| JsonArm {
                arm,
                parameters: comparisons(before, outcome)
                    .into_iter()
                    .map(|c| JsonParameter {
                        symbol: c.symbol,
                        unit: c.unit,
                        before: c.before,
                        after: c.after,
                        change: c.change,
                        sigma: c.sigma,
                        prior_share: c.prior_share,
                    })
                    .collect(),
                condition: outcome.condition,
                residual: outcome.residual_rms,
                residual_unit: if stated_noise { "sigma" } else { "mm" },
                estimated_noise_mm: outcome.estimated_noise,
                degrees_of_freedom: outcome.degrees_of_freedom,
                iterations: outcome.iterations,
                termination: termination_name(outcome.termination),
                start: start_name(outcome.start),
            })
            .collect();
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION"),
            robot_file: report.before.name.clone(),
            samples_file: report.samples_file.clone(),
            method: report.options.method.name(),
            solver: solver_name(report.options.solver),
            frame: match report.options.frame {
                Frame::Base => "base",
                Frame::Sensor => "sensor",
            },
            no_guess: report.options.no_guess,
            loss: loss_name(report.options.loss),
            sample_count: report.samples,
            suspected_samples: suspected::rows(report)
                .into_iter()
                .filter(|sample| sample.weight.suspected)
                .map(|sample| JsonSuspected {
                    line: sample.line,
                    residual_sigma: sample.after_in_sigmas,
                    residual_mm: sample.after,
                    weight: sample.weight.weight,
                })
                .collect(),
            stream: super::stream::json(report),
            arms,
            position_error_mm: JsonBeforeAfter {
                before: position_error(&report.error_before),
                after: position_error(&report.error_after),
            },
            samples: report
                .sample_errors
                .iter()
                .map(|sample| JsonSample {
                    line: sample.line,
                    error_before_mm: sample.before,
                    error_after_mm: sample.after,
                    error_after_sigma: sample.after_in_sigmas,
                    weight: sample.weight.weight,
                })
                .collect(),
            workspace: report.workspace.map(|comparison| JsonWorkspace {
                poses: comparison.poses,
                position_sigma_mm: comparison.sigma,
                change_mm: comparison.change,
            }),
            position_uncertainty: report.uncertainty.as_ref().map(uncertainty),
            sensor_frame: report.after.sensor_frame.map(|frame| JsonFrame {
                rotation: frame.rotation.transpose().data.0,
                translation_mm: frame.translation.data.0[0],
            }),
            noise: report
                .noise_test
                .as_ref()
                .map(|test| JsonNoise::new(test, report.before.noise.as_ref())),
            diagnosis: report.diagnosis.as_ref().map(JsonDiagnosis::new),
            warnings: report.warnings.clone(),
        }
    }

    /// As text, indented, ending in a new line.
    ///
    /// # Errors
    /// None is known; the serialiser's, if it had one.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}

fn position_error(error: &PositionError) -> JsonPositionError {
    let known = |value: f64| error.rms.is_finite().then_some(value);
    JsonPositionError {
        rms: known(error.rms),
        max: known(error.max),
        max_at_line: error.max_at_line,
        unreachable: error.unreachable,
    }
}

fn uncertainty(map: &UncertaintyMap) -> JsonUncertainty {
    let slices = map.slices.iter().filter_map(|slice| {
        let (rms_mm, max_mm) = slice.rms_and_max()?;
        let z_mm = match slice.plane {
            Plane::Horizontal(z) => Some(z),
            Plane::Vertical => None,
        };
        Some(JsonSlice {
            z_mm,
            rms_mm,
            max_mm,
        })
    });
    JsonUncertainty {
        rms_mm: map.sigma.rms,
        max_mm: map.sigma.max,
        max_at_mm: map.sigma.max_at.data.0[0],
        slices: slices.collect(),
    }
}
