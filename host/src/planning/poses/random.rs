//! Random numbers for drawing poses.

use rand_core::Rng;

/// A number from [0, 1).
pub(super) fn uniform<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    // 53 bits: as many as a double holds.
    let bits = rng.next_u64() >> 11;
    #[allow(clippy::cast_precision_loss)] // 53 bits fit
    let number = bits as f64;
    number * f64::EPSILON / 2.0
}
