//! A length as an option states it: `0.1mm`, `0.1 mm`, `0.3 m`, `250um`, `0.5 in`.

use crate::files::columns::length;
use std::fmt;
use std::str::FromStr;

/// A length on the command line: greater than 0, in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Length(pub(crate) f64);

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match length(text) {
            Some((length, true)) if length > 0.0 => Ok(Self(length)),
            Some((_, false)) => {
                let text = text.trim();
                Err(format!(
                    "a length needs a unit: {text}mm, {text}um or {text}in"
                ))
            }
            _ => Err("a length greater than 0 is needed, as 0.1mm, 50um, 0.3m or 0.5in".to_owned()),
        }
    }
}

impl fmt::Display for Length {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}mm", self.0)
    }
}

/// A measured length: `345mm`, or `345±0.1mm` with one σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measured {
    /// mm.
    pub(crate) length: f64,
    /// mm, if it is stated.
    pub(crate) sigma: Option<f64>,
}

impl FromStr for Measured {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((length, sigma)) = text.split_once('±').or(text.split_once("+-")) else {
            let Length(length) = text.parse()?;
            return Ok(Self {
                length,
                sigma: None,
            });
        };
        let Length(own) = sigma.parse()?;
        // 345±0.1mm has one unit for both.
        let unit = sigma.trim_start_matches(|own: char| " .0123456789".contains(own));
        let length = length
            .parse()
            .or_else(|_| format!("{length}{unit}").parse());
        let Length(length) = length?;
        Ok(Self {
            length,
            sigma: Some(own),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{Length, Measured};

    #[test]
    fn a_measured_length_may_state_its_sigma() {
        for (written, length, sigma) in [
            ("345mm", 345.0, None),
            ("345±0.1mm", 345.0, Some(0.1)),
            ("34.5cm+-100um", 345.0, Some(0.1)),
        ] {
            let own: Measured = written.parse().unwrap();
            assert!((own.length - length).abs() < 1e-9, "{written}: {own:?}");
            let off = own.sigma.unwrap_or(0.0) - sigma.unwrap_or(0.0);
            assert!(off.abs() < 1e-9, "{written}: {own:?}");
        }
        assert!("345±0.1".parse::<Measured>().is_err());
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
            let Length(found) = written.parse().unwrap();
            // Two roundings.
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
            ("5kg", "0.1mm"),
            ("5deg", "0.1mm"),
            ("0,05mm", "0.1mm"),
            ("nan", "0.1mm"),
            ("inf mm", "greater than 0"),
            ("1e308m", "greater than 0"),
            ("5 m m", "0.1mm"),
        ] {
            let refused = written.parse::<Length>().unwrap_err();
            assert!(refused.contains(part), "{written}: {refused}");
        }
    }
}
