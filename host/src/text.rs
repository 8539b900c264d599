//! Numbers, units and lists in sentences.

pub mod joint;

use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::{Parameter, Tolerance};
use std::fmt::Write;

/// Four decimals, or two significant digits for a tiny number.
pub fn small(value: f64) -> String {
    if value == 0.0 || value >= 1e-3 {
        format!("{value:.4}")
    } else {
        format!("{value:.1e}")
    }
}

/// The same, or `otherwise` if the number is unknown.
pub fn small_or(otherwise: &str, value: Option<f64>) -> String {
    value.map_or_else(|| otherwise.to_owned(), small)
}

/// This many significant digits, without an exponent where that is readable.
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

/// Mean, rms and largest of errors, the mean to the decimals of the rms.
pub fn mean_rms_worst([mean, rms, worst]: [f64; 3]) -> [String; 3] {
    let [rms, worst] = [rms, worst].map(|own| significant(own, 2));
    let decimals = rms.split_once('.').map_or(0, |(_, own)| own.len());
    let mean = format!("{mean:.decimals$}");
    let is_zero = mean.parse() == Ok(0.0);
    [if is_zero { "0".to_owned() } else { mean }, rms, worst]
}

/// A probability in everyday form: "80 %", "0.3 %", "less than 1 in 10,000".
pub fn probability(value: f64) -> String {
    let percent = 100.0 * value;
    if value < 1e-4 {
        "less than 1 in 10,000".to_owned()
    } else if percent < 0.1 {
        format!("{percent:.2} %")
    } else if percent < 2.0 {
        format!("{percent:.1} %")
    } else if percent > 99.0 {
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

/// Percent, with two decimals just below 100, where they matter.
pub fn percent(value: f64) -> String {
    let text = if (99.0..99.995).contains(&value) {
        format!("{value:.2}")
    } else {
        format!("{:.0}", value.round() + 0.0) // −0 is 0
    };
    text.replace('-', "−")
}

/// To a tenth; −0 is 0.
pub fn tenths(value: f64) -> f64 {
    (10.0 * value).round() / 10.0 + 0.0
}

/// 9 decimals, without trailing zeros.
pub fn rounded(value: f64) -> String {
    let text = format!("{value:.9}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0" } else { short }.to_owned()
}

/// The angle in degrees that reads back as exactly these radians, if there is one; the shortest to write if there are
/// several.
pub fn degrees(radians: f64) -> f64 {
    let plain = radians.to_degrees();
    let short = (plain * 1e12).round() / 1e12;
    [short, plain, plain.next_up(), plain.next_down()]
        .into_iter()
        .find(|candidate| candidate.to_radians().to_bits() == radians.to_bits())
        .unwrap_or(plain)
}

/// The unit of a parameter in files and reports.
pub const fn unit(parameter: Parameter) -> &'static str {
    match parameter.kind() {
        ParameterKind::Length => "mm",
        ParameterKind::Angle => "deg",
        ParameterKind::Ratio => "",
    }
}

/// A difference or σ of a parameter, in that unit.
pub fn in_unit(parameter: Parameter, value: f64) -> f64 {
    match parameter.kind() {
        ParameterKind::Length | ParameterKind::Ratio => value,
        ParameterKind::Angle => value.to_degrees(),
    }
}

/// "1 sample", "2 samples".
pub fn count(number: usize, singular: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {singular}{plural}")
}

/// The key of a parameter in an `[[arm]]` section.
pub(crate) const fn arm_key(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Dx => "dx_mm",
        Parameter::Dy => "dy_mm",
        Parameter::Dz | Parameter::Zero => "dz_mm",
        Parameter::Theta => "theta_deg",
        Parameter::Alpha => "alpha_deg",
        Parameter::LaX => "la_x_mm",
        Parameter::LaY => "la_y_mm",
        Parameter::Lb => "lb_mm",
        Parameter::LeanX => "lean_x_deg",
        Parameter::LeanY => "lean_y_deg",
        Parameter::Scale => "scale",
    }
}

/// The key of a parameter's own σ in `[tolerance]`; an upper arm has one of its length.
pub(crate) const fn tolerance_key(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Zero => "zero_mm",
        Parameter::LaX | Parameter::LaY => "la_mm",
        other => arm_key(other),
    }
}

/// A parameter or its σ as a robot file has it, which reads back as the same number.
pub(crate) fn in_file(parameter: Parameter, value: f64) -> f64 {
    match parameter.kind() {
        ParameterKind::Length | ParameterKind::Ratio => value,
        ParameterKind::Angle => degrees(value),
    }
}

/// The keys of `[tolerance]` in a robot file, and their values.
pub fn tolerance_keys(drive: Drive, own: &Tolerance<f64>) -> Vec<(&'static str, f64)> {
    let angle = degrees(own.angle());
    let mut keys = vec![("length_mm", own.length()), ("angle_deg", angle)];
    keys.extend(own.joint_zero().map(|zero| ("zero_deg", degrees(zero))));
    for parameter in drive.parameters().iter().copied() {
        let sigma = match parameter {
            Parameter::LaY => None,
            Parameter::Zero | Parameter::Scale => Some(own.of(parameter)),
            _ => own.single(parameter),
        };
        let key = tolerance_key(parameter);
        keys.extend(sigma.map(|sigma| (key, in_file(parameter, sigma))));
    }
    if drive == Drive::Linear {
        let common = [("radius_mm", own.radius()), ("forearm_mm", own.forearm())];
        keys.extend(common.into_iter().filter(|(_, sigma)| *sigma > 0.0));
    }
    keys
}

/// "1 degree of freedom", "7 degrees of freedom".
pub fn freedom(number: f64) -> String {
    let number = format!("{number:.0}");
    let plural = if number == "1" { "" } else { "s" };
    format!("{number} degree{plural} of freedom")
}

/// The text with its first letter in upper case.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        std::iter::once(first.to_ascii_uppercase())
            .chain(letters)
            .collect()
    })
}

/// "a", "a and b", "a, b and c".
pub fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Most lines listed in a sentence.
const LINES_NAMED: usize = 8;

/// "line 7", "lines 7 and 9", "lines 7, 9, ... and 24 (and 3 more)".
pub fn in_lines(lines: &[u64]) -> String {
    let named = lines.iter().take(LINES_NAMED).map(u64::to_string);
    let others = match lines.len().saturating_sub(LINES_NAMED) {
        0 => String::new(),
        others => format!(" (and {others} more)"),
    };
    let noun = if lines.len() == 1 { "line" } else { "lines" };
    format!("{noun} {}{others}", list(&named.collect::<Vec<_>>()))
}

/// A parameter (mm, radians or no unit) in millimetres, degrees or as a ratio.
pub fn in_file_units(parameter: Parameter, value: f64) -> String {
    match parameter.kind() {
        ParameterKind::Length => format!("{value:.3} mm"),
        ParameterKind::Angle => format!("{:.3}°", value.to_degrees()),
        ParameterKind::Ratio => format!("{value:.5}"),
    }
}

/// The number meant by a text like `-12,5`.
pub(crate) fn decimal_comma(text: &str) -> Option<f64> {
    let text = text.trim();
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let (whole, fraction) = text.split_once(',')?;
    let unsigned = whole.trim_start_matches(['-', '+']);
    if !(digits(unsigned) && fraction.starts_with(|c: char| c.is_ascii_digit())) {
        return None;
    }
    format!("{whole}.{fraction}").parse().ok()
}

/// "0.5 mm, 0.2°"; with linear drives "0.5 mm, 0.2°, end stops 5 mm, scale 0.001".
pub fn in_words(drive: Drive, tolerance: &Tolerance<f64>) -> String {
    let mut own = String::new();
    for (key, sigma) in tolerance_keys(drive, tolerance) {
        let name = match key {
            "length_mm" | "angle_deg" => "",
            "zero_deg" => "joint zeros",
            "zero_mm" => "end stops",
            "radius_mm" => "common radius",
            "forearm_mm" => "common forearm",
            other => other.trim_end_matches("_mm").trim_end_matches("_deg"),
        };
        let unit = match key.rsplit_once('_') {
            Some((_, "mm")) => " mm",
            Some(_) => "°",
            None => "",
        };
        let comma = if own.is_empty() { "" } else { ", " };
        let space = if name.is_empty() { "" } else { " " };
        let _ = write!(own, "{comma}{name}{space}{sigma}{unit}");
    }
    own
}

#[cfg(test)]
mod tests {
    use super::degrees;

    #[test]
    fn round_numbers_of_degrees_come_back_round() {
        for written in [-60.0, 90.0, 0.2, 0.002, 120.0, 240.0, 33.3, 0.0] {
            assert!((degrees(f64::to_radians(written)) - written).abs() < f64::MIN_POSITIVE);
        }
    }
}
