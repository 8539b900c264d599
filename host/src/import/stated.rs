//! Values that a printer's owner states beside the configuration: `345±0.1mm`, `100=98.5`, `0.3%`.

use crate::files::columns;
use crate::files::length::Measured;

/// Values that the owner states beside the configuration. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stated {
    /// The lengths of the rods between their joints, as made or measured.
    pub rods: Option<[f64; 3]>,
    /// The delta radius as measured: that of the towers minus that of the platform.
    pub radius: Option<f64>,
    /// σ of the length common to all rods; 1 mm if not stated.
    pub rods_sigma: Option<f64>,
    /// σ of the radius; 1 mm if not stated.
    pub radius_sigma: Option<f64>,
    /// The nominal and the measured length of a printed part.
    pub printed: Option<[f64; 2]>,
    /// The fraction by which prints shrink.
    pub shrinkage: Option<f64>,
    /// The radius and the rods as first configured, and those pasted in their place, as a comment of the configuration
    /// states them.
    pub kept: Option<[[f64; 4]; 2]>,
}

impl Stated {
    /// With one length for all rods, or three; with none the rods are as configured.
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

    /// With a delta radius; without one it is as configured.
    #[must_use]
    pub fn with_radius(mut self, radius: Option<Measured>) -> Self {
        self.radius = radius.map(|own| own.length);
        self.radius_sigma = radius.and_then(|own| own.sigma);
        self
    }
}

/// Printed lengths are off by less, as a part of the designed length.
const OFF: f64 = 0.1;

/// Parses the nominal and the measured length of a printed part, mm.
///
/// # Errors
/// Anything but two lengths that are nearly the same.
pub fn printed(text: &str) -> Result<[f64; 2], String> {
    let number = |text| Some(columns::length(text)?.0).filter(|own| *own > 0.0);
    let pair = text.split_once('=');
    pair.and_then(|(wanted, is)| Some([number(wanted)?, number(is)?]))
        .filter(|[wanted, is]| (is / wanted - 1.0).abs() < OFF)
        .ok_or_else(|| {
            "two lengths in mm within 10 % of each other are needed, as 100=98.5".to_owned()
        })
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
