//! What the residuals say of the measurement noise: χ² against a stated one, and an estimate.

use crate::accuracy::chi_square::quantile;
use crate::accuracy::position_error::sigma_by_tolerance;
use crate::files::robot_file::RobotFile;
use crate::fit::options::CalibrationMethod;
use crate::fit::outcome::Outcome;
use crate::text::joint;
use crate::text::numbers::{probability as percentage, significant};
use delta_cal::calibration::ArmOutcome;
use delta_cal::robot::Drive;
use delta_cal::{ArmIndex, Noise, Robot, Sample};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A stated noise is contradicted below this probability: 3 σ of a normal distribution, two-sided.
const IMPROBABLE: f64 = 0.0027;
/// Noise that is exceeded by less than this is stated well enough, however many samples tell it.
const EXCEEDED: f64 = 1.1;
/// Noise stated larger than it is is cautious; below this part of it, it misleads.
const SMALL: f64 = 0.5;
/// Noise above this part of what the tolerance lets the robot be off leaves little to the samples.
const LITTLE: f64 = 0.5;
/// Probability on either side of the interval.
const TAIL: f64 = 0.025;

/// The noise as the residuals have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseTest {
    /// One σ of each coordinate of the position, mm, with 95 % limits. With a stated noise the joints'
    /// is taken to be in proportion.
    pub position: Estimate,
    /// Degrees of freedom ν of χ² and of the interval: residuals less parameters, fewer where the
    /// arms share the position's noise.
    pub degrees_of_freedom: f64,
    /// Against the stated noise, if there is one.
    pub stated: Option<StatedNoise>,
    /// By how much the stated tolerance lets the robot be off in each coordinate, mm: in half of the
    /// measured poses √(tr(J Σ Jᵀ)/3) is less, with J = ∂X/∂P (3.18) and Σ the tolerance's
    /// variances. `None` if no tolerance is stated.
    pub tolerated: Option<f64>,
}

/// A number with its 95 % confidence limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// The lower and the upper limit.
    pub interval: [f64; 2],
}

/// The χ² test of a stated noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedNoise {
    /// √(Σ(r/σ)²/f), f being residuals less parameters: how many times the stated noise the
    /// residuals say. 1 is expected.
    pub ratio: Estimate,
    /// The probability of residuals that are as improbable if the noise is as stated, two-sided.
    pub probability: f64,
    /// What follows.
    pub verdict: NoiseVerdict,
    /// The arm whose residuals are the largest, and its own ratio; `None` for the FKM method, which
    /// does not tell arms apart.
    pub worst: Option<(ArmIndex, f64)>,
}

/// What a χ² test says of a stated noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseVerdict {
    /// The residuals agree with it, or nearly so.
    Agrees,
    /// They are larger.
    Understated,
    /// They are less than half of it.
    Overstated,
}

impl NoiseVerdict {
    /// As it is written: `agrees`, `understated` or `overstated`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Understated => "understated",
            Self::Overstated => "overstated",
        }
    }
}

impl Estimate {
    /// Of a σ whose square is distributed as σ²χ²(ν)/ν.
    fn of_sigma(value: f64, freedom: f64) -> Option<Self> {
        let limit = |probability| Some(value * (freedom / quantile(freedom, probability)?).sqrt());
        Some(Self {
            value,
            interval: [limit(1.0 - TAIL)?, limit(TAIL)?],
        })
    }

    fn times(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            interval: self.interval.map(|limit| limit * factor),
        }
    }
}

impl NoiseTest {
    /// Of a calibration; `None` if no sample is left over to tell it from.
    pub(crate) fn of(
        before: &RobotFile,
        method: CalibrationMethod,
        outcome: &Outcome,
        measured: &[Sample<f64>],
    ) -> Option<Self> {
        let arms = &outcome.fit.arms;
        let freedom: f64 = arms.iter().map(|arm| arm.degrees_of_freedom).sum();
        if !(freedom >= 1.0) {
            return None;
        }
        let stated = before.noise;
        let shared = if method.separates_arms() {
            independent_share(&outcome.fit.robot, measured, stated.as_ref())
        } else {
            1.0
        };
        let independent = (shared * freedom).max(1.0);
        let tolerated = sigma_by_tolerance(before, measured.iter().map(|sample| sample.joints));
        let Some(noise) = stated else {
            let sigma = outcome.estimated_noise()?;
            return Some(Self {
                position: Estimate::of_sigma(sigma, independent)?,
                degrees_of_freedom: independent,
                stated: None,
                tolerated,
            });
        };
        // Σ(r/σ)²: the arms' sums; with the other methods each is a third of the robot's.
        let squares: f64 = arms
            .iter()
            .map(|arm| effective_samples(arm) * arm.residual_rms.powi(2))
            .sum();
        let ratio = (squares / freedom).sqrt();
        let worst = method.separates_arms().then(|| {
            ArmIndex::ALL
                .into_iter()
                .zip(arms)
                .map(|(arm, outcome)| {
                    let freedom = outcome.degrees_of_freedom.max(1.0);
                    (
                        arm,
                        outcome.residual_rms * (effective_samples(outcome) / freedom).sqrt(),
                    )
                })
                .fold((ArmIndex::First, 0.0), |worst, next| {
                    if next.1 > worst.1 { next } else { worst }
                })
        });
        let test = Self::against(&noise, ratio, independent, worst)?;
        Some(Self { tolerated, ..test })
    }

    /// How many times the stated noise the residuals say, judged by χ² with that many degrees of
    /// freedom.
    pub(crate) fn against(
        noise: &Noise<f64>,
        ratio: f64,
        freedom: f64,
        worst: Option<(ArmIndex, f64)>,
    ) -> Option<Self> {
        let chi_square = ChiSquared::new(freedom).ok()?;
        let squares = ratio * ratio * freedom;
        let (below, above) = (chi_square.cdf(squares), chi_square.sf(squares));
        let probability = (2.0 * below.min(above)).min(1.0);
        let verdict = if probability >= IMPROBABLE {
            NoiseVerdict::Agrees
        } else if ratio > EXCEEDED {
            NoiseVerdict::Understated
        } else if ratio < SMALL {
            NoiseVerdict::Overstated
        } else {
            NoiseVerdict::Agrees
        };
        let ratio = Estimate::of_sigma(ratio, freedom)?;
        Some(Self {
            position: ratio.times(noise.position()),
            degrees_of_freedom: freedom,
            stated: Some(StatedNoise {
                ratio,
                probability,
                verdict,
                worst,
            }),
            tolerated: None,
        })
    }

    /// By what to multiply every σ that was computed with a stated noise: by how many times the
    /// residuals exceed it, if that is no chance or has a cause that was found; otherwise 1. An
    /// estimated noise holds its lack of fit already.
    pub(crate) fn widening(&self, cause_found: bool) -> f64 {
        self.stated.map_or(1.0, |stated| {
            if cause_found || stated.verdict == NoiseVerdict::Understated {
                stated.ratio.value.max(1.0)
            } else {
                1.0
            }
        })
    }

    /// Whether residuals that are taken for noise, as none is stated, are larger than the tolerance
    /// lets the robot be off. They would keep any robot near where it was, whatever the samples are.
    pub(crate) fn beyond_tolerance(&self) -> bool {
        let [low, _] = self.position.interval;
        self.stated.is_none() && self.tolerated.is_some_and(|tolerated| low > tolerated)
    }

    /// That the samples say little against the tolerance, if they do.
    pub(crate) fn says_little(&self) -> Option<String> {
        let tolerated = self.tolerated.filter(|_| self.stated.is_none())?;
        (self.position.value > LITTLE * tolerated).then(|| {
            format!(
                "no [noise] is stated, so the program takes the residuals for noise: {} in each \
                 coordinate, while the tolerance lets the robot be off by {} mm. Therefore the \
                 samples have little weight, and the result stays near the robot file. Look for \
                 wrong samples, or state the [noise]",
                self.estimate(),
                significant(tolerated, 3)
            )
        })
    }

    /// What contradicts the stated noise, what follows for the calibration, and what to do; `None` if
    /// nothing does.
    pub(crate) fn doubt(
        &self,
        drive: Drive,
        noise: &Noise<f64>,
        has_tolerance: bool,
        cause_found: bool,
    ) -> Option<String> {
        let stated = self.stated.as_ref()?;
        let ratio = stated.ratio.value;
        let found = self.found(noise);
        let state = statement(drive, noise, ratio);
        match stated.verdict {
            NoiseVerdict::Agrees => None,
            NoiseVerdict::Understated => {
                let most = stated.worst.map_or(String::new(), |(arm, ratio)| {
                    format!(", those of {arm} {ratio:.1} times")
                });
                let tolerance = if has_tolerance {
                    ", and the samples have too much weight against the tolerance"
                } else {
                    ""
                };
                let look = if cause_found {
                    String::new()
                } else {
                    format!(
                        ". Either the noise is understated, or samples are outliers, or the robot \
                         has an error that the model does not hold. Look for outliers and play; if \
                         there are none, state {state}"
                    )
                };
                Some(format!(
                    "the robot: the residuals are {ratio:.1} times the stated [noise]{most}: \
                     {found}. So every sigma above is widened at least {ratio:.1} times\
                     {tolerance}{look}"
                ))
            }
            NoiseVerdict::Overstated => {
                let factor = 1.0 / ratio;
                let tolerance = if has_tolerance {
                    ", and the tolerance has too much weight against the samples"
                } else {
                    ""
                };
                Some(format!(
                    "the robot: the residuals are only {ratio:.2} times the stated [noise], which \
                     seems overstated: {found}. So the sigmas above are {factor:.1} times too \
                     large{tolerance}: state {state}"
                ))
            }
        }
    }

    /// "0.02 mm is stated and the residuals say 0.05 mm (0.046 to 0.055 with 95 % confidence; …)".
    pub fn found(&self, noise: &Noise<f64>) -> String {
        let [low, high] = self.position.interval;
        let chance = self.stated.map_or(String::new(), |stated| {
            let probability = stated.probability;
            if probability < 1e-4 {
                "; by chance that happens in less than 1 of 10 000 calibrations".to_owned()
            } else {
                format!(
                    "; by chance that happens in {} of all calibrations",
                    percentage(probability)
                )
            }
        });
        let joints = if noise.joint() > 0.0 {
            ", with the joints' in proportion"
        } else {
            ""
        };
        format!(
            "{} mm is stated, and the residuals show {} mm ({} to {} with 95 % \
             confidence{joints}{chance})",
            noise.position(),
            significant(self.position.value, 3),
            significant(low, 3),
            significant(high, 3),
        )
    }

    /// The noise that is not stated: "0.021 mm (0.019 to 0.024 with 95 % confidence)".
    pub fn estimate(&self) -> String {
        let [low, high] = self.position.interval;
        format!(
            "{} mm ({} to {} with 95 % confidence)",
            significant(self.position.value, 3),
            significant(low, 3),
            significant(high, 3)
        )
    }
}

/// What to write into the robot file.
pub(crate) fn statement(drive: Drive, noise: &Noise<f64>, ratio: f64) -> String {
    let position = format!("position_mm = {}", significant(ratio * noise.position(), 3));
    if noise.joint() > 0.0 {
        let joint = significant(ratio * joint::in_file(drive, noise.joint()), 3);
        let key = joint::key("joint", drive);
        format!(
            "{position} and {key} = {joint} (both are scaled alike; leave the one that you know to be right), if repeated \
             measurements scatter as much"
        )
    } else {
        format!("{position}, if repeated measurements scatter as much")
    }
}

/// How many residuals there are: with a robust fit's weights fewer than samples.
fn effective_samples(arm: &ArmOutcome<f64>) -> f64 {
    arm.degrees_of_freedom + 8.0 - arm.prior_share.sum()
}

/// The closure errors of the three arms share the position's noise, so their squares tell less of it
/// than as many independent ones. With C their correlations at each sample, Σ(r/σ)² has the mean and
/// variance of a χ² with (tr C)²/tr C² degrees of freedom a sample in place of 3 (Satterthwaite 1946).
fn independent_share(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    noise: Option<&Noise<f64>>,
) -> f64 {
    let (mut traces, mut squares) = (0.0, 0.0);
    for sample in samples {
        let x = &sample.position;
        let arms = robot.arms().iter().zip(sample.joints);
        // ∂f/∂X of each arm in σ of its closure error: their products are the correlations.
        let by_position: Vec<_> = arms
            .map(|(arm, q)| {
                let gradient = arm.constraint_by_position(x, q);
                let sigma = noise.map_or(gradient.norm(), |noise| {
                    let by_joint = arm.constraint_by_joint(x, q) * noise.joint();
                    (gradient.norm() * noise.position()).hypot(by_joint) / noise.position()
                });
                gradient / sigma
            })
            .collect();
        for (i, first) in by_position.iter().enumerate() {
            for (j, second) in by_position.iter().enumerate() {
                let correlation = if i == j { 1.0 } else { first.dot(second) };
                squares += correlation * correlation;
            }
        }
        traces += 3.0;
    }
    if squares > 0.0 { traces / squares } else { 1.0 }
}
