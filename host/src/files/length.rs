//! Lengths in options: `0.1mm`, `0.1 mm`, `0.3 m`, `250um`, `0.5 in`.

use super::columns;

/// Parses a length greater than 0, in mm.
///
/// # Errors
/// No length, or one without a unit.
pub fn length(text: &str) -> Result<f64, String> {
    match columns::length(text) {
        Some((length, true)) if length > 0.0 => Ok(length),
        Some((_, false)) => {
            let text = text.trim();
            Err(format!(
                "a length needs a unit: {text}mm, {text}um or {text}in"
            ))
        }
        Some(_) => Err("a length greater than 0 is needed, as 0.1mm".to_owned()),
        None => Err("a length in um, mm, cm, m or in is needed, as 0.1mm".to_owned()),
    }
}

/// A measured length: `345mm`, or `345±0.1mm` with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Length, mm.
    pub length: f64,
    /// Standard uncertainty, mm, if stated.
    pub sigma: Option<f64>,
}

/// Parses a measured length.
///
/// # Errors
/// As [`length`].
pub fn measured(text: &str) -> Result<Measured, String> {
    let Some((own, sigma)) = text.split_once('±').or(text.split_once("+-")) else {
        let length = length(text)?;
        return Ok(Measured {
            length,
            sigma: None,
        });
    };
    // In 345±0.1mm the unit applies to both numbers.
    let unit = sigma.trim_start_matches(|own: char| " .0123456789".contains(own));
    Ok(Measured {
        length: length(own).or_else(|_| length(&format!("{own}{unit}")))?,
        sigma: Some(length(sigma)?),
    })
}

#[cfg(test)]
mod tests {
    use super::{length, measured};

    #[test]
    fn a_measured_length_may_state_its_sigma() {
        for (written, expected, sigma) in [
            ("345mm", 345.0, None),
            ("345±0.1mm", 345.0, Some(0.1)),
            ("34.5cm+-100um", 345.0, Some(0.1)),
        ] {
            let own = measured(written).unwrap();
            assert!((own.length - expected).abs() < 1e-9, "{written}: {own:?}");
            let off = own.sigma.unwrap_or(0.0) - sigma.unwrap_or(0.0);
            assert!(off.abs() < 1e-9, "{written}: {own:?}");
        }
        assert!(measured("345±0.1").is_err());
    }

    #[test]
    fn a_length_is_the_same_in_every_unit() {
        for (written, expected) in [
            ("0.1mm", 0.1),
            ("0.1 mm", 0.1),
            (" 300 mm ", 300.0),
            ("0.3 m", 300.0),
            ("0.3m", 300.0),
            ("0.5 in", 12.7),
            ("250um", 0.25),
            ("250 \u{b5}m", 0.25),
            ("250\u{3bc}m", 0.25),
            ("5e-5m", 0.05),
            ("1e-2 cm", 0.1),
        ] {
            let found = length(written).unwrap();
            // The tolerance covers two roundings.
            assert!(
                (found - expected).abs() <= 1e-15 * expected,
                "{written}: {found}"
            );
        }
        for (written, part) in [
            ("0.05", "0.05mm"),
            ("300", "300mm"),
            ("", "0.1mm"),
            ("mm", "0.1mm"),
            ("0mm", "greater than 0"),
            ("-1mm", "greater than 0"),
            ("0.1km", "um, mm, cm, m or in"),
            ("5deg", "0.1mm"),
            ("0,05mm", "0.1mm"),
            ("nan", "0.1mm"),
            ("inf mm", "0.1mm"),
            ("1e308m", "0.1mm"),
            ("5 m m", "0.1mm"),
        ] {
            let refused = length(written).unwrap_err();
            assert!(refused.contains(part), "{written}: {refused}");
        }
    }
}
