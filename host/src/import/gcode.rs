//! The lines M665 and M666 of RepRapFirmware and Marlin.

use super::imported::Imported;
use super::linear::LinearPrinter;
use super::measured::Saved;
use super::robot_text::{self, Beside};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use std::collections::BTreeMap;

/// Which firmware the lines are of: they give letters other meanings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Firmware {
    /// RepRapFirmware: `M665 L R H B X Y Z`, `M666 X Y Z` upwards.
    RepRapFirmware,
    /// Marlin: `M665 L R H X Y Z A B C`, `M666 X Y Z`, 0 or negative, downwards from the end stop.
    Marlin,
}

impl Firmware {
    /// In sentences.
    pub const fn title(self) -> &'static str {
        match self {
            Self::RepRapFirmware => "RepRapFirmware",
            Self::Marlin => "Marlin",
        }
    }
}

/// A rod is off by less than this, mm: RepRapFirmware's B, the bed's radius, is more.
const LARGEST_TRIM: f64 = 10.0;

const COMMANDS: [&str; 2] = ["M665", "M666"];

/// The words of M665 and M666, the later ones in place of the earlier, each with its line.
struct Words<'a> {
    input: &'a InputText,
    values: BTreeMap<(&'static str, char), (u64, Vec<f64>)>,
}

impl<'a> Words<'a> {
    fn read(input: &'a InputText) -> Result<Self, InputError> {
        let mut words = Self {
            input,
            values: BTreeMap::new(),
        };
        for (line, own) in (1..).zip(input.text().lines()) {
            // What a controller prints before a command.
            let own = own.trim_start().trim_start_matches("echo:").trim_start();
            let own = own.split([';', '(']).next().unwrap_or_default();
            let mut parts = own.split_whitespace();
            let Some(command) = parts.next() else {
                continue;
            };
            let known = COMMANDS
                .into_iter()
                .find(|known| command.eq_ignore_ascii_case(known));
            if let Some(command) = known {
                for word in parts {
                    words.add(line, command, word)?;
                }
            }
        }
        Ok(words)
    }

    fn add(&mut self, line: u64, command: &'static str, word: &str) -> Result<(), InputError> {
        let letter = word.chars().next().unwrap_or_default().to_ascii_uppercase();
        let numbers = word.get(1..).unwrap_or_default().split(':');
        let values: Option<Vec<f64>> = numbers
            .map(|text| text.parse::<f64>().ok().filter(|value| value.is_finite()))
            .collect();
        match values {
            Some(values) if letter.is_ascii_alphabetic() => {
                self.values.insert((command, letter), (line, values));
                Ok(())
            }
            _ => Err(self.fault(
                Some(line),
                command,
                "a word of the line is no letter with a finite number",
            )),
        }
    }

    fn fault(&self, line: Option<u64>, key: &str, cause: &str) -> InputError {
        let fault = InputError::new(self.input.name(), cause).at_key(key);
        let fault = match line {
            Some(line) => fault.at_line(line),
            None => fault,
        };
        fault.with_remedy(
            "give the line as the controller prints it: M665 without words (RepRapFirmware), M503 (Marlin)",
        )
    }

    fn all(&self, command: &'static str, letter: char) -> Option<&[f64]> {
        let (_, values) = self.values.get(&(command, letter))?;
        Some(values)
    }

    fn one(&self, command: &'static str, letter: char) -> Option<f64> {
        self.all(command, letter)?.first().copied()
    }

    fn three(&self, command: &'static str, letters: [char; 3]) -> [f64; 3] {
        letters.map(|letter| self.one(command, letter).unwrap_or(0.0))
    }

    fn required(&self, letter: char) -> Result<f64, InputError> {
        let key = format!("M665 {letter}");
        let value = self.one("M665", letter);
        let value = value.ok_or_else(|| self.fault(None, &key, "the word is missing"))?;
        if value > 0.0 {
            return Ok(value);
        }
        let line = self.values.get(&("M665", letter)).map(|(line, _)| *line);
        Err(self.fault(line, &key, "the value is not above 0"))
    }
}

/// Reads the printer of M665 and M666.
///
/// # Errors
/// No M665, a word that is missing or damaged, or an impossible geometry.
pub fn import(input: &InputText, firmware: Firmware) -> Result<Imported, InputError> {
    let words = Words::read(input)?;
    if !words.values.keys().any(|(command, _)| *command == "M665") {
        let cause =
            "no line is an M665 with values, which states the geometry of a Delta with towers";
        return Err(InputError::new(input.name(), cause).with_remedy(
            "give the file that holds it: config.g or config-override.g of RepRapFirmware, or what M503 prints of \
             Marlin",
        ));
    }
    let printer = printer(&words, firmware)?;
    let bed = match firmware {
        Firmware::RepRapFirmware => words.one("M665", 'B').filter(|radius| *radius > 0.0),
        Firmware::Marlin => None,
    };
    let tilts = words.three("M666", ['A', 'B', 'B']);
    let mut notes = Vec::new();
    if firmware == Firmware::RepRapFirmware && tilts.iter().any(|tilt| tilt.abs() > 0.0) {
        notes.push(
            "The tilt of the bed (M666 A and B) is left out: measure heights above the bed."
                .to_owned(),
        );
    }
    let high = printer.home().into_iter().fold(f64::MIN, f64::max);
    let out = bed.unwrap_or(0.6 * printer.radius);
    let lows = printer.azimuths.map(|azimuth| {
        let (sine, cosine) = azimuth.to_radians().sin_cos();
        printer
            .inverse([-out * cosine, -out * sine, 0.0])
            .map_or(f64::INFINITY, |carriages| {
                carriages.into_iter().fold(f64::INFINITY, f64::min)
            })
    });
    let low = lows.into_iter().fold(f64::INFINITY, f64::min);
    let low = if low.is_finite() { low.floor() } else { 0.0 };
    let beside = Beside {
        controller: firmware.title(),
        source: input.name(),
        limits: [low, high],
        heights: false,
        notes: &notes,
    };
    let robot_text = robot_text::linear(&printer, &beside);
    let robot = RobotFile::read(&InputText::new(input.name(), &robot_text))?;
    Ok(Imported {
        source: input.name().to_owned(),
        robot,
        robot_text,
        samples_text: None,
        saved: Saved::default(),
        home: printer.home(),
        printer: Some(printer),
        bed_radius: bed,
        notes,
    })
}

fn printer(words: &Words<'_>, firmware: Firmware) -> Result<LinearPrinter, InputError> {
    let radius = words.required('R')?;
    let rod = words.required('L')?;
    let height = words.one("M665", 'H');
    let height = height.ok_or_else(|| words.fault(None, "M665 H", "the word is missing"))?;
    let corrections = words.three("M665", ['X', 'Y', 'Z']);
    let mut azimuths = [210.0, 330.0, 90.0];
    for (azimuth, by) in azimuths.iter_mut().zip(corrections) {
        *azimuth += by;
    }
    let stops = words.three("M666", ['X', 'Y', 'Z']);
    let (rods, endstops) = match firmware {
        Firmware::RepRapFirmware => {
            let each = words.all("M665", 'L').unwrap_or_default();
            let rods = [0, 1, 2].map(|tower| each.get(tower).copied().unwrap_or(rod));
            (rods, stops.map(|by| height + by))
        }
        Firmware::Marlin => {
            let trims = words.three("M665", ['A', 'B', 'C']);
            refuse_trims(words, trims)?;
            (trims.map(|by| rod + by), stops.map(|by| height - by))
        }
    };
    if !rods.iter().all(|rod| *rod > radius) {
        let line = words.values.get(&("M665", 'L')).map(|(line, _)| *line);
        return Err(words.fault(line, "M665 L", "a rod is not longer than the radius R"));
    }
    Ok(LinearPrinter {
        radius,
        azimuths,
        rods,
        endstops,
    })
}

/// RepRapFirmware gives the same letter another meaning, so its file would make wrong rods here.
fn refuse_trims(words: &Words<'_>, trims: [f64; 3]) -> Result<(), InputError> {
    let trims = ['A', 'B', 'C'].into_iter().zip(trims);
    let Some((letter, trim)) = trims
        .into_iter()
        .find(|(_, trim)| trim.abs() > LARGEST_TRIM)
    else {
        return Ok(());
    };
    let line = words.values.get(&("M665", letter)).map(|(line, _)| *line);
    let cause = format!(
        "{letter} corrects the length of a rod in Marlin, and {trim} mm is too much for that; in RepRapFirmware B is \
         the radius of the bed"
    );
    let key = format!("M665 {letter}");
    Err(words.fault(line, &key, &cause).with_remedy(
        "if RepRapFirmware wrote the file, use delta-cal import reprapfirmware; otherwise correct the value",
    ))
}
