//! Whether the samples that disagree are those after some row, as if the sensor had been moved there.

use super::case::Case;
use crate::fit::weights::Fit;
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
    /// Of a robust fit that has calibrated this robot.
    pub(crate) fn find(robot: &Robot<f64>, case: &Case<'_>, fit: &Fit) -> Option<Self> {
        let count = case.samples.count();
        let suspected = |index| fit.weight(index).suspected;
        let all = (0..count).filter(|index| suspected(*index)).count();
        if all < FEWEST {
            return None;
        }
        let part = |a: usize, b: usize| count_of(a) >= MOST * count_of(b);
        let (mut before, mut best) = (0, None::<(usize, usize, bool)>);
        for first in 1..count {
            before += usize::from(suspected(first - 1));
            for (within, side, after) in
                [(all - before, count - first, true), (before, first, false)]
            {
                // Right if it is suspected on that side, or not suspected on the other.
                let right = within + (count - side) - (all - within);
                let agrees = part(within, side) && part(within, all);
                if agrees && best.is_none_or(|(most, ..)| right >= most) {
                    best = Some((right, first, after));
                }
            }
        }
        let (_, first, after) = best?;
        let side = if after { first..count } else { 0..first };
        let apart = |index: usize, sample: &Sample<f64>| {
            if !(side.contains(&index) && suspected(index)) {
                return None;
            }
            Some(sample.position - robot.forward(&sample.joints).ok()?)
        };
        let (mut samples, mut sum) = (0, Vector3::zeros());
        case.all().each(|index, sample| {
            if let Some(apart) = apart(index, sample) {
                samples += 1;
                sum += apart;
            }
        });
        let mean = sum / count_of(samples);
        let mut squares = 0.0;
        case.all().each(|index, sample| {
            squares += apart(index, sample).map_or(0.0, |apart| (apart - mean).norm_squared());
        });
        Some(Self {
            line: case.samples.line(first)?,
            after,
            samples,
            mean: mean.data.0[0],
            scatter: (squares / count_of(samples)).sqrt(),
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
