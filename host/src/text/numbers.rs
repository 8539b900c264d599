//! Numbers with as many digits as they deserve.

/// Three digits of a number that may be tiny.
pub(crate) fn small(value: f64) -> String {
    if value == 0.0 || value >= 1e-3 {
        format!("{value:.4}")
    } else {
        format!("{value:.1e}")
    }
}

/// Three significant digits, without an exponent where that is readable.
pub(crate) fn significant(value: f64) -> String {
    if !(value.abs() >= 1e-6 && value.is_finite()) {
        return format!("{value:.1e}");
    }
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 8.0);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 8
    let digits = digits as usize;
    format!("{value:.digits$}")
}
