//! Numbers in sentences.

use delta_cal::Parameter;
use delta_cal::robot::ParameterKind;

/// "1 sample", "2 samples".
pub fn count(number: usize, singular: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {singular}{plural}")
}

/// With a large first letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
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

/// Lines that a sentence names.
const LINES_NAMED: usize = 8;

/// "line 7", "lines 7 and 9", "lines 7, 9, ... and 24 (and 3 more)".
pub fn in_lines(lines: &[u64]) -> String {
    in_lines_of(lines, lines.len())
}

/// The same of so many lines, of which some are known.
pub(crate) fn in_lines_of(lines: &[u64], count: usize) -> String {
    let named = lines.iter().take(LINES_NAMED).map(u64::to_string);
    let others = match count.saturating_sub(lines.len().min(LINES_NAMED)) {
        0 => String::new(),
        others => format!(" (and {others} more)"),
    };
    let noun = if count == 1 { "line" } else { "lines" };
    format!("{noun} {}{others}", list(&named.collect::<Vec<_>>()))
}

/// Millimetres, degrees or a ratio, of a parameter in millimetres, radians or no unit.
pub fn in_file_units(parameter: Parameter, value: f64) -> String {
    match parameter.kind() {
        ParameterKind::Length => format!("{value:.3} mm"),
        ParameterKind::Angle => format!("{:.3}°", value.to_degrees()),
        ParameterKind::Ratio => format!("{value:.5}"),
    }
}

/// The number that a text like `-12,5` means.
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
