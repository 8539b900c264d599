//! What the residuals say of the noise.

use crate::calibration::noise_test::NoiseTest;
use crate::text::units::degrees;
use delta_cal::Noise;
use serde::Serialize;

/// The noise as the residuals have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonNoise {
    /// One σ of each coordinate; with a stated noise the joints' is taken to be in proportion.
    pub position_mm: f64,
    /// Its 95 % confidence limits.
    pub position_limits_mm: [f64; 2],
    /// Residuals less parameters, fewer where they share the position's noise.
    pub degrees_of_freedom: f64,
    /// By how much the stated tolerance lets the robot be off in each coordinate, in half of the
    /// measured poses; `null` if no tolerance is stated.
    pub tolerated_mm: Option<f64>,
    /// Against the stated noise; `null` if there is none.
    pub stated: Option<JsonStatedNoise>,
}

/// The χ² test of the stated noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JsonStatedNoise {
    /// As stated.
    pub position_mm: f64,
    /// As stated.
    pub joint_deg: f64,
    /// How many times the stated noise the residuals say; 1 is expected.
    pub ratio: f64,
    /// Its 95 % confidence limits.
    pub ratio_limits: [f64; 2],
    /// Of residuals as improbable if the noise is as stated, two-sided.
    pub probability: f64,
    /// `agrees`, `understated` or `overstated`.
    pub verdict: &'static str,
}

impl JsonNoise {
    pub(super) fn new(test: &NoiseTest, stated: Option<&Noise<f64>>) -> Self {
        Self {
            position_mm: test.position.value,
            position_limits_mm: test.position.interval,
            degrees_of_freedom: test.degrees_of_freedom,
            tolerated_mm: test.tolerated,
            stated: stated
                .zip(test.stated)
                .map(|(noise, stated)| JsonStatedNoise {
                    position_mm: noise.position(),
                    joint_deg: degrees(noise.joint()),
                    ratio: stated.ratio.value,
                    ratio_limits: stated.ratio.interval,
                    probability: stated.probability,
                    verdict: stated.verdict.name(),
                }),
        }
    }
}
