//! The lines M665 and M666 of RepRapFirmware and Marlin.

use super::Firmware;
use super::imported::{Imported, Machine, USUAL_TOWERS, rods_note};
use crate::files::input::{InputError, InputText};
use crate::files::samples_file::Readings;
use std::collections::BTreeMap;

/// A rod is off by less than this, mm: RepRapFirmware's B, the bed's radius, is more.
const LARGEST_TRIM: f64 = 10.0;
/// Of the bed, as a part of the towers' radius, if it is not stated.
const USUAL_BED: f64 = 0.6;

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
            let mut known = COMMANDS.into_iter();
            if let Some(command) = known.find(|known| command.eq_ignore_ascii_case(known)) {
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
            _ => {
                let cause = "a word is no letter with a finite number";
                Err(self.fault(command, cause).at_line(line))
            }
        }
    }

    fn fault(&self, key: &str, cause: &str) -> InputError {
        InputError::new(self.input.name(), cause)
            .at_key(key)
            .with_remedy("correct the line, or let the controller write it again")
    }

    /// A fault of a word of M665, in its line if it is there.
    fn fault_of(&self, letter: char, cause: &str) -> InputError {
        let fault = self.fault(&format!("M665 {letter}"), cause);
        match self.values.get(&("M665", letter)) {
            Some((line, _)) => fault.at_line(*line),
            None => fault,
        }
    }

    fn all(&self, command: &'static str, letter: char) -> &[f64] {
        let own = self.values.get(&(command, letter));
        own.map_or(&[], |(_, values)| values)
    }

    fn one(&self, command: &'static str, letter: char) -> Option<f64> {
        self.all(command, letter).first().copied()
    }

    fn three(&self, command: &'static str, letters: [char; 3]) -> [f64; 3] {
        letters.map(|letter| self.one(command, letter).unwrap_or(0.0))
    }

    fn required(&self, letter: char) -> Result<f64, InputError> {
        let value = self.one("M665", letter);
        value.ok_or_else(|| self.fault_of(letter, "the word is missing"))
    }

    fn above_zero(&self, letter: char) -> Result<f64, InputError> {
        let value = self.required(letter)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(self.fault_of(letter, "the value is not above 0"))
        }
    }
}

/// Reads the printer of M665 and M666.
///
/// # Errors
/// No M665, a word that is missing or damaged, or an impossible geometry.
pub(super) fn import(
    input: &InputText,
    firmware: Firmware,
    stated_rods: Option<[f64; 3]>,
) -> Result<Imported, InputError> {
    let words = Words::read(input)?;
    let name = input.name();
    if !words.values.keys().any(|(command, _)| *command == "M665") {
        let cause =
            "no line is an M665 with values, which states the geometry of a Delta with towers";
        return Err(InputError::new(name, cause).with_remedy(
            "give the file that holds it: config.g or config-override.g of RepRapFirmware, or what M503 prints of \
             Marlin",
        ));
    }
    let radius = words.above_zero('R')?;
    let rod = words.above_zero('L')?;
    let height = words.required('H')?;
    let corrections = words.three("M665", ['X', 'Y', 'Z']);
    let azimuths = [0, 1, 2].map(|tower| USUAL_TOWERS[tower] + corrections[tower]);
    let stops = words.three("M666", ['X', 'Y', 'Z']);
    let (configured, endstops) = if firmware == Firmware::Marlin {
        let trims = words.three("M665", ['A', 'B', 'C']);
        refuse_trims(&words, trims)?;
        (trims.map(|by| rod + by), stops.map(|by| height - by))
    } else {
        let each = words.all("M665", 'L');
        let rods = [0, 1, 2].map(|tower| each.get(tower).copied().unwrap_or(rod));
        (rods, stops.map(|by| height + by))
    };
    let rods = stated_rods.unwrap_or(configured);
    if !rods.iter().all(|rod| *rod > radius) {
        return Err(words.fault_of('L', "a rod is not longer than the radius R"));
    }
    let mut notes = Vec::from_iter(rods_note(rods, configured, stated_rods.is_some()));
    let mut bed = None;
    if firmware == Firmware::RepRapFirmware {
        bed = words.one("M665", 'B').filter(|radius| *radius > 0.0);
        if words
            .three("M666", ['A', 'B', 'B'])
            .iter()
            .any(|tilt| tilt.abs() > 0.0)
        {
            let note =
                "The tilt of the bed (M666 A and B) is left out: measure heights above the bed.";
            notes.push(note.to_owned());
        }
    }
    let machine = Machine::towers(name, radius, azimuths, rods, endstops)?;
    let home = machine.home().map(|home| home.unwrap_or(height));
    let readings = Readings::of_name(name);
    let area = (bed.unwrap_or(USUAL_BED * radius), 0.0);
    Ok(Imported {
        firmware,
        robot: machine.robot_file(name, home, area, &readings)?,
        readings,
        names: Vec::new(),
        home,
        bed_radius: bed,
        notes,
    })
}

/// RepRapFirmware gives the same letter another meaning, so its file would make wrong rods here.
fn refuse_trims(words: &Words<'_>, trims: [f64; 3]) -> Result<(), InputError> {
    for (letter, trim) in ['A', 'B', 'C'].into_iter().zip(trims) {
        if trim.abs() > LARGEST_TRIM {
            let cause = format!(
                "{trim} mm is too much for the correction of a rod that {letter} is in Marlin 2; in RepRapFirmware and \
                 Marlin 1.1 B is a radius of the bed"
            );
            return Err(words.fault_of(letter, &cause).with_remedy(
                "if B is that radius, remove it; if RepRapFirmware wrote the file, use delta-cal import reprapfirmware",
            ));
        }
    }
    Ok(())
}
