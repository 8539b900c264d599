//! M665 and M666 of RepRapFirmware and Marlin, and the same values in Marlin's `Configuration.h`.

use super::Firmware;
use super::configuration::Includes;
use super::imported::{Imported, Machine, Towers, USUAL_TOWERS, rods_note};
use super::stated::Stated;
use crate::files::input::{InputError, InputText};
use crate::files::samples_file::Readings;
use std::collections::BTreeMap;

/// The largest trim of a rod, mm: B as a bed radius is larger.
const LARGEST_TRIM: f64 = 10.0;
/// The bed radius as a fraction of the delta radius, if it is not stated.
const USUAL_BED: f64 = 0.6;
/// The file that `M501` of RepRapFirmware reads after `config.g`.
const OVERRIDE: &str = "config-override.g";

const M665: &str = "M665";
const M666: &str = "M666";
/// Constants of Marlin's `Configuration.h`, with command and words.
const CONSTANTS: [(&str, &str, &str); 9] = [
    ("DELTA_DIAGONAL_ROD", M665, "L"),
    ("DELTA_RADIUS", M665, "R"),
    ("DELTA_HEIGHT", M665, "H"),
    ("DELTA_TOWER_ANGLE_TRIM", M665, "XYZ"),
    ("DELTA_DIAGONAL_ROD_TRIM_TOWER", M665, "ABC"),
    ("DELTA_ENDSTOP_ADJ", M666, "XYZ"),
    ("PRINTABLE_RADIUS", M665, "P"),
    ("DELTA_PRINTABLE_RADIUS", M665, "P"),
    (RADIUS_TRIMS, M665, "U"),
];
const CORRECT: &str = "correct the line, or let the controller write it again";
/// A constant that M665 cannot state.
const RADIUS_TRIMS: &str = "DELTA_RADIUS_TRIM_TOWER";

/// The words of M665 and M666, each with its file and line; later ones replace earlier ones.
struct Words {
    name: String,
    values: BTreeMap<(&'static str, char), Word>,
}

struct Word {
    file: String,
    line: u64,
    values: Vec<f64>,
}

/// A word of a command with its numbers; none if they cannot be read.
type Assigned = ((&'static str, char), Vec<f64>);

/// The words of M665 or M666 in a line, after any prefix that a controller or a terminal prints.
fn command(line: &str) -> Option<Vec<Assigned>> {
    let own = line.split([';', '(']).next().unwrap_or_default();
    let mut words = own.split_whitespace();
    loop {
        let word = words.next()?;
        let bare = word.rsplit([':', '>']).next().unwrap_or_default();
        let mut known = [M665, M666].into_iter();
        if let Some(command) = known.find(|known| bare.eq_ignore_ascii_case(known)) {
            let assigned = words.map(|word| {
                let letter = word.chars().next().unwrap_or_default();
                let numbers = word.get(1..).unwrap_or_default().split(':');
                let values: Option<Vec<f64>> = numbers.map(|own| own.parse().ok()).collect();
                let values = values.filter(|_| letter.is_ascii_alphabetic());
                let key = (command, letter.to_ascii_uppercase());
                (key, values.unwrap_or_default())
            });
            return Some(assigned.collect());
        }
        let printed = word.ends_with([':', '>', ']', '<'])
            || word.starts_with(|own: char| own.is_ascii_digit());
        if !printed {
            return None;
        }
    }
}

/// The words that a constant of `Configuration.h` states.
fn constant(line: &str) -> Option<Vec<Assigned>> {
    let own = line.trim_start().strip_prefix("#define ")?;
    let own = own.split("//").next().unwrap_or_default().trim();
    let (name, value) = own.split_once(char::is_whitespace)?;
    let (_, command, letters) = CONSTANTS.into_iter().find(|(own, ..)| *own == name)?;
    let numbers = value.split(|own: char| "{}(), \t".contains(own));
    let numbers = numbers.filter(|own| !own.is_empty());
    let values: Option<Vec<f64>> = numbers.map(|own| own.parse().ok()).collect();
    let values = values.unwrap_or_default();
    let assigned = letters.chars().enumerate().map(|(index, letter)| {
        let own = match letters.len() {
            1 => values.clone(),
            _ => values.get(index).copied().into_iter().collect(),
        };
        ((command, letter), own)
    });
    Some(assigned.collect())
}

impl Words {
    fn read(name: &str, inputs: &[InputText]) -> Result<Self, InputError> {
        let mut all = BTreeMap::new();
        for input in inputs {
            for (line, own) in (1..).zip(input.text().lines()) {
                let assigned = command(own).or_else(|| constant(own));
                for (key, values) in assigned.unwrap_or_default() {
                    if values.is_empty() || !values.iter().all(|own| own.is_finite()) {
                        let cause = "a word is not a letter with a finite number";
                        return Err(InputError::new(input.name(), cause)
                            .at_key(key.0)
                            .at_line(line)
                            .with_remedy(CORRECT));
                    }
                    let file = input.name().to_owned();
                    all.insert(key, Word { file, line, values });
                }
            }
        }
        Ok(Self {
            name: name.to_owned(),
            values: all,
        })
    }

    /// A fault of a word of M665, with its line if it exists.
    fn fault_of(&self, letter: char, cause: &str) -> InputError {
        let key = format!("{M665} {letter}");
        match self.values.get(&(M665, letter)) {
            Some(word) => InputError::new(&word.file, cause)
                .at_key(key)
                .at_line(word.line),
            None => InputError::new(&self.name, cause).at_key(key),
        }
        .with_remedy(CORRECT)
    }

    fn all(&self, command: &'static str, letter: char) -> &[f64] {
        let own = self.values.get(&(command, letter));
        own.map_or(&[], |own| own.values.as_slice())
    }

    fn one(&self, command: &'static str, letter: char) -> Option<f64> {
        self.all(command, letter).first().copied()
    }

    fn three(&self, command: &'static str, letters: [char; 3]) -> [f64; 3] {
        letters.map(|letter| self.one(command, letter).unwrap_or(0.0))
    }

    fn required(&self, letter: char) -> Result<f64, InputError> {
        let value = self.one(M665, letter);
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

    /// Whether B is the calibration radius of Marlin 1.1, which has no A and C.
    fn old_b(&self) -> bool {
        self.one(M665, 'A').is_none() && self.one(M665, 'C').is_none()
    }

    /// Marlin's rod trims.
    fn trims(&self) -> Result<[f64; 3], InputError> {
        let [a, b, c] = self.three(M665, ['A', 'B', 'C']);
        let trims = [a, if self.old_b() { 0.0 } else { b }, c];
        for (letter, trim) in ['A', 'B', 'C'].into_iter().zip(trims) {
            if trim.abs() > LARGEST_TRIM {
                let cause = format!(
                    "{letter} lengthens the rods of a tower since Marlin 2.0, and {trim} mm is too much"
                );
                let meant = match letter {
                    'B' => "if you meant the printable radius, ",
                    _ => "",
                };
                let remedy = format!("{meant}send M665 {letter}0, and give the new output of M503");
                return Err(self.fault_of(letter, &cause).with_remedy(remedy));
            }
        }
        Ok(trims)
    }
}

/// A configuration and the file that overrides it.
fn files(
    input: &InputText,
    firmware: Firmware,
    includes: &Includes<'_>,
) -> Result<Vec<InputText>, InputError> {
    let mut files = vec![input.clone()];
    let lines = (1..).zip(input.text().lines());
    let mut loads = lines.filter(|(_, line)| line.split_whitespace().next() == Some("M501"));
    if let (Firmware::RepRapFirmware, Some((line, _))) = (firmware, loads.next()) {
        let found = includes(input.name(), OVERRIDE)?;
        if found.is_empty() {
            let cause = "M501 loads config-override.g, whose M665 and M666 override these";
            let remedy = "copy config-override.g from the controller's card beside this file; if there is none, delete \
                          M501 from this copy";
            return Err(InputError::new(input.name(), cause)
                .at_line(line)
                .with_remedy(remedy));
        }
        files.extend(found);
    }
    Ok(files)
}

/// Reads the printer that M665 and M666 describe.
///
/// # Errors
/// No M665, a word that is missing or damaged, a file of another firmware, or an impossible geometry.
pub(super) fn import(
    input: &InputText,
    firmware: Firmware,
    stated: &Stated,
    includes: &Includes<'_>,
) -> Result<Imported, InputError> {
    let name = input.name();
    if let Some(other) = Firmware::wrote(input).filter(|own| *own != firmware) {
        let cause = format!("this file is {}'s", other.title());
        let remedy = format!(
            "use delta-cal import {}: its numbers have another meaning",
            other.name()
        );
        return Err(InputError::new(name, cause).with_remedy(remedy));
    }
    let words = Words::read(name, &files(input, firmware, includes)?)?;
    if !words.values.keys().any(|(command, _)| *command == M665) {
        let cause = "no line is an M665 with values, which states the geometry of a linear Delta";
        return Err(InputError::new(name, cause).with_remedy(
            "give the file that contains it: config.g or config-override.g of RepRapFirmware, or of Marlin the output of \
             M503 or Configuration.h",
        ));
    }
    if words.all(M665, 'U').iter().any(|own| own.abs() > 0.0) {
        let cause = format!("{RADIUS_TRIMS} is not 0, and M665 cannot state it");
        return Err(words
            .fault_of('U', &cause)
            .with_remedy("set it to { 0, 0, 0 }; M665 R compensates"));
    }
    let radius = words.above_zero('R')?;
    let rod = words.above_zero('L')?;
    let height = words.required('H')?;
    let corrections = words.three(M665, ['X', 'Y', 'Z']);
    let stops = words.three(M666, ['X', 'Y', 'Z']);
    let mut notes = Vec::new();
    let (rods, endstops, bed) = if firmware == Firmware::Marlin {
        let old = words.one(M665, 'B').filter(|_| words.old_b());
        let bed = words.one(M665, 'P').or(old);
        let rods = words.trims()?.map(|by| rod + by);
        (rods, stops.map(|by| height - by), bed)
    } else {
        let each = words.all(M665, 'L');
        let rods = [0, 1, 2].map(|tower| each.get(tower).copied().unwrap_or(rod));
        let tilts = words.three(M666, ['A', 'B', 'B']);
        if tilts.iter().any(|tilt| tilt.abs() > 0.0) {
            let note =
                "The tilt of the bed (M666 A and B) is ignored: measure heights above the bed.";
            notes.push(note.to_owned());
        }
        (rods, stops.map(|by| height + by), words.one(M665, 'B'))
    };
    let bed = bed.filter(|radius| *radius > 0.0);
    let configured = Towers {
        radius,
        azimuths: [0, 1, 2].map(|tower| USUAL_TOWERS[tower] + corrections[tower]),
        rods,
        endstops,
    };
    let towers = configured.as_stated(stated);
    if !towers.rods.iter().all(|rod| *rod > towers.radius) {
        return Err(words.fault_of('L', "a rod is not longer than the radius R"));
    }
    notes.extend(rods_note(stated.rods, rods));
    let machine = Machine::towers(name, &configured, stated)?;
    let home = machine.home().map(|home| home.unwrap_or(height));
    let readings = Readings::of_name(name);
    let area = (bed.unwrap_or(USUAL_BED * radius), 0.0);
    Ok(Imported {
        firmware,
        robot: machine.robot_file(name, home, area, &readings)?,
        configured: machine.configured,
        readings,
        names: Vec::new(),
        home,
        bed_radius: bed,
        saved_ignored: false,
        notes,
    })
}
