//! Configurations of other controllers, read into a robot, its readings and what to know for writing it back.
//!
//! ```text
//! printer.cfg ─→ Configuration ─→ arms, steps at each reading ─┐
//! config.g ─→ words of M665 and M666 ─→ arms ──────────────────┴→ Imported ─→ robot.toml, samples.csv
//! ```
//!
//! A configuration may hold secrets: nothing of a section that is not needed is kept, and no message quotes a
//! line.

pub mod configuration;
mod gcode;
mod imported;
mod klipper;

use crate::files::input::{InputError, InputText};
pub use configuration::Includes;
pub use imported::Imported;
use std::path::Path;

/// Whose configuration it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Firmware {
    /// `printer.cfg`.
    Klipper,
    /// `config.g`: `M665 L R H B X Y Z`, `M666 X Y Z` upwards.
    RepRapFirmware,
    /// What `M503` prints: `M665 L R H X Y Z A B C`, `M666 X Y Z` downwards from the end stop.
    Marlin,
}

impl Firmware {
    /// All.
    pub const ALL: [Self; 3] = [Self::Klipper, Self::RepRapFirmware, Self::Marlin];

    /// On the command line, and of the export's target.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Klipper => "klipper",
            Self::RepRapFirmware => "reprapfirmware",
            Self::Marlin => "marlin",
        }
    }

    /// In sentences.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Klipper => "Klipper",
            Self::RepRapFirmware => "RepRapFirmware",
            Self::Marlin => "Marlin",
        }
    }

    /// Which one wrote a configuration.
    ///
    /// # Errors
    /// None, or RepRapFirmware or Marlin: their `M666` have opposite signs.
    pub fn of(input: &InputText) -> Result<Self, InputError> {
        let text = input.text();
        let mut lines = text.lines().map(str::trim_start);
        if lines
            .clone()
            .any(|line| line.starts_with("[printer]") || line.starts_with("[include"))
        {
            return Ok(Self::Klipper);
        }
        if !lines.any(|line| line.contains("M665")) {
            let cause = "the file is no configuration of Klipper, RepRapFirmware or Marlin";
            return Err(InputError::new(input.name(), cause)
                .with_remedy("give printer.cfg, config.g, what M503 prints, or a robot file"));
        }
        if Path::new(input.name())
            .extension()
            .is_some_and(|own| own == "g")
        {
            return Ok(Self::RepRapFirmware);
        }
        if text.contains("echo:") {
            return Ok(Self::Marlin);
        }
        let cause = "M665 and M666 have other meanings in RepRapFirmware than in Marlin";
        Err(InputError::new(input.name(), cause)
            .with_remedy("use delta-cal import reprapfirmware or delta-cal import marlin"))
    }

    /// Reads a configuration. `rods`, mm, take the place of its own.
    ///
    /// # Errors
    /// No Delta, a value that is missing or damaged, or an impossible geometry.
    pub fn import(
        self,
        input: &InputText,
        rods: Option<[f64; 3]>,
        includes: &Includes<'_>,
    ) -> Result<Imported, InputError> {
        match self {
            Self::Klipper => klipper::import(input, rods, includes),
            Self::RepRapFirmware | Self::Marlin => gcode::import(input, self, rods),
        }
    }
}
