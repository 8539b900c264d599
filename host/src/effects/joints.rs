//! Errors of a joint: what it reads is not its angle or travel.

use super::{Effect, EffectKind, Place};

/// Error of a joint at its reading q per unit of each unknown.
pub(super) fn turns(
    effect: &Effect,
    q: f64,
    (low, high): (f64, f64),
    row: usize,
    place: &Place,
    arm: usize,
) -> Vec<f64> {
    match effect.kind {
        EffectKind::GearRatio => vec![q],
        EffectKind::Eccentricity => vec![q.cos(), q.sin()],
        EffectKind::SecondHarmonic => vec![(2.0 * q).cos(), (2.0 * q).sin()],
        EffectKind::UnevenTravel if high > low => {
            let part = (2.0 * q - low - high) / (high - low);
            vec![part * part]
        }
        EffectKind::Backlash => vec![place.directions[arm]],
        EffectKind::Slip if row >= effect.index => vec![1.0],
        _ => vec![0.0],
    }
}
