//! What an owner states beside a configuration, as options write it: `345±0.1mm`, `100=98.5`, `0.3%`.

use crate::files::columns;
use crate::files::length::Measured;

/// What an owner states beside the configuration. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stated {
    /// The rods as made or measured, between their joints.
    pub rods: Option<[f64; 3]>,
    /// The radius of the towers less the platform's, as measured.
    pub radius: Option<f64>,
    /// One σ of these that all rods, or all towers, have in common; 1 mm if it is not stated.
    pub rods_sigma: Option<f64>,
    /// The radius' own.
    pub radius_sigma: Option<f64>,
    /// A length that was to be printed, and what it came out as.
    pub printed: Option<[f64; 2]>,
    /// The fraction by which prints shrink.
    pub shrinkage: f64,
}

impl Stated {
    /// With one length for all rods, or three; as they are configured with none.
    ///
    /// # Errors
    /// Another number of lengths.
    pub fn with_rods(mut self, rods: &[Measured]) -> Result<Self, &'static str> {
        self.rods = match rods {
            [] => None,
            [all] => Some([all.length; 3]),
            [a, b, c] => Some([a.length, b.length, c.length]),
            _ => return Err("needs one length, or three"),
        };
        self.rods_sigma = rods.iter().filter_map(|own| own.sigma).reduce(f64::max);
        Ok(self)
    }

    /// With the radius of the towers less the platform's; as it is configured with none.
    #[must_use]
    pub fn with_radius(mut self, radius: Option<Measured>) -> Self {
        self.radius = radius.map(|own| own.length);
        self.radius_sigma = radius.and_then(|own| own.sigma);
        self
    }
}

/// Parses the nominal and the measured length of a printed part, mm.
///
/// # Errors
/// Anything but two lengths.
pub fn printed(text: &str) -> Result<[f64; 2], String> {
    let number = |text| Some(columns::length(text)?.0).filter(|own| *own > 0.0);
    let pair = text.split_once('=');
    pair.and_then(|(wanted, is)| Some([number(wanted)?, number(is)?]))
        .ok_or_else(|| "two lengths in mm are needed, as 100=98.5".to_owned())
}

/// Parses a shrinkage as a fraction of the length.
///
/// # Errors
/// Anything but a percentage of up to 10.
pub fn shrinkage(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('%').map(|own| own.trim().parse());
    match number {
        Some(Ok(percent)) if (-10.0..=10.0).contains(&percent) => Ok(0.01 * percent),
        _ => Err("a percentage of up to 10 is needed, as 0.3%".to_owned()),
    }
}
