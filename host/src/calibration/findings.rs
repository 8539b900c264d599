//! What there is to say of a calibration beside its figures: data, and one sentence each.

use super::causes::Cause;
use super::credibility::{NoiseTest, PriorTest};
use super::diagnosis::Diagnosis;
use super::step::Step;
use super::wrong_rows::Shift;
use crate::accuracy::improvement::Moved;
use crate::files::samples_file::{Joined, Kind};
use crate::text::{count, in_lines, probability, significant};
use serde::Serialize;
use std::fmt;

/// Residuals above this part of the stated noise may be half of it.
const HALF: f64 = 0.4;

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// The result may mislead.
    Warning,
    /// Worth knowing.
    Note,
}

/// Something that a calibration showed.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Finding {
    /// A mistake in the file as a whole explains the samples clearly better.
    Diagnosis {
        /// What is wrong and what to do.
        #[serde(skip)]
        diagnosis: Diagnosis,
    },
    /// The samples before or after a line all disagree with the others.
    Shift {
        /// Where, and how far.
        shift: Shift,
    },
    /// All points are off alike: the measured point may not be the platform point.
    Target {
        /// The mean offset in the robot's frame, mm.
        offset_mm: [f64; 3],
        /// How far the offsets scatter about it, mm rms.
        scatter_mm: f64,
    },
    /// A robust fit left samples out.
    Suspected {
        /// Their lines.
        lines: Vec<u64>,
    },
    /// An error that the model cannot represent.
    Cause {
        /// Which.
        #[serde(skip)]
        cause: Cause,
        /// Its name.
        cause_kind: &'static str,
    },
    /// In this order of the rows a drift and errors of the robot look alike.
    DriftHidden {
        /// Up to this drift from the first row to the last, mm.
        up_to_mm: f64,
    },
    /// What happened at one row.
    Step {
        /// What, and where.
        #[serde(flatten)]
        step: Step,
    },
    /// The position error over the samples did not become smaller.
    NotImproved {
        /// mm rms.
        before_mm: f64,
        /// mm rms.
        after_mm: f64,
    },
    /// A geometry does not reach the joint angles of some samples.
    Unreachable {
        /// Whether it is that of the file, or the calibrated one.
        calibrated: bool,
        /// How many samples.
        samples: usize,
    },
    /// Rows that do not count because the robot of the file does not reach their joint angles.
    LeftOut {
        /// Their lines.
        lines: Vec<u64>,
    },
    /// Half of the points were far from where the robot of the file puts them.
    Elsewhere {
        /// The median distance, mm.
        median_mm: f64,
    },
    /// A sample is much farther off than the others.
    Outlier {
        /// Its line.
        line: u64,
        /// Its largest residual, in σ.
        sigmas: f64,
    },
    /// Without a tolerance: parameters that differ much from the robot file.
    LargeChanges {
        /// Which, and by how much.
        changes: String,
    },
    /// Too few samples without a tolerance.
    FewSamples {
        /// How many there are.
        samples: usize,
        /// How many exclude a second solution.
        needed: usize,
    },
    /// Joints and positions came from two files.
    Joined {
        /// How.
        #[serde(flatten)]
        joined: Joined,
        /// Rows.
        rows: usize,
    },
    /// The sensor's frame is known from points of the machine.
    Datum {
        /// How many.
        points: usize,
        /// How well they fit, mm rms of a coordinate.
        rms_mm: f64,
    },
    /// Rows that are equal to others, to the last digit.
    Copies {
        /// Their lines.
        lines: Vec<u64>,
    },
    /// Poses were measured again, and the readings differ.
    Repeatability {
        /// Of which readings.
        of: Kind,
        /// One σ of a reading, mm.
        sigma_mm: f64,
        /// Readings less poses.
        degrees_of_freedom: f64,
    },
    /// The residuals are larger than the stated noise.
    NoiseUnderstated {
        /// The test.
        test: NoiseTest,
        /// By how much every σ was multiplied.
        widened_by: f64,
    },
    /// The residuals are much smaller than the stated noise.
    NoiseOverstated {
        /// The test.
        test: NoiseTest,
    },
    /// Residuals that are taken for noise leave little to the samples.
    SaysLittle {
        /// One σ that the residuals show, mm.
        sigma_mm: f64,
        /// What the tolerance allows, mm.
        tolerated_mm: f64,
    },
    /// The joints have a part in a noise that is not stated.
    JointNoise {
        /// One σ, mm.
        position_mm: f64,
        /// One σ, in the unit of the file.
        joint: f64,
        /// The key that states it.
        key: String,
    },
    /// The robot is farther from nominal than its tolerance allows.
    ToleranceTooSmall {
        /// The test.
        test: PriorTest,
        /// The tolerance that was used instead, if it was widened.
        used: Option<String>,
    },
    /// The calibration may make the robot worse.
    MayBeWorse {
        /// With this probability.
        chance: f64,
        /// By how much positions move, mm rms, and how well they are known then.
        #[serde(flatten)]
        moved: Moved,
    },
    /// The samples do not change the robot.
    Unchanged,
    /// The robot file's sensor frame was not used.
    SensorFrameIgnored,
    /// Without a tolerance the place of the robot's base in the sensor's frame is arbitrary.
    NoPlace,
    /// The tolerance decided parameters.
    ByTolerance {
        /// The arm, 1 to 3.
        arm: usize,
        /// The parameters, each with its share.
        parameters: Vec<(&'static str, f64)>,
    },
    /// The poses determine an arm badly.
    Condition {
        /// The arm, 1 to 3.
        arm: usize,
        /// 1 at best.
        condition: f64,
    },
    /// Several solutions fit.
    SeveralSolutions,
    /// The fit from the robot file did not find the solution.
    FarStart,
    /// No reading refers to the frame of the robot's base.
    PlaceUnknown,
    /// The scale of the robot comes from the tolerance.
    ScaleUnknown {
        /// Whether there are distances, that do not show it well enough.
        distances: bool,
    },
    /// Combinations of parameters that the readings do not determine.
    Combinations {
        /// Better than the tolerance does.
        determined: usize,
        /// How many relative positions depend on.
        of: usize,
        /// Readings.
        readings: usize,
    },
}

impl Finding {
    /// Whether it is a warning.
    pub fn level(&self) -> Level {
        match self {
            Self::Copies { .. }
            | Self::DriftHidden { .. }
            | Self::Joined { .. }
            | Self::Datum { .. }
            | Self::Repeatability { .. }
            | Self::SensorFrameIgnored
            | Self::SeveralSolutions
            | Self::PlaceUnknown
            | Self::ScaleUnknown { .. }
            | Self::JointNoise { .. }
            | Self::ByTolerance { .. }
            | Self::Combinations { .. } => Level::Note,
            _ => Level::Warning,
        }
    }
}

impl fmt::Display for Finding {
    #[allow(clippy::too_many_lines)] // a sentence each
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |value: f64| significant(value, 2);
        match self {
            Self::Diagnosis { diagnosis } => write!(f, "{diagnosis}: {}", diagnosis.remedy()),
            Self::Shift { shift } => shift.fmt(f),
            Self::Step { step } => step.fmt(f),
            Self::DriftHidden { up_to_mm } => write!(
                f,
                "In this order of the rows a drift of the sensor looks like errors of the robot: up to {} mm from the first row \
                 to the last would not show. Measure in random order, and the first pose once more at the end.",
                mm(*up_to_mm)
            ),
            Self::Target { offset_mm: [x, y, z], scatter_mm } => write!(
                f,
                "All measured points are offset by ({x:.1}, {y:.1}, {z:.1}) mm from the platform point (scatter \
                 {scatter_mm:.1} mm). If a reflector or tip is mounted there, state [target] x_mm = {x:.1}, y_mm = {y:.1}, \
                 z_mm = {z:.1}; if the coordinates are in another frame, use --frame sensor."
            ),
            Self::Suspected { lines } => write!(
                f,
                "{} disagree with the others and {} left out: {}. Measure {} again.",
                count(lines.len(), "sample"),
                if lines.len() == 1 { "was" } else { "were" },
                in_lines(lines),
                if lines.len() == 1 { "it" } else { "them" },
            ),
            Self::Cause { cause, .. } => write!(
                f,
                "{cause}. The 24-parameter model cannot represent this error, so the parameters are biased. Fix it first: {}.",
                cause.remedy()
            ),
            Self::NotImproved { before_mm, after_mm } => write!(
                f,
                "The position error over the samples did not improve: {before_mm:.4} mm before, {after_mm:.4} mm after."
            ),
            Self::Unreachable { calibrated, samples } => write!(
                f,
                "The {} robot cannot reach the joint angles of {}; position errors exclude them.",
                if *calibrated { "calibrated" } else { "nominal" },
                count(*samples, "sample")
            ),
            Self::LeftOut { lines } => write!(
                f,
                "The robot of the file does not reach the joint angles in {}; excluded.",
                in_lines(lines)
            ),
            Self::Elsewhere { median_mm } => write!(
                f,
                "Half of the measured points were more than {median_mm:.0} mm from where the robot file puts them. Check \
                 units, joint order and frame (--frame sensor)."
            ),
            Self::Outlier { line, sigmas } => write!(
                f,
                "line {line}: residual {sigmas:.1} σ, much larger than the others. Measure it again."
            ),
            Self::LargeChanges { changes } => write!(
                f,
                "The calibrated robot differs much from the robot file: {changes}. Check units, signs and frame of the samples."
            ),
            Self::FewSamples { samples, needed } => write!(
                f,
                "{} may have several solutions without a [tolerance]. Measure {needed} or more, or state the tolerance.",
                count(*samples, "sample")
            ),
            Self::Joined { joined, rows } => {
                write!(f, "{} joined with the joints of {} ", count(*rows, "row"), joined.joints_file)?;
                match &joined.by {
                    Some(column) => write!(f, "by {column}")?,
                    None => f.write_str("in the order of the rows")?,
                }
                match joined.unused {
                    0 => f.write_str("."),
                    unused => write!(f, "; nothing was measured at {} of joints.", count(unused, "row")),
                }
            }
            Self::Datum { points, rms_mm } => write!(
                f,
                "The sensor's frame is that of {} of [datum], which fit to {} mm: the result is absolute in the machine's frame.",
                count(*points, "point"),
                mm(*rms_mm)
            ),
            Self::Copies { lines } => write!(
                f,
                "{} {} an earlier row to the last digit: one measurement, counted once.",
                in_lines(lines),
                if lines.len() == 1 { "repeats" } else { "repeat" }
            ),
            Self::Repeatability { of, sigma_mm, degrees_of_freedom } => write!(
                f,
                "Repeatability of {}: {} mm (σ, {degrees_of_freedom:.0} degrees of freedom).",
                of.plural(),
                mm(*sigma_mm)
            ),
            Self::NoiseUnderstated { test, widened_by } => write!(
                f,
                "Residuals of {} are {:.1} × the stated noise ({} mm, 95 % CI {}–{}). All σ are multiplied by {widened_by:.1}. \
                 Look for outliers and play; if there are none, set {} = {}.",
                test.kind.plural(),
                test.ratio,
                mm(test.sigma_mm),
                mm(test.limits_mm[0]),
                mm(test.limits_mm[1]),
                test.kind.key(),
                mm(test.sigma_mm),
            ),
            Self::NoiseOverstated { test } => write!(
                f,
                "Residuals of {} are only {:.2} × the stated noise ({} mm). {}If these rows were measured and not computed, set \
                 {} = {}.",
                test.kind.plural(),
                test.ratio,
                mm(test.sigma_mm),
                if test.ratio > HALF { "Was it stated as 2 σ? " } else { "" },
                test.kind.key(),
                mm(test.sigma_mm),
            ),
            Self::SaysLittle { sigma_mm, tolerated_mm } => write!(
                f,
                "Residuals ({} mm) are nearly as large as the tolerance allows ({} mm), so the samples have little weight. \
                 Look for wrong samples, or state the [noise].",
                mm(*sigma_mm),
                mm(*tolerated_mm)
            ),
            Self::JointNoise { position_mm, joint, key } => write!(
                f,
                "Estimated noise includes the joints: position_mm = {}, {key} = {}.",
                mm(*position_mm),
                mm(*joint)
            ),
            Self::ToleranceTooSmall { test, used } => {
                write!(
                    f,
                    "The robot is {:.1} × farther from nominal than the [tolerance] allows ({} of {} combinations, p = {}).",
                    test.ratio,
                    test.combinations,
                    test.of,
                    probability(test.probability)
                )?;
                match used {
                    Some(used) => write!(
                        f,
                        " Calibrated with {used}. Check the robot file and the frame; if the robot is that far off, state that."
                    ),
                    None => Ok(()),
                }
            }
            Self::MayBeWorse { chance, moved } => write!(
                f,
                "{} chance of making the robot worse: positions move {} mm but are known only to {} mm.",
                probability(*chance),
                mm(moved.change),
                mm(moved.sigma)
            ),
            Self::Unchanged => f.write_str(
                "The samples do not change the robot: it is already as accurate as they can show.",
            ),
            Self::SensorFrameIgnored => f.write_str(
                "[sensor_frame] of the robot file is not used; --frame sensor finds the frame again.",
            ),
            Self::NoPlace => f.write_str(
                "No [tolerance] is stated: relative accuracy is measured, the place of the base in the sensor's frame is not.",
            ),
            Self::ByTolerance { arm, parameters } => {
                let named: Vec<_> = parameters
                    .iter()
                    .map(|(symbol, share)| format!("{symbol} ({:.0} %)", 100.0 * share))
                    .collect();
                write!(f, "arm {arm}: mostly decided by the tolerance: {}.", named.join(", "))
            }
            Self::Condition { arm, condition } => write!(
                f,
                "arm {arm}: condition {condition:.0}: the poses determine it badly. Spread them over the whole workspace."
            ),
            Self::SeveralSolutions => f.write_str(
                "Several solutions fit the samples; this one fits best or is nearest to the robot file.",
            ),
            Self::FarStart => f.write_str(
                "The fit from the robot file did not converge, a fit without a start did. The robot file is far off, or rows \
                 are wrong.",
            ),
            Self::PlaceUnknown => f.write_str(
                "The place of the robot's base (six numbers) comes from the tolerance. If absolute positions matter, measure x, y \
                 and z of three poses.",
            ),
            Self::ScaleUnknown { distances: true } => f.write_str(
                "The scale comes from the tolerance: the distances are too few or too inexact. Measure more or longer ones.",
            ),
            Self::ScaleUnknown { distances: false } => f.write_str(
                "The scale comes from the tolerance: touches of planes cannot show it. Measure one known length: a gauge block \
                 (height_mm) or a distance between two poses.",
            ),
            Self::Combinations { determined, of, readings } => write!(
                f,
                "The {readings} readings improve {determined} of {of} parameter combinations; the rest stay at the tolerance."
            ),
        }
    }
}
