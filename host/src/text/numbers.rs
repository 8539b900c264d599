//! Numbers with as many digits as they deserve.

/// Four decimals, or two digits of a number that is tiny.
pub fn small(value: f64) -> String {
    if value == 0.0 || value >= 1e-3 {
        format!("{value:.4}")
    } else {
        format!("{value:.1e}")
    }
}

/// The same of a number that may not be known: then it is `otherwise`.
pub fn small_or(otherwise: &str, value: Option<f64>) -> String {
    value.map_or_else(|| otherwise.to_owned(), small)
}

/// A length, or that it is not known.
pub fn millimetres(value: f64) -> String {
    if value.is_finite() {
        format!("{} mm", small(value))
    } else {
        "unknown".to_owned()
    }
}

/// So many significant digits, without an exponent where that is readable.
pub fn significant(value: f64, digits: u8) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !(value.abs() >= 1e-6 && value.is_finite()) {
        return format!("{value:.1e}");
    }
    let decimals = f64::from(digits) - 1.0 - value.abs().log10().floor();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 12
    let decimals = decimals.clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}

/// A probability as people say it: "80 %", "0.3 %", "less than 1 in 10 000".
pub fn probability(value: f64) -> String {
    let percent = 100.0 * value;
    if value < 1e-4 {
        "less than 1 in 10 000".to_owned()
    } else if percent < 0.1 {
        format!("{percent:.2} %")
    } else if percent < 2.0 {
        format!("{percent:.1} %")
    } else if percent > 99.0 && percent < 100.0 {
        "more than 99 %".to_owned()
    } else {
        format!("{percent:.0} %")
    }
}

/// A confidence, never rounded up: "97 %", "99.8 %", "more than 99.99 %".
pub fn confidence(value: f64) -> String {
    let percent = 100.0 * value;
    if percent > 99.99 {
        "more than 99.99 %".to_owned()
    } else if percent > 99.0 {
        format!("{:.2} %", (percent * 100.0).floor() / 100.0)
    } else {
        format!("{:.0} %", percent.floor())
    }
}

/// Percent, with two decimals near 100, where they matter.
pub fn percent(value: f64) -> String {
    let text = if (99.0..99.995).contains(&value) {
        format!("{value:.2}")
    } else {
        format!("{:.0}", value.round() + 0.0) // −0 is 0
    };
    text.replace('-', "−")
}

/// Percent of all, never rounded up to all.
pub fn share(value: f64) -> String {
    if value > 99.0 && value < 100.0 {
        format!("{:.1}", value.min(99.9))
    } else {
        format!("{value:.0}")
    }
}

/// To 9 decimals, without trailing zeros.
pub fn rounded(value: f64) -> String {
    let text = format!("{value:.9}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0" } else { short }.to_owned()
}
