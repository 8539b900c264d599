//! What is to be said of every sample of a file with many, in one pass over them.

use super::case::Case;
use crate::accuracy::distribution::Sampled;
use crate::accuracy::position_error::{PositionError, RunningError, SampleErrors};
use crate::accuracy::sampled::{Farthest, Histogram, evenly};
use crate::files::robot_file::RobotFile;
use crate::fit::fkm;
use crate::fit::weights::{SampleWeight, WeightsOnDisk};
use delta_cal::{Noise, Sample};
use rayon::prelude::*;
use std::convert::Infallible;
use std::hash::{DefaultHasher, Hash, Hasher};

/// What is to be said of every sample.
pub(super) struct EverySample {
    pub(super) error_before: PositionError,
    pub(super) error_after: PositionError,
    pub(super) distinct_poses: usize,
    /// Some of the samples, in their order.
    pub(super) shown: Vec<SampleErrors>,
    pub(super) sampled: Sampled,
}

/// `in_memory`: the samples that are, whose median errors stand for those of all.
pub(super) fn every_sample(
    case: &Case<'_>,
    after: &RobotFile,
    noise: Option<&Noise<f64>>,
    weights: &WeightsOnDisk,
    in_memory: &[SampleErrors],
    [median_before, median_after]: [f64; 2],
) -> EverySample {
    let (mut before_all, mut after_all) = (RunningError::default(), RunningError::default());
    let mut poses = Vec::with_capacity(case.samples.count());
    let mut farthest = Farthest::default();
    let mut sampled = Sampled {
        suspected: 0,
        counting_little: 0,
        after: Histogram::for_values(in_memory.iter().map(|sample| sample.after)),
        after_in_sigmas: noise
            .map(|_| Histogram::for_values(in_memory.iter().map(|own| own.after_in_sigmas))),
    };
    let Ok(()) = case.samples.each_part(|first, rows| {
        let errors: Vec<_> = rows
            .par_iter()
            .enumerate()
            .map(|(index, row)| {
                let measured = case.in_robot_frame(&row.value);
                errors_of(
                    case,
                    after,
                    noise,
                    (row.line, measured),
                    weights.get(first + index),
                )
            })
            .collect();
        for own in errors {
            before_all.add(own.before, own.line, &own.weight);
            after_all.add(own.after, own.line, &own.weight);
            sampled.suspected += usize::from(own.weight.suspected);
            sampled.counting_little += usize::from(own.counts_little());
            sampled.after.add(own.after);
            if let Some(histogram) = &mut sampled.after_in_sigmas {
                histogram.add(own.after_in_sigmas);
            }
            poses.push(fingerprint(&own.measured));
            farthest.add(own, own.after.unwrap_or(f64::INFINITY));
        }
        Ok::<_, Infallible>(())
    });
    poses.sort_unstable();
    poses.dedup();
    let mut shown = evenly(in_memory);
    shown.extend(farthest.finish());
    shown.sort_by_key(|sample| sample.line);
    shown.dedup_by_key(|sample| sample.line);
    EverySample {
        error_before: before_all.finish(median_before),
        error_after: after_all.finish(median_after),
        distinct_poses: poses.len(),
        shown,
        sampled,
    }
}

fn errors_of(
    case: &Case<'_>,
    after: &RobotFile,
    noise: Option<&Noise<f64>>,
    (line, measured): (u64, Sample<f64>),
    weight: SampleWeight,
) -> SampleErrors {
    let distance = |robot: &RobotFile| {
        let position = robot.robot.forward(&measured.joints).ok()?;
        Some((measured.position - position).norm())
    };
    SampleErrors {
        line,
        measured,
        before: distance(case.before),
        after: distance(after),
        after_in_sigmas: noise
            .and_then(|noise| fkm::residual_in_sigmas(&after.robot, &measured, noise)),
        weight,
    }
}

/// Of the joint angles or travels. Two different ones of a million have the same once in some ten million files.
fn fingerprint(sample: &Sample<f64>) -> u64 {
    let mut hasher = DefaultHasher::new();
    // −0 and 0 are the same angle.
    sample.joints.map(|q| (q + 0.0).to_bits()).hash(&mut hasher);
    hasher.finish()
}
