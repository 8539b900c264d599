//! Tests of each kind of reading's noise: χ² against a stated noise, and an estimate.

use crate::accuracy::information::{is_empty, parameters, prior_covariance};
use crate::accuracy::quantiles::quantile;
use crate::files::robot_file::{RobotFile, scaled};
use crate::files::samples_file::Kind;
use crate::fit::Solution;
use crate::fit::solution::{KindNoise, PARAMETERS};
use crate::order;
use crate::text::{in_file_units, list, significant, tolerance_keys};
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::{ArmIndex, Parameter, Real, Robot, Tolerance};
use nalgebra::{DMatrix, DVector, SMatrix};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// A stated noise or tolerance is contradicted below this probability: 3 σ of a normal distribution, two-sided.
const IMPROBABLE: f64 = 0.0027;
/// Noise exceeded by less than this factor counts as well stated, however many samples there are.
const EXCEEDED: f64 = 1.1;
/// Overstated noise is cautious; below this fraction of it, it misleads.
pub(super) const SMALL: f64 = 0.6;
/// Probability on either side of the confidence interval.
const TAIL: f64 = 0.025;

/// The noise of a kind of reading, estimated from the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseTest {
    /// The kind of reading.
    pub kind: Kind,
    /// σ of a reading stated in the robot file, mm; `None` if it is estimated.
    pub stated_mm: Option<f64>,
    /// σ estimated from the residuals, mm; with a stated noise, the joints' part is assumed to be in proportion.
    pub sigma_mm: f64,
    /// Its 95 % confidence limits, mm.
    pub limits_mm: [f64; 2],
    /// ν: readings less those that the parameters take up; an estimated noise includes the prior's degrees of freedom.
    pub degrees_of_freedom: f64,
    /// √(Σ(r/σ)²/ν): residuals in units of the stated noise; 1 for an estimated noise.
    pub ratio: f64,
    /// Two-sided probability of such residuals if the noise is as stated; 1 for an estimated noise.
    pub probability: f64,
    /// The verdict.
    pub verdict: NoiseVerdict,
    /// Of positions that only the joints' part of the stated noise overstates: σ of a joint that the residuals show,
    /// radians or mm.
    #[serde(skip)]
    pub joint_shown: Option<f64>,
}

/// Verdict of the χ² test of a stated noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseVerdict {
    /// No noise is stated.
    Estimated,
    /// The residuals agree with it, or nearly.
    Agrees,
    /// The residuals are larger.
    Understated,
    /// The residuals are much smaller.
    Overstated,
}

impl NoiseTest {
    /// `None` without degrees of freedom.
    pub(crate) fn of(noise: &KindNoise) -> Option<Self> {
        let freedom = if noise.stated {
            noise.freedom
        } else {
            noise.known
        };
        if !(freedom >= 1.0) {
            return None;
        }
        let (mut ratio, mut probability, mut verdict) = (1.0, 1.0, NoiseVerdict::Estimated);
        if noise.stated {
            ratio = noise.ratio();
            let squares = ratio * ratio * freedom;
            let chi_square = ChiSquared::new(freedom).ok()?;
            let tail = chi_square.cdf(squares).min(chi_square.sf(squares));
            probability = (2.0 * tail).min(1.0);
            verdict = match ratio {
                _ if probability >= IMPROBABLE => NoiseVerdict::Agrees,
                ratio if ratio > EXCEEDED => NoiseVerdict::Understated,
                ratio if ratio < SMALL => NoiseVerdict::Overstated,
                _ => NoiseVerdict::Agrees,
            };
        }
        let sigma = ratio * noise.sigma;
        let limit = |probability| Some(sigma * (freedom / quantile(freedom, probability)?).sqrt());
        Some(Self {
            kind: noise.kind,
            stated_mm: noise.stated.then_some(noise.sigma),
            sigma_mm: sigma,
            limits_mm: [limit(1.0 - TAIL)?, limit(TAIL)?],
            degrees_of_freedom: freedom,
            ratio,
            probability,
            verdict,
            joint_shown: None,
        })
    }

    /// Factor for every σ computed with this noise: the ratio by which the residuals exceed it, if that is significant
    /// or a cause for it was found; otherwise 1.
    pub(crate) fn widening(&self, cause_found: bool) -> f64 {
        if cause_found || self.verdict == NoiseVerdict::Understated {
            self.ratio.max(1.0)
        } else {
            1.0
        }
    }
}

/// Λ above which a combination counts as determined: the samples' σ is half of the tolerance.
const DETERMINED: f64 = 4.0;
/// Number of combinations that move the robot as a whole.
const MOTIONS: usize = 6;
/// Probability that an estimated noise is larger than its upper limit.
const SURE: f64 = 0.025;
/// Smaller variances are rounding.
const LEAST: f64 = 1e-12;

/// Test of the stated tolerance against the calibrated robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PriorTest {
    /// Parameter errors in units of the tolerance, rms over the combinations that the samples determine: √(χ²/ν). 1 is
    /// expected.
    pub ratio: f64,
    /// ν: combinations that the samples determine at least twice as well as the tolerance does.
    pub combinations: usize,
    /// Number of combinations: the parameters, less the rigid motions of the robot if no reading determines its place.
    pub of: usize,
    /// The probability of a ratio at least this large if the tolerance is as stated.
    pub probability: f64,
}

/// A test of the stated tolerance, and what was made of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ToleranceTest {
    /// The test.
    #[serde(flatten)]
    pub test: PriorTest,
    /// Whether the tolerance times its `ratio` was used.
    pub widened: bool,
}

/// The indices that the arms use, rows that convert parameters to tolerances, and the covariance in tolerances.
pub(super) fn in_tolerances(
    robot: &Robot<f64>,
    tolerance: &Tolerance<f64>,
    covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>,
) -> Option<(Vec<usize>, DMatrix<f64>, DMatrix<f64>)> {
    let places = 0..PARAMETERS;
    let used: Vec<usize> = places.filter(|place| !is_empty(robot, *place)).collect();
    let pick = |matrix: &SMatrix<f64, PARAMETERS, PARAMETERS>| {
        DMatrix::from_fn(used.len(), used.len(), |row, column| {
            matrix[(used[row], used[column])]
        })
    };
    let root = pick(&prior_covariance(robot, tolerance)).cholesky()?.l();
    let inverse = root.try_inverse()?;
    let scaled = &inverse * pick(covariance) * inverse.transpose();
    Some((used, inverse, scaled))
}

impl PriorTest {
    /// `None` if the samples determine nothing better than the tolerance.
    pub(crate) fn of(
        nominal: &Robot<f64>,
        tolerance: &Tolerance<f64>,
        solution: &Solution,
    ) -> Option<Self> {
        let drive = nominal.drive();
        // If only the angles of joint zeros are known, `moved` refers to the directions of the calibrated upper arms.
        let about = match drive {
            Drive::Rotary => &solution.robot,
            Drive::Linear => nominal,
        };
        let (used, inverse, scaled) = in_tolerances(about, tolerance, &solution.of_parameters())?;
        let moved = DVector::from_fn(used.len(), |row, _| solution.moved[used[row]]);
        let eigen = scaled.symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(&(&inverse * moved));
        let motions = if solution.is_absolute() { 0 } else { MOTIONS };
        let of = 3 * drive.parameters().len() - motions;
        // Uses the upper limit of an estimated noise.
        let larger = match solution.estimated_freedom() {
            Some(freedom) => freedom / quantile(freedom, SURE)?,
            None => 1.0,
        };
        let (mut chi_square, mut combinations) = (0.0, 0);
        let mut pairs: Vec<_> = eigen.eigenvalues.iter().zip(&along).collect();
        order::sort_by(&mut pairs, |own| *own.0);
        for (part, along) in pairs.into_iter().take(of) {
            // c = 1/(1 + Λ) is the remaining fraction of the prior's variance, d = m/(1 − c) the samples' own estimate.
            let part = part.max(LEAST);
            if 1.0 / part - 1.0 <= DETERMINED {
                break;
            }
            let said = along / (1.0 - part);
            let scatter = part / (1.0 - part);
            chi_square += said * said / (1.0 + larger * scatter);
            combinations += 1;
        }
        if combinations == 0 {
            return None;
        }
        let freedom = combinations as f64;
        Some(Self {
            ratio: (chi_square / freedom).sqrt(),
            combinations,
            of,
            probability: ChiSquared::new(freedom).ok()?.sf(chi_square),
        })
    }

    /// Whether the robot contradicts the stated tolerance: it is too small.
    pub fn contradicts(&self) -> bool {
        self.probability < IMPROBABLE
    }

    /// The tolerance that agrees with the robot, `ratio` times the stated one.
    pub(crate) fn widened(&self, tolerance: &Tolerance<f64>) -> Option<Tolerance<f64>> {
        scaled(tolerance, self.ratio)
    }

    /// The statement to write into the robot file.
    pub(crate) fn statement(&self, drive: Drive, tolerance: &Tolerance<f64>) -> String {
        let Some(wider) = self.widened(tolerance) else {
            return "a larger [tolerance]".to_owned();
        };
        let each = tolerance_keys(drive, &wider).into_iter();
        let each = each.map(|(key, value)| format!("{key} = {}", significant(value, 2)));
        list(&each.collect::<Vec<_>>())
    }
}

/// A larger change is a mistake and not an error of manufacture: percent of the forearm, degrees, percent of a scale.
const IMPLAUSIBLE: f64 = 10.0;
/// A larger change is doubtful; same units.
const DOUBTFUL: f64 = 2.0;
/// Most changes named in a warning.
const NAMED: usize = 3;

/// Change of a parameter by the calibration; millimetres or radians.
#[derive(Debug, Clone, Copy)]
struct Change {
    arm: ArmIndex,
    parameter: Parameter,
    before: f64,
    after: f64,
    /// Percent of the forearm, degrees, or percent of a scale.
    size: f64,
}

/// Changes of all parameters, largest first.
fn changes(before: &Robot<f64>, after: &Robot<f64>) -> Vec<Change> {
    let change = |(arm, parameter): (ArmIndex, Parameter)| {
        let (from, to) = (before.arm(arm), after.arm(arm));
        let (mut before, after) = (from.get(parameter), to.get(parameter));
        if parameter == Parameter::Theta {
            // 359° and −1° are the same azimuth.
            before += ((after - before) / TAU).round() * TAU;
        }
        let change = (after - before).abs();
        Change {
            arm,
            parameter,
            before,
            after,
            size: match parameter.kind() {
                ParameterKind::Length => 100.0 * change / from.lb(),
                ParameterKind::Angle => change.to_degrees(),
                ParameterKind::Ratio => 100.0 * change,
            },
        }
    };
    let mut changes: Vec<_> = parameters(before).map(change).collect();
    order::sort_by(&mut changes, |own| -own.size);
    changes
}

/// The largest change, if it is too large for an error of manufacture: "theta of arm 1 is … in the robot file and came
/// out as …".
pub(crate) fn implausible(before: &RobotFile, after: &Robot<f64>) -> Option<String> {
    let convention = &before.convention;
    let stated = |own: &Change, value| {
        in_file_units(own.parameter, convention.parameter(own.parameter, value))
    };
    let largest = changes(&before.robot, after).into_iter().next()?;
    let of = match largest.parameter.kind() {
        ParameterKind::Length => " % of the forearm",
        ParameterKind::Angle => "°",
        ParameterKind::Ratio => " %",
    };
    (largest.size > IMPLAUSIBLE).then(|| {
        format!(
            "{} of {} is {} in the robot file, but {} fitted; more than {IMPLAUSIBLE}{of} off is not credible without a \
             stated [tolerance].",
            largest.parameter,
            largest.arm,
            stated(&largest, largest.before),
            stated(&largest, largest.after),
        )
    })
}

/// Whether a change is too large for an error of manufacture. The end stops of towers are exempt: they are adjustable.
pub(crate) fn is_another_robot(before: &Robot<f64>, after: &Robot<f64>) -> bool {
    changes(before, after).iter().any(|change| {
        let chosen = before.drive() == Drive::Linear && change.parameter == Parameter::Zero;
        change.size > DOUBTFUL && !chosen
    })
}

/// The largest changes, if they are doubtful: "La_y of arm 2 by +12.000 mm (…), … and …".
pub(crate) fn doubtful(file: &RobotFile, after: &Robot<f64>) -> Option<String> {
    let (before, convention) = (&file.robot, &file.convention);
    let large = changes(before, after)
        .into_iter()
        .filter(|own| own.size > DOUBTFUL);
    let named = large.take(NAMED).map(|change| {
        let by = convention.parameter(change.parameter, change.after - change.before);
        let by = in_file_units(change.parameter, by);
        let zero = |robot: &Robot<f64>| {
            let (x, y) = robot.arm(change.arm).la();
            y.angle_over(x)
        };
        let zero = if change.parameter == Parameter::LaY {
            let by = convention.angle(zero(after) - zero(before));
            format!(" (the joint's zero by {:.3}°)", by.to_degrees())
        } else {
            String::new()
        };
        format!("{} of {} by {by}{zero}", change.parameter, change.arm)
    });
    let named: Vec<_> = named.collect();
    (!named.is_empty()).then(|| list(&named))
}
