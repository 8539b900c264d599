//! Whether the samples that disagree are those after some row, as if the sensor had been moved there.

use crate::fit::weights::SampleWeight;
use crate::text::numbers::small;
use crate::text::words::count;
use delta_cal::{Robot, Sample};
use nalgebra::Vector3;
use std::fmt;

/// Fewer samples that disagree in a row are wrong ones rather than a change.
const FEWEST: usize = 3;
/// At least this part of the samples on one side of the change disagrees, and of those that disagree at
/// least this part lies there.
const MOST: f64 = 0.9;

/// Samples at the beginning or the end of the file that all disagree with the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// The line of the first sample after the change.
    pub line: u64,
    /// Whether the samples from that line on disagree with the calibrated robot, or those before.
    pub after: bool,
    /// How many they are.
    pub samples: usize,
    /// Their mean distance from where the calibrated robot is, mm in the robot's frame.
    pub mean: [f64; 3],
    /// How far they scatter about that, rms in mm.
    pub scatter: f64,
}

impl Shift {
    /// Of a robust fit. `lines`: those of the samples.
    pub(crate) fn find(
        robot: &Robot<f64>,
        measured: &[Sample<f64>],
        lines: impl Iterator<Item = u64>,
        weights: &[SampleWeight],
    ) -> Option<Self> {
        let lines: Vec<_> = lines.collect();
        let suspected = |range: &[SampleWeight]| range.iter().filter(|w| w.suspected).count();
        let all = suspected(weights);
        if all < FEWEST {
            return None;
        }
        let part = |a: usize, b: usize| count_of(a) >= MOST * count_of(b);
        let splits = 1..weights.len();
        let candidates = splits.flat_map(|first| [(first, true), (first, false)]);
        let best = candidates
            .filter_map(|(first, after)| {
                let (before, behind) = weights.split_at(first);
                let side = if after { behind } else { before };
                let within = suspected(side);
                let agrees = part(within, side.len()) && part(within, all);
                // Right if it is suspected on that side, or not suspected on the other.
                let right = within + (weights.len() - side.len()) - (all - within);
                agrees.then_some((right, first, after))
            })
            .max_by_key(|(right, ..)| *right);
        let (_, first, after) = best?;
        let side = if after {
            first..weights.len()
        } else {
            0..first
        };
        let apart: Vec<Vector3<f64>> = side
            .filter(|index| weights[*index].suspected)
            .filter_map(|index| {
                let sample = &measured[index];
                Some(sample.position - robot.forward(&sample.joints).ok()?)
            })
            .collect();
        let number = count_of(apart.len());
        let mean = apart.iter().sum::<Vector3<f64>>() / number;
        let squares: f64 = apart.iter().map(|one| (one - mean).norm_squared()).sum();
        Some(Self {
            line: *lines.get(first)?,
            after,
            samples: apart.len(),
            mean: mean.data.0[0],
            scatter: (squares / number).sqrt(),
        })
    }
}

#[allow(clippy::cast_precision_loss)] // samples of a file
fn count_of(samples: usize) -> f64 {
    samples as f64
}

impl fmt::Display for Shift {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.mean;
        let (line, where_) = (
            self.line,
            if self.after {
                "from line"
            } else {
                "before line"
            },
        );
        let on = if self.after { " on" } else { "" };
        write!(
            formatter,
            "{} {where_} {line}{on} lie ({x:.3}, {y:.3}, {z:.3}) mm away from the calibrated robot and \
             scatter by {} mm about that: at this line the sensor, its target or the robot's base was \
             moved. Calibrate the rows before and after it separately",
            count(self.samples, "sample"),
            small(self.scatter),
        )
    }
}
