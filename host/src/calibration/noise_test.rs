//! What the residuals say of the noise of each kind of reading: χ² against a stated one, and an estimate.

use crate::accuracy::chi_square::quantile;
use crate::files::samples_file::Kind;
use crate::fit::solution::KindNoise;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A stated noise is contradicted below this probability: 3 σ of a normal distribution, two-sided.
const IMPROBABLE: f64 = 0.0027;
/// Noise that is exceeded by less than this is stated well enough, however many samples tell it.
const EXCEEDED: f64 = 1.1;
/// Noise stated larger than it is is cautious; below this part of it, it misleads.
const SMALL: f64 = 0.5;
/// Probability on either side of the interval.
const TAIL: f64 = 0.025;

/// The noise of a kind of reading as the residuals have it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseTest {
    /// Of which readings.
    pub kind: Kind,
    /// One σ of a reading as the robot file states it, mm; `None` if it is estimated.
    pub stated_mm: Option<f64>,
    /// One σ as the residuals have it, mm; with a stated noise the joints' is taken to be in proportion.
    pub sigma_mm: f64,
    /// Its 95 % confidence limits, mm.
    pub limits_mm: [f64; 2],
    /// ν: readings less what the parameters take up of them; of an estimate with that of what is usual.
    pub degrees_of_freedom: f64,
    /// √(Σ(r/σ)²/ν): how many times the stated noise the residuals are; 1 of an estimated one.
    pub ratio: f64,
    /// Of residuals as improbable if the noise is as stated, two-sided; 1 of an estimated noise.
    pub probability: f64,
    /// What follows.
    pub verdict: NoiseVerdict,
}

/// What a χ² test says of a stated noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseVerdict {
    /// None is stated.
    Estimated,
    /// The residuals agree with it, or nearly so.
    Agrees,
    /// They are larger.
    Understated,
    /// They are less than half of it.
    Overstated,
}

impl NoiseTest {
    /// `None` without a degree of freedom.
    pub(crate) fn of(noise: &KindNoise) -> Option<Self> {
        let freedom = if noise.stated {
            noise.freedom
        } else {
            noise.known
        };
        if !(freedom >= 1.0) {
            return None;
        }
        let (ratio, probability, verdict) = if noise.stated {
            against(noise.ratio(), freedom)?
        } else {
            (1.0, 1.0, NoiseVerdict::Estimated)
        };
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
        })
    }

    /// By what to multiply every σ that was computed with this noise: by how many times the residuals exceed it, if that
    /// is no chance or has a cause that was found; otherwise 1.
    pub(crate) fn widening(&self, cause_found: bool) -> f64 {
        if cause_found || self.verdict == NoiseVerdict::Understated {
            self.ratio.max(1.0)
        } else {
            1.0
        }
    }
}

fn against(ratio: f64, freedom: f64) -> Option<(f64, f64, NoiseVerdict)> {
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
    Some((ratio, probability, verdict))
}
