//! Faults of a samples file as a whole: exchanged columns, a wrong sign, another unit, a mirrored frame. Each fault is
//! undone and the samples compared with the robot of the file; the faults without which they agree clearly better are
//! named. Nothing is ever corrected.

use super::fault::{COORDINATES, Fault, Files};
use super::search::{Found, explains};
use crate::accuracy::quantiles::median;
use crate::accuracy::rigid_motion::degenerate;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::{Kind, Readings};
use crate::fit::{Case, Frame, Options, solve};
use crate::geometry::outside_limits;
use crate::order;
use crate::text::{capitalised, list, significant};
use delta_cal::Sample;
use delta_cal::frame::RigidTransform;
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt;

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
/// How much better a coordinate that was commanded agrees with the robot of the file: than the others, than the noise.
const COMMANDED: f64 = 10.0;
const BELOW_NOISE: f64 = 3.0;
/// No robot that needs calibration is where its file says to this fraction of the forearm.
const AS_STATED: f64 = 1e-4;
/// Most samples compared, evenly spread over the file.
const COMPARED: usize = 64;
/// One sample in this many may be outside the joint limits: a mistyped digit.
const ONE_OUTSIDE_IN: usize = 8;
/// Most rows of which each is left out in turn.
const ROWS_TRIED: usize = 100;
/// Most explanations named; others that are as good are only counted.
const NAMED: usize = 4;

/// Explanations for samples that cannot be right as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Median distance of the measured points from those of the robot file, mm; infinite if the robot does not reach
    /// them or they are in one spot.
    pub as_they_are: f64,
    /// Explanations, best first, all about equally good. At least one.
    pub explanations: Vec<Explanation>,
}

/// A fault, or two together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// The fault in words.
    pub cause: String,
    /// The remedy.
    pub remedy: String,
    /// [`Diagnosis::as_they_are`] without the faults, mm.
    pub without: f64,
    /// The same after a calibration without the faults; `None` if the calibration is refused.
    pub calibrated: Option<f64>,
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [best, others @ ..] = &self.explanations[..] else {
            return Ok(());
        };
        write!(
            formatter,
            "Probably {}. With that corrected, the median sample is {} mm from the robot file",
            best.cause,
            significant(best.without, 3),
        )?;
        if let Some(calibrated) = best.calibrated {
            let calibrated = significant(calibrated, 3);
            write!(formatter, " ({calibrated} mm after calibration)")?;
        }
        if self.as_they_are.is_finite() {
            let as_they_are = significant(self.as_they_are, 3);
            write!(formatter, "; as it is, {as_they_are} mm")?;
        }
        for other in others.iter().take(NAMED - 1) {
            write!(formatter, ". Equally likely: {}", other.cause)?;
        }
        if let Some(more) = others.len().checked_sub(NAMED - 1).filter(|more| *more > 0) {
            write!(formatter, ". {more} more are as likely")?;
        }
        formatter.write_str(". No file was changed")
    }
}

impl Diagnosis {
    /// The remedies of the first explanation and of the alternatives.
    pub fn remedy(&self) -> String {
        let mut remedies: Vec<_> = Vec::new();
        for explanation in self.explanations.iter().take(NAMED) {
            if !remedies.contains(&explanation.remedy.as_str()) {
                remedies.push(&explanation.remedy);
            }
        }
        remedies.join("; or ")
    }

    /// The same as a sentence.
    pub(crate) fn advice(&self) -> String {
        format!("{}.", capitalised(&self.remedy()))
    }
}

/// Diagnoses the samples, whether or not a calibration accepts them; `None` if the file as a whole is right, or no
/// fault explains it.
pub(crate) fn diagnose(
    robot: &RobotFile,
    readings: &Readings,
    options: &Options,
) -> Option<Diagnosis> {
    let samples: Vec<_> = readings.samples().map(|row| row.value).collect();
    let needed = match options.frame {
        Frame::Base => SAMPLES_NEEDED,
        Frame::Sensor => SAMPLES_FOR_A_FRAME,
    };
    if samples.len() < needed {
        return None;
    }
    let [arm, ..] = robot.robot.arms();
    let evidence = Evidence {
        files: Files { robot, readings },
        options,
        samples,
        forearm: arm.lb(),
    };
    let nothing = Fault::none(options.frame);
    let as_they_are = evidence.median(&nothing, &evidence.compared(&nothing));
    let found = evidence.explanations(as_they_are);
    let explanations = found.into_iter().map(|own| Explanation {
        without: own.fault.unit * own.median,
        calibrated: evidence.calibrated(&own.fault),
        cause: own.fault.cause,
        remedy: own.fault.remedy,
    });
    let explanations: Vec<_> = explanations.collect();
    (!explanations.is_empty()).then_some(Diagnosis {
        as_they_are,
        explanations,
    })
}

/// A fault that may explain the samples.
struct Scored {
    fault: Fault,
    /// Median distance between the measured points and the robot of the file without the fault, mm.
    median: f64,
}

/// The data for comparing hypotheses.
struct Evidence<'a> {
    files: Files<'a>,
    options: &'a Options,
    samples: Vec<Sample<f64>>,
    forearm: f64,
}

impl Evidence<'_> {
    /// An even selection of the samples, without the fault.
    fn compared(&self, fault: &Fault) -> Vec<Sample<f64>> {
        let step = self.samples.len().div_ceil(COMPARED).max(1);
        fault.undone(&self.samples).step_by(step).collect()
    }

    /// Median distance of the compared points from the robot of the file without this fault, mm. Infinite if the robot
    /// reaches less than half.
    fn median(&self, fault: &Fault, samples: &[Sample<f64>]) -> f64 {
        let Some(robot) = fault.robot(&self.files.robot.robot) else {
            return f64::INFINITY;
        };
        let expected = samples.iter();
        let expected: Vec<_> = expected
            .map(|sample| robot.forward(&sample.joints).ok())
            .collect();
        let transform = match fault.frame {
            Frame::Base => Some(RigidTransform::identity()),
            Frame::Sensor => self.aligned(&expected, samples),
        };
        let Some(transform) = transform else {
            return f64::INFINITY;
        };
        let distances = expected.iter().zip(samples).map(|(expected, sample)| {
            expected.map_or(f64::INFINITY, |point| {
                (sample.position - transform.apply(&point)).norm()
            })
        });
        median(distances).unwrap_or(f64::INFINITY)
    }

    /// The sensor's frame. Points that another unit shrinks to a spot fit everywhere, so they have none.
    fn aligned(
        &self,
        expected: &[Option<Vector3<f64>>],
        samples: &[Sample<f64>],
    ) -> Option<RigidTransform<f64>> {
        let reached: Vec<_> = expected.iter().flatten().copied().collect();
        let measured: Vec<_> = samples.iter().map(|sample| sample.position).collect();
        let spot =
            |points: &Vec<Vector3<f64>>| degenerate(points.iter().copied(), self.forearm).is_some();
        if samples.len() < SAMPLES_FOR_A_FRAME || [reached, measured].iter().any(spot) {
            return None;
        }
        let pairs = expected.iter().zip(samples);
        let known = pairs.filter_map(|(expected, sample)| Some(((*expected)?, sample.position)));
        RigidTransform::align(known)
    }

    /// The fault and its median, which is infinite if the joint limits exclude the samples.
    fn scored(&self, fault: Fault) -> Scored {
        let samples = self.compared(&fault);
        let is_outside = fault.limits(&self.files.robot.limits).is_none_or(|limits| {
            let outside = samples
                .iter()
                .filter(|sample| sample.joints.iter().any(|q| outside_limits(*q, &limits)));
            outside.count() * ONE_OUTSIDE_IN > samples.len()
        });
        let median = if is_outside {
            f64::INFINITY
        } else {
            self.median(&fault, &samples)
        };
        Scored { fault, median }
    }

    /// The explanations of the samples, best first; empty if they need none. Pairs of faults are considered only where
    /// no single fault is enough.
    fn explanations(&self, as_they_are: f64) -> Vec<Scored> {
        if !(as_they_are > RIGHT * self.forearm) {
            return Vec::new();
        }
        let kinds = self.files.faults(self.options.frame);
        let elsewhere = (self.options.frame == Frame::Base).then(Files::elsewhere);
        let single = kinds.iter().flatten().chain(&elsewhere).cloned();
        let found = self.select(as_they_are, single);
        // Calibration can correct errors smaller than that.
        if !found.is_empty() || !(as_they_are > NEAR * self.forearm) {
            return found;
        }
        let pairs = kinds.iter().enumerate().flat_map(|(index, firsts)| {
            let others = kinds.iter().skip(index + 1).flatten();
            others.flat_map(|second| {
                let firsts = firsts.iter();
                firsts.map(|first| self.files.both(first, second))
            })
        });
        // A frame at an unknown place includes rotations.
        let moved = elsewhere.iter().flat_map(|elsewhere| {
            let in_frame = self.files.faults(Frame::Sensor).into_iter().flatten();
            in_frame.map(|fault| fault.and(elsewhere))
        });
        self.select(as_they_are, pairs.chain(moved))
    }

    fn select(&self, as_they_are: f64, all: impl Iterator<Item = Fault>) -> Vec<Scored> {
        let elsewhere = |scored: &Scored| scored.fault.frame != self.options.frame;
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
        let explaining = all.map(|fault| self.scored(fault)).filter(explains);
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

    /// The median error of a calibration of the files without the fault, mm.
    fn calibrated(&self, fault: &Fault) -> Option<f64> {
        let file = self.files.robot;
        let robot = file.with_robot(&fault.robot(&file.robot)?);
        let readings = fault.undone_in(self.files.readings);
        let options = Options {
            frame: fault.frame,
            ..*self.options
        };
        let solution = solve(&robot, &readings, &options).ok()?;
        let distances = readings.samples().map(|row| {
            let place = solution.robot.forward(&row.value.joints).ok();
            place.map_or(f64::INFINITY, |place| {
                let frame = solution.places.frame;
                let seen = frame.map_or(place, |own| own.apply(&place));
                (row.value.position - seen).norm()
            })
        });
        Some(fault.unit * median(distances)?)
    }
}

/// The mistake in all rows without which heights and distances agree with the robot of the file; or, if nothing fits all
/// rows, the row without which the others do. In a sentence, with the remedy.
pub(crate) fn mistake(case: &Case<'_>, found: Option<&Found>) -> Option<String> {
    let (robot, readings) = (case.robot, case.readings);
    let files = Files { robot, readings };
    let faults = files.of_other_readings();
    let faults = faults.filter(|_| !readings.holds(Kind::Position));
    let undone = faults.map(|own| (own.undone_in(readings), own.cause, own.remedy));
    let mut undone = undone.chain(files.of_planes());
    let is_single = found.is_none() && readings.rows.len() <= ROWS_TRIED;
    let rows = (0..readings.rows.len()).filter(|_| is_single);
    let mut others = rows.map(|row| {
        let mut others = readings.clone();
        let line = others.rows.remove(row).line;
        let cause = format!("line {line} disagrees with all others");
        (others, cause, "measure it again or delete it".to_owned())
    });
    let best = |all: &mut dyn Iterator<Item = (Readings, String, String)>| {
        let scored = all.filter_map(|(changed, cause, remedy)| {
            let other = Case {
                readings: &changed,
                ..*case
            };
            let score = (changed != *readings).then(|| explains(&other, found))??;
            Some((score, cause, remedy))
        });
        scored.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let (_, cause, remedy) = best(&mut undone).or_else(|| best(&mut others))?;
    Some(format!("Probably {cause}: {remedy}."))
}

/// Coordinates that are where the robot of the file is, and not where it was measured: they agree with it ten times
/// better than the others do, and three times better than the noise allows. Their names and the rms of the difference, mm.
pub(crate) fn commanded(robot: &RobotFile, readings: &Readings) -> Option<(String, f64)> {
    let samples = readings.samples();
    let off = samples.filter_map(|row| {
        let there = robot.robot.forward(&row.value.joints).ok()?;
        Some(row.value.position - there)
    });
    let off: Vec<_> = off.collect();
    if off.len() < SAMPLES_NEEDED {
        return None;
    }
    let squares = off.iter().map(|own| own.component_mul(own));
    #[expect(clippy::cast_precision_loss, reason = "a number of rows")]
    let rms = (squares.sum::<Vector3<f64>>() / off.len() as f64).map(f64::sqrt);
    let [arm, ..] = robot.robot.arms();
    let noise = robot.noise.map_or(f64::INFINITY, |noise| noise.position());
    let noise = noise.min(AS_STATED * arm.lb());
    let limit = (rms.max() / COMMANDED).min(noise / BELOW_NOISE);
    let copied = COORDINATES
        .iter()
        .zip(&rms)
        .filter(|(_, own)| **own < limit);
    let (names, rms): (Vec<_>, Vec<_>) =
        copied.map(|(name, own)| ((*name).to_owned(), *own)).unzip();
    let largest = rms.into_iter().reduce(f64::max)?;
    Some((list(&names), largest))
}

/// The best explanation and those equally good. Where only rounding separates them, the likelier comes first, in the
/// order of [`Files::faults`].
fn alike(mut all: Vec<Scored>) -> Vec<Scored> {
    let medians = all.iter().map(|scored| scored.median);
    let best = medians.reduce(f64::min).unwrap_or_default();
    all.retain(|scored| scored.median <= ALIKE * best);
    let rank = |scored: &Scored| scored.median.max(SAME * best);
    order::sort_by(&mut all, rank);
    all
}
