//! Fits that samples which disagree with all others do not spoil, by any method.

mod many;

use crate::fit::method;
use crate::fit::options::{CalibrationMethod, Frame};
use crate::fit::outcome::Outcome;
use crate::fit::samples::Samples;
use crate::fit::weights::{Fit, SampleWeight, Weights};
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample, robust_fit};
use delta_cal::{Robot, Sample, Settings};

/// Calibrates a robot from samples of which some may be wrong. What a sample counts is found by the joint
/// calibration, since a sample is right or wrong as a whole; the other methods fit the samples as these
/// weights have them.
///
/// # Errors
/// As [`robust_fit`].
pub fn calibrate_robust(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
    method: CalibrationMethod,
    loss: Loss,
) -> Result<Fit, RobustRefusal> {
    calibrate_weighted(
        robot,
        samples.into(),
        None,
        settings,
        (method, Frame::Base),
        loss,
    )
}

/// The same of samples that already count less, or not at all.
///
/// # Errors
/// As [`robust_fit`], of the samples that count.
pub(crate) fn calibrate_weighted(
    robot: &Robot<f64>,
    samples: Samples<'_>,
    before: Option<&Weights>,
    settings: &Settings<f64>,
    (method, frame): (CalibrationMethod, Frame),
    loss: Loss,
) -> Result<Fit, RobustRefusal> {
    let in_memory = match samples {
        Samples::InMemory(in_memory) => in_memory,
        Samples::OnDisk(on_disk) => {
            let found = many::fit(robot, &on_disk, before, settings, loss)?;
            let (all, settled) = (found.all(before), found.settled);
            let plain =
                before.is_none() && method == CalibrationMethod::Joint && frame == Frame::Base;
            let outcome = if plain {
                found.outcome
            } else {
                let weights = Some(&found.weights);
                method::calibrate(method, robot, samples, weights, settings, frame)?
            };
            return Ok(Fit::on_disk(outcome, samples, all, settled));
        }
    };
    let before = before
        .cloned()
        .unwrap_or_else(|| Weights::full(in_memory.len()));
    let counted = |index: &usize| {
        before
            .factors
            .get(*index)
            .is_some_and(|weight| *weight > 0.0)
    };
    let places: Vec<_> = (0..in_memory.len()).filter(counted).collect();
    let kept: Vec<_> = places.iter().map(|place| in_memory[*place]).collect();
    let mut work = vec![WeighedSample::vacant(); kept.len()];
    let found = robust_fit(robot, settings, &kept, loss, &mut work)?;

    let mut weights = Weights {
        factors: vec![0.0; in_memory.len()],
        effective_samples: found.effective_samples * before.mean_of_counted(),
    };
    let mut marks: Vec<_> = before
        .factors
        .iter()
        .map(|factor| SampleWeight {
            weight: *factor,
            remembered: *factor,
            suspected: false,
        })
        .collect();
    for (place, sample) in places.iter().zip(&work) {
        let factor = before.factors[*place];
        weights.factors[*place] = factor * sample.factor();
        marks[*place] = SampleWeight {
            weight: factor * sample.weight(),
            remembered: factor,
            suspected: sample.suspected(),
        };
    }
    let plain = before.is_full() && method == CalibrationMethod::Joint && frame == Frame::Base;
    let outcome = if plain {
        Outcome::from(found.fit)
    } else {
        method::calibrate(method, robot, samples, Some(&weights), settings, frame)?
    };
    Ok(Fit {
        outcome,
        samples: marks,
        all: None,
        settled: found.settled,
    })
}
