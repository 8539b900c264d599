//! Configurations of other controllers, read into a robot, its readings and its end stops.
//!
//! ```text
//! printer.cfg ──────────────┬→ Settings ─→ Machine, steps at each reading ─→ Imported ─→ robot.toml, samples.csv
//! words of M665 and M666 ───┘
//! ```
//!
//! A configuration may contain secrets: sections that are not needed are not kept, and no message quotes a line.

mod configuration;
mod console;
mod gcode;
mod header;
mod imported;
mod klipper;
mod probe;
mod rotary;
mod settings;
mod stated;

use crate::files::{InputError, InputText};
pub use console::touched;
pub use imported::Imported;
pub(crate) use imported::{OF_PROBE, SHRINKAGE, USUAL_TOWERS, kept, lowered, print_within};
pub use stated::{Length, Stated, lengths, printed, shrinkage};
use std::path::Path;

/// Returns the files that a line includes, sorted, given the name of the file with the line and the included name or
/// pattern.
pub type Includes<'a> = dyn Fn(&str, &str) -> Result<Vec<InputText>, InputError> + 'a;

/// A firmware with Delta kinematics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Firmware {
    /// `printer.cfg`.
    Klipper,
    /// `config.g`: `M665 L R H B X Y Z`, `M666 X Y Z` upwards.
    RepRapFirmware,
    /// Its YAML file with `parallel_delta`.
    FluidNc,
    /// Output of `$$`, or the settings by name.
    GrblHal,
    /// Output of `M503`, or `Configuration.h`: `M665 L R H X Y Z A B C`, `M666 X Y Z` downwards from the end stop.
    Marlin,
    /// Output of `M503`, or `config`: `M665 L R Z A B C D E H`, `M666` as Marlin's.
    Smoothieware,
    /// Output of `M205`.
    Repetier,
}

/// What a firmware calls things.
pub(crate) struct Words {
    /// On the command line, and as the export target.
    name: &'static str,
    /// In sentences.
    title: &'static str,
    /// What states where the probe is beside the nozzle.
    pub(crate) offset: &'static str,
    /// The length of a rotary robot's forearms.
    pub(crate) forearm: &'static str,
    /// What touches the bed; empty if there is no such command.
    pub(crate) touch: &'static str,
}

impl Firmware {
    /// All.
    pub const ALL: [Self; 7] = [
        Self::Klipper,
        Self::RepRapFirmware,
        Self::Marlin,
        Self::Smoothieware,
        Self::Repetier,
        Self::FluidNc,
        Self::GrblHal,
    ];

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|own| own.name() == name)
    }

    /// Its words.
    pub(crate) const fn words(self) -> Words {
        const KLIPPER: &str = "x_offset and y_offset of [probe]";
        let [name, title, offset, forearm, touch] = match self {
            Self::Klipper => ["klipper", "Klipper", KLIPPER, "lower_arm_length", "PROBE"],
            Self::RepRapFirmware => [
                "reprapfirmware",
                "RepRapFirmware",
                "G31 X Y",
                "M669 L",
                "G30 S-1",
            ],
            Self::Marlin => ["marlin", "Marlin", "M851 X Y", "M665 L", "G30"],
            Self::Smoothieware => ["smoothieware", "Smoothieware", "M565 X Y", "M665 L", "G30"],
            Self::Repetier => ["repetier", "Repetier", "EPR 800 and 804", "EPR 881", "G30"],
            Self::FluidNc => ["fluidnc", "FluidNC", "M851 X Y", "linkage_mm", ""],
            Self::GrblHal => ["grblhal", "grblHAL", "M851 X Y", "Forearm length", ""],
        };
        Words {
            name,
            title,
            offset,
            forearm,
            touch,
        }
    }

    /// The name on the command line, and of the export target.
    pub const fn name(self) -> &'static str {
        self.words().name
    }

    /// The name in sentences.
    pub const fn title(self) -> &'static str {
        self.words().title
    }

    /// The firmware of a configuration, if it is evident.
    pub(crate) fn wrote(input: &InputText) -> Option<Self> {
        let is_smoothieware = |own: &str| {
            let code = own.split(';').next().unwrap_or_default();
            let words = code.split_once("M665").map_or("", |own| own.1);
            words
                .split_whitespace()
                .any(|own| own.starts_with(['D', 'E']))
        };
        let lines = || input.text().lines().map(str::trim_start);
        let begins = |line: &str, starts: &[&str]| starts.iter().any(|own| line.starts_with(own));
        let any = |starts: &[&str]| lines().any(|line| begins(line, starts));
        if any(&["[printer]", "[include"]) {
            return Some(Self::Klipper);
        }
        if any(&["arm_solution", "arm_length", ";Max Z"]) || lines().any(is_smoothieware) {
            return Some(Self::Smoothieware);
        }
        if input.text().contains("EPR:") {
            return Some(Self::Repetier);
        }
        // A line of M503, which a log may precede with the time; the comments of a Duet may say anything.
        let answered = |line: &str| {
            let code = line.split(';').next().unwrap_or_default();
            let answer = code.split_once("echo:").map(|(_, own)| own.trim_start());
            // Marlin 2.1 answers M665 without an echo, but with the segments of a second.
            let all = |letters: [char; 3]| {
                letters
                    .iter()
                    .all(|own| code.split_whitespace().any(|word| word.starts_with(*own)))
            };
            answer.is_some_and(|own| own.starts_with("M665") || own.starts_with("M666"))
                || code.trim_start().starts_with("M665 ") && all(['L', 'H', 'S'])
        };
        if lines().any(|line| answered(line) || line.starts_with("#define DELTA_")) {
            return Some(Self::Marlin);
        }
        if any(&["parallel_delta:"]) {
            return Some(Self::FluidNc);
        }
        if any(&["$641=", "Bicep length"]) {
            return Some(Self::GrblHal);
        }
        // What RepRapFirmware answers to M665.
        if input.text().to_ascii_lowercase().contains("homed height") {
            return Some(Self::RepRapFirmware);
        }
        let of_duet = Path::new(input.name())
            .extension()
            .is_some_and(|own| own == "g");
        (of_duet || any(&["M550", "M551", "M552", "M563", "M584", "M950"]))
            .then_some(Self::RepRapFirmware)
    }

    /// The firmware of a configuration.
    ///
    /// # Errors
    /// No known firmware, or RepRapFirmware or Marlin: their `M666` have opposite signs.
    pub fn of(input: &InputText) -> Result<Self, InputError> {
        if let Some(own) = Self::wrote(input) {
            return Ok(own);
        }
        let (cause, remedy) = if input.text().contains("M665") {
            (
                "M665 and M666 differ between RepRapFirmware and Marlin",
                "use delta-cal import reprapfirmware or delta-cal import marlin",
            )
        } else {
            (
                "the file is not a configuration of a known firmware",
                "give printer.cfg, config.g, the output of M503, M205 or $$, Configuration.h or FluidNC's file; calibrate takes it, or a \
                 robot file, before the measurements",
            )
        };
        Err(InputError::new(input.name(), cause).with_remedy(remedy))
    }

    /// Reads a configuration; stated values replace configured ones.
    ///
    /// # Errors
    /// A file of another firmware, not a Delta, a value that is missing or damaged, or an impossible geometry.
    pub fn import(
        self,
        input: &InputText,
        stated: &Stated,
        includes: &Includes<'_>,
    ) -> Result<Imported, InputError> {
        if let Some(other) = Self::wrote(input).filter(|own| *own != self) {
            let cause = format!("this file is {}'s", other.title());
            let remedy = format!(
                "use delta-cal import {}: its numbers have another meaning",
                other.name()
            );
            return Err(InputError::new(input.name(), cause).with_remedy(remedy));
        }
        let stated = &Stated {
            kept: kept(input.text()).or(stated.kept),
            apart: imported::apart(input.text()),
            ..stated.clone()
        };
        match self {
            Self::Klipper => klipper::import(input, stated, includes),
            Self::FluidNc | Self::GrblHal => rotary::import(input, self, stated),
            _ => gcode::import(input, self, stated, includes),
        }
    }
}
