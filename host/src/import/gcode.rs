//! M665 and M666 of RepRapFirmware and Marlin.

use super::header::{Header, RADIUS_TRIMS, Word};
use super::imported::{Imported, Machine, Towers, USUAL_TOWERS};
use super::probe::Probe;
use super::rotary::{M666, M669, of_gcode};
use super::settings::Settings;
use super::{Firmware, Includes, Stated};
use crate::files::input::{InputError, InputText};
use crate::files::samples_file::Readings;

/// The largest trim of a rod, mm: B as a bed radius is larger.
const LARGEST_TRIM: f64 = 10.0;
/// The file that `M501` of RepRapFirmware reads after `config.g`.
const OVERRIDE: &str = "config-override.g";

const M665: &str = "M665";
/// The probe's offsets: Marlin's, RepRapFirmware's, and the latter's height between touches.
const M851: &str = "M851";
const G31: &str = "G31";
const M558: &str = "M558";
const COMMANDS: [&str; 6] = [M665, M666, M669, M851, G31, M558];
/// Marlin's `PROBING_MARGIN` if it is not stated, mm.
const USUAL_MARGIN: f64 = 10.0;
/// Words of M665 that only Smoothieware has, and a comment of its M503.
const OF_SMOOTHIEWARE: [&str; 5] = ["D", "E", "I", "J", "K"];
const MAX_Z: &str = ";Max Z";
/// What RepRapFirmware answers to M665 and M666 without words, and the words that would state it.
const ANSWERS: [(&str, &str); 7] = [
    ("diagonals ", "M665 L"),
    ("diagonal ", "M665 L"),
    ("delta radius ", "R"),
    ("homed height ", "H"),
    ("bed radius ", "B"),
    ("endstop adjustments ", "M666 "),
    ("tilt x", "A"),
];

/// Finite numbers, with colons between them.
fn joined<'a>(numbers: impl Iterator<Item = &'a str>) -> Option<String> {
    let all: Vec<_> = numbers.collect();
    let finite = |own: &&str| own.parse().is_ok_and(f64::is_finite);
    (!all.is_empty() && all.iter().all(finite)).then(|| all.join(":"))
}

/// The words of a command in a line, after any prefix that a controller or a terminal prints.
fn command(line: &str) -> Option<Vec<Word>> {
    let own = line.split([';', '(', '*']).next().unwrap_or_default();
    let upper = own.to_ascii_uppercase();
    let (command, at) = COMMANDS
        .into_iter()
        .find_map(|known| Some((known, upper.find(known)?)))?;
    let printed = |word: &str| {
        word.ends_with([':', '>', ']', '<']) || word.starts_with(|own: char| own.is_ascii_digit())
    };
    let (before, words) = (&upper[..at], &upper[at + command.len()..]);
    let glued = !before.is_empty() && !before.ends_with([' ', '\t', ':', '>']);
    if glued
        || words.starts_with(|own: char| own.is_ascii_digit())
        || !before.split_whitespace().all(printed)
    {
        return None;
    }
    // A letter begins a word, with or without a blank before it.
    let letters = words.match_indices(|own: char| own.is_ascii_alphabetic());
    let starts: Vec<_> = letters.map(|(at, _)| at).collect();
    let ends = starts.iter().skip(1).copied().chain([words.len()]);
    let words = starts.iter().zip(ends).map(|(start, end)| {
        let word = &words[*start..end];
        let letter = word.chars().next().unwrap_or_default();
        let numbers = word[1..].trim_matches([' ', '\t', ',', '\r']);
        (command, letter, joined(numbers.split(':')))
    });
    let words = words.collect::<Vec<_>>();
    // Commands of the probe state pins and expressions too.
    let geometry = [M665, M666].contains(&command);
    let read = words.into_iter().filter(|own| geometry || own.2.is_some());
    Some(read.collect())
}

/// The words of M665 or M666 that an answer to it states.
fn answer(line: &str) -> Option<Vec<Word>> {
    let mut own = line.split(';').next()?.to_ascii_lowercase();
    if !(own.contains("delta radius") || own.contains("endstop adjustments")) {
        return None;
    }
    own = own.replace("% y", " b").replace(['\u{b0}', '%', ','], " ");
    for (text, words) in ANSWERS {
        own = own.replace(text, words);
    }
    let start = own.find('M')?;
    command(&own[start..])
}

fn read(
    input: &InputText,
    firmware: Firmware,
    includes: &Includes<'_>,
) -> Result<Settings, InputError> {
    let mut settings = Settings::of(firmware, input.name());
    for input in files(input, firmware, includes)? {
        let mut header = Header::default();
        for (line, own) in (1..).zip(input.text().lines()) {
            let code = own.split(';').next().unwrap_or_default();
            if code.split_whitespace().any(|word| word == "G20") {
                return Err(InputError::new(input.name(), "the lengths are in inches")
                    .at_line(line)
                    .with_remedy("send G21, then let the controller write its settings again"));
            }
            let (name, constant) = header.line(own).unzip();
            let answered = || {
                let of_duet = firmware == Firmware::RepRapFirmware;
                of_duet.then(|| answer(own)).flatten()
            };
            let words = constant.or_else(|| command(own)).or_else(answered);
            for (command, letter, numbers) in words.unwrap_or_default() {
                let value = numbers.ok_or_else(|| {
                    let cause = match name {
                        Some(_) => "the value is not a finite number",
                        None => "a word is not a letter with a finite number",
                    };
                    let fault =
                        InputError::new(input.name(), cause).at_key(name.unwrap_or(command));
                    fault
                        .at_line(line)
                        .with_remedy("correct the line, or let the controller write it again")
                })?;
                let letter = letter.to_string();
                settings.set((command, &letter), value, (input.name(), line), false);
            }
        }
    }
    Ok(settings)
}

impl Settings {
    /// All numbers of a word.
    fn all(&self, command: &str, letter: &str) -> Result<Vec<f64>, InputError> {
        self.numbers(command, letter, (':', "a finite number"))
    }

    /// The first numbers of three words, 0 for one that is not there.
    pub(super) fn three(&self, command: &str, letters: [&str; 3]) -> Result<[f64; 3], InputError> {
        let [a, b, c] = letters.map(|letter| self.number(command, letter));
        Ok([a?, b?, c?].map(Option::unwrap_or_default))
    }

    /// Marlin's rod trims.
    fn trims(&self, without_b: bool) -> Result<[f64; 3], InputError> {
        let [a, b, c] = self.three(M665, ["A", "B", "C"])?;
        let trims = [a, if without_b { 0.0 } else { b }, c];
        let mut named = ["A", "B", "C"].into_iter().zip(trims);
        let Some((letter, trim)) = named.find(|own| own.1.abs() > LARGEST_TRIM) else {
            return Ok(trims);
        };
        let cause = format!(
            "{letter} lengthens the rods of a tower since Marlin 2.0, and {trim} mm is too much"
        );
        let remedy = format!(
            "if you meant the printable radius, send M665 {letter}0, and give the new output of M503"
        );
        Err(self.fault(M665, letter, &cause).with_remedy(remedy))
    }
}

/// Refuses Smoothieware's M665, whose letters mean something else.
fn refuse_smoothieware(words: &Settings, input: &InputText) -> Result<(), InputError> {
    let own = OF_SMOOTHIEWARE
        .into_iter()
        .find(|own| words.get(M665, own).is_some());
    if own.is_none() && !input.text().contains(MAX_Z) {
        return Ok(());
    }
    let cause = "this is Smoothieware's M665: its A to E, H and Z are not those of RepRapFirmware and Marlin";
    let letter = own.unwrap_or("Z");
    Err(words.fault(M665, letter, cause).with_remedy(
        "write it as Marlin does: M665 L, R, H (its Z), X, Y, Z (its D, E, H), A, B, C (its I, J, K), and M666 as it \
         is; its A, B, C must be 0",
    ))
}

/// The refusal of a file with Smoothieware's M665.
pub(super) fn of_smoothieware(input: &InputText) -> Option<InputError> {
    let words = read(input, Firmware::Marlin, &|_, _| Ok(Vec::new())).ok()?;
    refuse_smoothieware(&words, input).err()
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
/// No M665, a word that is missing or damaged, or an impossible geometry.
pub(super) fn import(
    input: &InputText,
    firmware: Firmware,
    stated: &Stated,
    includes: &Includes<'_>,
) -> Result<Imported, InputError> {
    let name = input.name();
    let words = read(input, firmware, includes)?;
    if let Some(rotary) = of_gcode(&words, stated)? {
        return Ok(rotary);
    }
    if !words.entries.keys().any(|(command, _)| command == M665) {
        let cause = "no line is an M665 with values, which states the geometry of a linear Delta";
        return Err(InputError::new(name, cause).with_remedy(
            "give the file that contains it: config.g or config-override.g of RepRapFirmware, or of Marlin the output of \
             M503 or Configuration.h",
        ));
    }
    refuse_smoothieware(&words, input)?;
    if words.all(M665, "U")?.iter().any(|own| own.abs() > 0.0) {
        let cause = format!("{RADIUS_TRIMS} is not 0, and M665 cannot state it");
        return Err(words
            .fault(M665, "U", &cause)
            .with_remedy("set it to { 0, 0, 0 }; M665 R compensates"));
    }
    let radius = words.require_above_zero(M665, "R")?;
    let rod = words.require_above_zero(M665, "L")?;
    let height = words.number(M665, "H")?.ok_or_else(|| {
        words.lacking(M665, "H").with_remedy(
            "add H, the homed height: that of the nozzle above the bed with all carriages at their end stops",
        )
    })?;
    let corrections = words.three(M665, ["X", "Y", "Z"])?;
    let stops = words.three(M666, ["X", "Y", "Z"])?;
    let mut one_rod = false;
    let mut tilt = [0.0; 2];
    let (rods, endstops, bed) = if firmware == Firmware::Marlin {
        // Without A and C, B is the calibration radius of Marlin 1.1.
        one_rod = words.get(M665, "B").is_some()
            && !["A", "C"]
                .iter()
                .any(|letter| words.get(M665, letter).is_some());
        let bed = words.number(M665, "P")?;
        let bed = bed.or(words.number(M665, "B")?.filter(|_| one_rod));
        let rods = words.trims(one_rod)?.map(|by| rod + by);
        (rods, stops.map(|by| height - by), bed)
    } else {
        let each = words.all(M665, "L")?;
        let rods = [0, 1, 2].map(|tower| each.get(tower).copied().unwrap_or(rod));
        // M666 A and B are percent.
        let [by_x, by_y, _] = words.three(M666, ["A", "B", "B"])?;
        tilt = [0.01 * by_x, 0.01 * by_y];
        (rods, stops.map(|by| height + by), words.number(M665, "B")?)
    };
    let configured = Towers {
        radius,
        azimuths: [0, 1, 2].map(|tower| USUAL_TOWERS[tower] + corrections[tower]),
        rods,
        endstops,
    };
    let towers = configured.as_stated(stated);
    if !towers.rods.iter().all(|rod| *rod > towers.radius) {
        return Err(words.fault(M665, "L", "a rod is not longer than the radius R"));
    }
    let bed = bed.filter(|radius| *radius > 0.0);
    let mut machine = Machine::towers(name, &configured, stated, (bed, 0.0))?;
    let home = machine.home().map(|home| home.unwrap_or(height));
    machine.tilt = tilt;
    let mut imported = machine.imported(&words, home, Readings::of_name(name), Vec::new())?;
    let probe = match firmware {
        Firmware::RepRapFirmware => G31,
        _ => M851,
    };
    let probe = Probe {
        clearance: words.number(M558, "H")?.unwrap_or_default(),
        ..Probe::of(&words, probe, ["X", "Y", "Z"])?
    };
    // G33 keeps nozzle and probe within the printable radius; Marlin 1.1 states the circle itself.
    let margin = words.number(M665, "Q")?.unwrap_or(USUAL_MARGIN);
    let within = words
        .number(M665, "P")?
        .map(|own| own - margin - probe.distance());
    imported.probed_radius = within.or(bed);
    imported.one_rod = one_rod;
    Ok(imported.with_probe(probe, stated.apart))
}
