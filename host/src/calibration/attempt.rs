//! A calibration that is fitted and judged, and not yet reported or explained.

use super::case::Case;
use super::causes::{Causes, Subject, causes};
use super::judgement::{Judgement, judge};
use super::noise_test::NoiseTest;
use super::objection::Objection;
use super::plausibility;
use super::prior_test::PriorTest;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::workspace_poses;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::method;
use crate::fit::options::{CalibrationMethod, Options};
use crate::fit::outcome::Outcome;
use crate::fit::robust::calibrate_weighted;
use crate::fit::shared_noise;
use crate::fit::stream::{self, StreamReport};
use crate::fit::weights::Fit;
use delta_cal::{Calibrator, Refusal, Settings};

/// A fit that is good.
pub(crate) struct Attempt {
    pub(crate) fit: Fit,
    pub(crate) stream: Option<StreamReport>,
    pub(crate) causes: Causes,
    /// By what every σ of the fit is multiplied.
    pub(crate) widening: f64,
    pub(crate) judgement: Judgement,
    /// The test of a stated tolerance that was widened because the robot contradicts it.
    pub(crate) widened: Option<PriorTest>,
}

impl Attempt {
    /// Looks for what the model does not hold, widens the uncertainty by the lack of fit, and judges.
    ///
    /// # Errors
    /// What speaks against the fit.
    pub(crate) fn of(
        case: &Case<'_>,
        settings: &Settings<f64>,
        mut fit: Fit,
        stream: Option<StreamReport>,
    ) -> Result<Self, Objection> {
        let (method, outcome) = (case.options.method, &fit.outcome);
        let noise_test = NoiseTest::of(case.before, method, outcome, &case.measured);
        let poses = workspace_poses::inside(&outcome.fit.robot, &case.robot.reach());
        let causes = if case.options.streaming.forget.is_some() {
            Causes::not_tested("--forget lets samples fade, so that they do not count alike")
        } else {
            let subject = Subject {
                nominal: &case.robot.robot,
                calibrated: &outcome.fit.robot,
                samples: &case.measured,
                directions: &case.directions,
                weights: &fit.samples,
                noise: case.robot.noise,
                estimated_noise: outcome.estimated_noise(),
                tolerance: settings.tolerance,
                aligned: case.sensor_frame.is_some(),
                arms_apart: method == CalibrationMethod::Ikm,
            };
            causes(&subject, &poses)
        };
        let by_residuals = noise_test.map_or(1.0, |test| test.widening(!causes.found.is_empty()));
        let by_causes = outcome.covariance.as_ref().and_then(|covariance| {
            let robot = &outcome.fit.robot;
            let sigma = PositionUncertainty { robot, covariance }.over(&poses)?.rms;
            (sigma > 0.0).then(|| causes.position_error / sigma)
        });
        let widening = (by_residuals * causes.uneven_noise).hypot(by_causes.unwrap_or(0.0));
        fit.outcome = fit.outcome.widened(widening);
        let judgement = judge(case, settings, &fit, noise_test)?;
        Ok(Self {
            fit,
            stream,
            causes,
            widening,
            judgement,
            widened: None,
        })
    }
}

/// Fits and judges. A stated tolerance that the robot contradicts is widened where the samples decide
/// all parameters.
///
/// # Errors
/// What speaks against the calibration.
pub(crate) fn attempt(case: &Case<'_>, settings: &Settings<f64>) -> Result<Attempt, Objection> {
    match judged(case, settings) {
        Err(
            objection @ (Objection::BeyondTolerance(_)
            | Objection::Fit(Refusal::FarFromNominal { .. })),
        ) => with_wider_tolerance(case, settings).ok_or(objection),
        result => result,
    }
}

fn judged(case: &Case<'_>, settings: &Settings<f64>) -> Result<Attempt, Objection> {
    let (fit, stream) = fitted(case, settings)?;
    Attempt::of(case, settings, fit, stream)
}

/// `None` if the samples alone do not determine a robot that could be this one, or if it does not
/// contradict the tolerance.
fn with_wider_tolerance(case: &Case<'_>, settings: &Settings<f64>) -> Option<Attempt> {
    let (nominal, tolerance) = (&case.robot.robot, settings.tolerance.as_ref()?);
    let (free, _) = fitted(case, &settings.with_tolerance(None)).ok()?;
    // Larger differences are wrong samples rather than a robot.
    if plausibility::is_another_robot(nominal, &free.outcome.fit.robot) {
        return None;
    }
    let noise = settings.noise.as_ref();
    let (measured, weights) = (&case.measured, &free.samples);
    let test = PriorTest::of(
        nominal,
        tolerance,
        &free.outcome,
        measured,
        weights,
        noise,
        case.options.frame,
    )?;
    if !(test.contradicts() && test.samples_decide()) {
        return None;
    }
    let attempt = judged(case, &settings.with_tolerance(test.widened(tolerance))).ok()?;
    Some(Attempt {
        widened: Some(test),
        ..attempt
    })
}

/// After a calibration: half of the samples are off by less than this, mm. `None` if it is refused.
pub(crate) fn position_error_after(
    robot: &RobotFile,
    samples: &SamplesFile,
    options: Options,
) -> Option<f64> {
    let case = Case::new(robot, samples, options).ok()?;
    let attempt = attempt(&case, &case.settings().ok()?).ok()?;
    Some(attempt.judgement.error_after.median)
}

fn fitted(
    case: &Case<'_>,
    settings: &Settings<f64>,
) -> Result<(Fit, Option<StreamReport>), Objection> {
    let (mut fit, stream) = estimated(case, settings)?;
    if case.options.method == CalibrationMethod::Ikm {
        let samples = (case.measured.as_slice(), case.stands_for());
        shared_noise::complete(&mut fit, samples, settings.noise.as_ref());
    }
    Ok((fit, stream))
}

fn estimated(
    case: &Case<'_>,
    settings: &Settings<f64>,
) -> Result<(Fit, Option<StreamReport>), Objection> {
    let (nominal, samples, options) = (&case.robot.robot, case.all(), case.options);
    let empty = Calibrator::new(nominal, settings);
    samples.each_part(|first, samples| {
        (first..).zip(samples).try_for_each(|(index, sample)| {
            let checked = empty.check(sample);
            checked.map_err(|error| Objection::Sample(index, error))
        })
    })?;
    let streamed = if options.streaming.asked() {
        let line_of = |index| case.samples.line(index).unwrap_or_default();
        let streaming = options.streaming;
        Some(stream::weigh(
            nominal, settings, samples, line_of, streaming,
        )?)
    } else {
        None
    };
    let weights = streamed.as_ref().map(|streamed| &streamed.weights);
    let (method, frame) = (options.method, options.frame);
    let mut fit = match (options.loss, &streamed) {
        (Some(loss), _) => {
            calibrate_weighted(nominal, samples, weights, settings, (method, frame), loss)?
        }
        (None, Some(streamed)) if method == CalibrationMethod::Ikm => {
            Fit::weighed(streamed.arms.clone(), samples, &streamed.weights)
        }
        (None, Some(streamed)) => {
            let outcome = method::calibrate(method, nominal, samples, weights, settings, frame)?;
            Fit::weighed(outcome, samples, &streamed.weights)
        }
        (None, None) => Fit::plain(plain(case, settings)?, samples),
    };
    let Some(streamed) = streamed else {
        return Ok((fit, None));
    };
    fit.reject(samples, &streamed.rejected);
    Ok((fit, Some(streamed.report)))
}

/// The fit in which every sample counts alike.
///
/// # Errors
/// A fit that is refused.
pub(crate) fn plain(case: &Case<'_>, settings: &Settings<f64>) -> Result<Outcome, Objection> {
    let (nominal, options) = (&case.robot.robot, case.options);
    let (method, frame) = (options.method, options.frame);
    Ok(method::calibrate(
        method,
        nominal,
        case.all(),
        None,
        settings,
        frame,
    )?)
}
