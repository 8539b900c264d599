//! Agreement of the samples with the robot file when a fault is undone.

use super::fault::{Fault, are_two, faults, shifted, undone};
use crate::accuracy::rigid_motion::degenerate;
use crate::calibration::judge::{Case, attempt};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Readings;
use crate::fit::{Frame, Options};
use crate::geometry::outside_limits;
use delta_cal::Sample;
use delta_cal::frame::RigidTransform;
use delta_cal::kinematics::JointLimits;
use nalgebra::Vector3;

/// Factor by which an explanation must bring the samples nearer to the robot of the file.
const CLEARLY: f64 = 4.0;
/// Explanations within this factor of the best are equally good.
const ALIKE: f64 = 2.0;
/// Explanations within this factor of the best are identical.
const SAME: f64 = 1.01;
/// With an explanation, half of the samples are within this fraction of the forearm of the robot of the file.
const NEAR: f64 = 0.1;
/// Samples nearer than this fraction of the forearm need no explanation.
const RIGHT: f64 = 1e-3;
/// A frame at an unknown place has six unknowns and explains a little of everything, so stricter limits apply.
const FRAME_CLEARLY: f64 = 8.0;
const FRAME_NEAR: f64 = 0.02;
const FRAME_FAR: f64 = 0.1;
/// Least number of samples; fewer agree with almost any fault.
const SAMPLES_NEEDED: usize = 4;
/// The same if the frame is unknown.
const SAMPLES_FOR_A_FRAME: usize = 8;
/// Most samples compared, evenly spread over the file.
const COMPARED: usize = 64;
/// One sample in this many may be outside the joint limits: a mistyped digit.
const ONE_OUTSIDE_IN: usize = 8;

/// Faults that together explain the samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scored {
    pub(super) faults: Vec<Fault>,
    /// Median distance between the measured points and the robot of the file without the faults, mm.
    pub(super) median: f64,
}

/// The data for comparing hypotheses.
pub(super) struct Evidence<'a> {
    pub(super) robot: &'a RobotFile,
    pub(super) readings: &'a Readings,
    pub(super) options: &'a Options,
    samples: Vec<Sample<f64>>,
    pub(super) forearm: f64,
}

impl<'a> Evidence<'a> {
    /// `None` if there are too few samples.
    pub(super) fn new(
        robot: &'a RobotFile,
        readings: &'a Readings,
        options: &'a Options,
    ) -> Option<Self> {
        let samples: Vec<_> = readings.samples().map(|row| row.value).collect();
        let count = samples.len();
        let needed = match options.frame {
            Frame::Base => SAMPLES_NEEDED,
            Frame::Sensor => SAMPLES_FOR_A_FRAME,
        };
        let [arm, ..] = robot.robot.arms();
        (count >= needed).then(|| Self {
            robot,
            readings,
            options,
            samples,
            forearm: arm.lb(),
        })
    }

    /// Median distance of the compared points from the robot of the file with these faults undone, mm. Infinite if the
    /// robot reaches less than half, or the joint limits exclude them.
    pub(super) fn median(&self, faults: &[Fault]) -> f64 {
        let compared = compared(&self.samples, faults);
        let Some((robot, samples)) = undone(faults, &self.robot.robot, &compared) else {
            return f64::INFINITY;
        };
        if !faults.is_empty() && self.is_outside(&samples, faults) {
            return f64::INFINITY;
        }
        let aligned = self.options.frame == Frame::Sensor || faults.contains(&Fault::Elsewhere);
        if aligned && samples.len() < SAMPLES_FOR_A_FRAME {
            return f64::INFINITY;
        }
        let expected: Vec<_> = samples
            .iter()
            .map(|sample| robot.forward(&sample.joints).ok())
            .collect();
        // Points that another unit shrinks to a spot fit everywhere.
        let reached: Vec<_> = expected.iter().flatten().copied().collect();
        let measured: Vec<_> = samples.iter().map(|sample| sample.position).collect();
        let spot =
            |points: &Vec<Vector3<f64>>| degenerate(points.iter().copied(), self.forearm).is_some();
        if aligned && [reached, measured].iter().any(spot) {
            return f64::INFINITY;
        }
        median_distance(&expected, &samples, aligned).unwrap_or(f64::INFINITY)
    }

    /// Whether samples are outside the joint limits.
    fn is_outside(&self, samples: &[Sample<f64>], faults: &[Fault]) -> bool {
        let limits = if faults.contains(&Fault::Limits) {
            let own = &self.robot.limits;
            match JointLimits::new(-own.maximum(), -own.minimum()) {
                Ok(limits) => limits,
                Err(_) => return true,
            }
        } else {
            self.robot.limits
        };
        let outside = samples.iter().filter(|sample| {
            let joints = sample.joints.iter();
            joints.copied().any(|q| outside_limits(q, &limits))
        });
        outside.count() * ONE_OUTSIDE_IN > samples.len()
    }

    /// The explanations of the samples, best first; empty if they need none. Pairs of faults are considered only where
    /// no single fault is enough.
    pub(super) fn explanations(&self, as_they_are: f64) -> Vec<Scored> {
        if !(as_they_are > RIGHT * self.forearm) {
            return Vec::new();
        }
        let kinds = faults(self.options.frame, self.readings.positions_in);
        let single = kinds.iter().flatten().map(|fault| vec![*fault]);
        let found = self.select(as_they_are, single.map(|faults| self.scored(faults)));
        // Calibration can correct errors smaller than that.
        if !found.is_empty() || !(as_they_are > NEAR * self.forearm) {
            return found;
        }
        let pairs = kinds.iter().enumerate().flat_map(|(index, firsts)| {
            let others = kinds.iter().skip(index + 1).flatten();
            others.flat_map(move |second| {
                let firsts = firsts.iter().filter(|first| are_two(first, second));
                firsts.map(|first| vec![*first, *second])
            })
        });
        self.select(as_they_are, pairs.map(|faults| self.scored(faults)))
    }

    fn scored(&self, faults: Vec<Fault>) -> Scored {
        Scored {
            median: self.median(&faults),
            faults,
        }
    }

    /// The median error of a calibration of the files with the faults undone, mm.
    pub(super) fn calibrated(&self, faults: &[Fault]) -> Option<f64> {
        let values: Vec<_> = shifted(&self.samples, faults).collect();
        let (without, values) = undone(faults, &self.robot.robot, &values)?;
        let robot = RobotFile {
            robot: without,
            ..self.robot.clone()
        };
        let mut readings = self.readings.clone();
        let complete = readings
            .rows
            .iter_mut()
            .filter(|row| row.value.sample().is_some());
        let count = values.len();
        for (row, value) in complete.zip(values) {
            row.value.joints = value.joints;
            row.value.position = value.position.data.0[0].map(Some);
        }
        if faults
            .iter()
            .any(|own| matches!(own, Fault::Shifted { .. }))
        {
            readings.rows.truncate(count);
        }
        let mut options = *self.options;
        if faults.contains(&Fault::Elsewhere) {
            options.frame = Frame::Sensor;
        }
        let case = Case::new(&robot, &readings, options);
        Some(attempt(&case).ok()?.error_after?.median)
    }

    fn select(&self, as_they_are: f64, all: impl Iterator<Item = Scored>) -> Vec<Scored> {
        let elsewhere = |scored: &Scored| scored.faults.contains(&Fault::Elsewhere);
        let explains = |scored: &Scored| {
            let (clearly, near, far) = if elsewhere(scored) {
                (FRAME_CLEARLY, FRAME_NEAR, FRAME_FAR)
            } else {
                (CLEARLY, NEAR, 0.0)
            };
            scored.median * clearly <= as_they_are
                && scored.median <= near * self.forearm
                && as_they_are >= far * self.forearm
        };
        let explaining = all.filter(explains);
        let (frames, exact): (Vec<_>, Vec<_>) = explaining.partition(elsewhere);
        let (frames, exact) = (alike(frames), alike(exact));
        match (frames.first(), exact.first()) {
            (Some(frame), Some(best))
                if frame.median * CLEARLY < best.median
                    && best.median > FRAME_NEAR * self.forearm =>
            {
                frames
            }
            (Some(_), None) => frames,
            _ => exact,
        }
    }
}

/// The best explanation and those equally good. Where only rounding separates them, the likelier comes first, in the
/// order of [`faults`].
fn alike(mut all: Vec<Scored>) -> Vec<Scored> {
    let medians = all.iter().map(|scored| scored.median);
    let best = medians.reduce(f64::min).unwrap_or_default();
    all.retain(|scored| scored.median <= ALIKE * best);
    let rank = |scored: &Scored| scored.median.max(SAME * best);
    all.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    all
}

/// An even selection of the samples, with positions moved to the joints that they belong to.
fn compared(samples: &[Sample<f64>], faults: &[Fault]) -> Vec<Sample<f64>> {
    let step = samples.len().div_ceil(COMPARED).max(1);
    shifted(samples, faults).step_by(step).collect()
}

fn median_distance(
    expected: &[Option<Vector3<f64>>],
    samples: &[Sample<f64>],
    aligned: bool,
) -> Option<f64> {
    let pairs = expected.iter().zip(samples);
    let transform = if aligned {
        let known = pairs
            .clone()
            .filter_map(|(expected, sample)| Some(((*expected)?, sample.position)));
        RigidTransform::align(known).ok()?
    } else {
        RigidTransform::identity()
    };
    let mut distances: Vec<_> = pairs
        .map(|(expected, sample)| {
            expected.map_or(f64::INFINITY, |point| {
                (sample.position - transform.apply(&point)).norm()
            })
        })
        .collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied()
}
