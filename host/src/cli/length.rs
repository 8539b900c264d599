//! A length that is asked for, in any unit.

use std::str::FromStr;

/// Units of a length in mm; the last one ends the others. The micro sign has two code points.
const UNITS: [(&str, f64); 7] = [
    ("nm", 1e-6),
    ("um", 1e-3),
    ("\u{b5}m", 1e-3),
    ("\u{3bc}m", 1e-3),
    ("mm", 1.0),
    ("cm", 10.0),
    ("m", 1e3),
];

/// A length on the command line, mm.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Length(pub(crate) f64);

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, factor) = UNITS
            .into_iter()
            .find_map(|(unit, factor)| Some((text.strip_suffix(unit)?, factor)))
            .unwrap_or((text, 1.0));
        match number.trim().parse::<f64>() {
            Ok(value) if value > 0.0 && (value * factor).is_finite() => Ok(Self(value * factor)),
            _ => Err(
                "a length greater than 0 is needed, in nm, um, mm, cm or m, as 0.05mm or 50um"
                    .to_owned(),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Length;

    #[test]
    fn a_length_is_the_same_in_every_unit() {
        for written in [
            "0.05",
            "0.05mm",
            " 50um",
            "50 \u{b5}m",
            "50\u{3bc}m",
            "5e4nm",
            "0.005cm",
            "5e-5m",
        ] {
            let found = written.parse().map(|Length(length)| length);
            // Two roundings.
            assert!(
                found.is_ok_and(|length| (length - 0.05).abs() < 1e-16),
                "{written}"
            );
        }
        for written in [
            "", "mm", "0", "-1mm", "5kg", "0,05mm", "nan", "inf", "1e308m", "5 m m",
        ] {
            assert!(written.parse::<Length>().is_err(), "{written}");
        }
    }
}
