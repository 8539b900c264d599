//! What the residuals say of the noise.

use crate::calibration::noise_test::NoiseTest;
use crate::text::joint;
use delta_cal::Noise;
use delta_cal::robot::Drive;
use serde_json::{Value, json};

pub(super) fn json(drive: Drive, test: &NoiseTest, stated: Option<&Noise<f64>>) -> Value {
    let stated = stated.zip(test.stated).map(|(noise, stated)| {
        json!({
            "position_mm": noise.position(),
            joint::key("joint", drive): joint::in_file(drive, noise.joint()),
            // How many times the stated noise the residuals say; 1 is expected.
            "ratio": stated.ratio.value,
            // Its 95 % confidence limits.
            "ratio_limits": stated.ratio.interval,
            // Of residuals as improbable if the noise is as stated, two-sided.
            "probability": stated.probability,
            // `agrees`, `understated` or `overstated`.
            "verdict": stated.verdict.name(),
        })
    });
    json!({
        // One σ of each coordinate; with a stated noise the joints' is taken to be in proportion.
        "position_mm": test.position.value,
        // Its 95 % confidence limits.
        "position_limits_mm": test.position.interval,
        // Residuals less parameters, fewer where they share the position's noise.
        "degrees_of_freedom": test.degrees_of_freedom,
        // By how much the stated tolerance lets the robot be off in each coordinate, in half of the
        // measured poses; `null` if no tolerance is stated.
        "tolerated_mm": test.tolerated,
        // The χ² test of the stated noise; `null` if there is none.
        "stated": stated,
    })
}
