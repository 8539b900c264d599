//! M665 and M666 of RepRapFirmware, Marlin and Smoothieware, and what Repetier calls the same.

use super::header::{Header, RADIUS_TRIMS, Word};
use super::imported::{Imported, Machine, Towers, USUAL_TOWERS};
use super::probe::Probe;
use super::rotary::{M666, M669, of_gcode};
use super::settings::Settings;
use super::{Firmware, Includes, Stated};
use crate::files::{InputError, InputText, Readings};

/// The largest trim of a rod, mm: B as a bed radius is larger.
const LARGEST_TRIM: f64 = 10.0;
/// The file that `M501` of RepRapFirmware reads after `config.g`.
const OVERRIDE: &str = "config-override.g";

const M665: &str = "M665";
/// The probe's offsets: Marlin's, RepRapFirmware's, the latter's height between touches, and Smoothieware's.
const M851: &str = "M851";
const G31: &str = "G31";
const M558: &str = "M558";
const M565: &str = "M565";
const COMMANDS: [&str; 7] = [M665, M666, M669, M851, G31, M558, M565];
/// Marlin's `PROBING_MARGIN` if it is not stated, mm.
const USUAL_MARGIN: f64 = 10.0;
/// Words, and what Smoothieware's config and, by number, Repetier's EEPROM call them.
const SETTINGS: [(&str, &str, &str); 5] = [
    (
        M665,
        "L R Z A B C D E H",
        "arm_length arm_radius gamma_max delta_tower1_offset delta_tower2_offset delta_tower3_offset \
         delta_tower1_angle delta_tower2_angle delta_tower3_angle",
    ),
    (M666, "X Y Z", "alpha_trim_mm beta_trim_mm gamma_trim_mm"),
    (
        M665,
        "L R Z A B C D E H I J K P S",
        "881 885 153 913 917 921 901 905 909 933 937 941 925 11",
    ),
    (M666, "X Y Z", "893 895 897"),
    (M851, "X Y Z", "800 804 808"),
];
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

/// The word that a line of Smoothieware's config states, or of Repetier's `EPR:3 881 269.000 …`.
fn setting(line: &str) -> Option<Vec<Word>> {
    let own = match line.split_once("EPR:") {
        Some((_, own)) => own.split_once(' ')?.1,
        None => line,
    };
    let mut own = own.split_whitespace();
    let (name, value) = (own.next()?, own.next()?);
    SETTINGS.into_iter().find_map(|(command, letters, names)| {
        let at = names.split(' ').position(|own| own == name)?;
        let letter = letters.chars().nth(2 * at)?;
        Some(vec![(command, letter, joined([value].into_iter()))])
    })
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
            let words = words.or_else(|| setting(own));
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

    /// Those in which Repetier counts its end stops.
    fn steps_per_mm(&self) -> Result<f64, InputError> {
        let remedy = "give EPR 11 too, the steps per mm";
        let stated = self.above_zero(M665, "S")?;
        stated.ok_or_else(|| self.lacking(M665, "S").with_remedy(remedy))
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
            "give the file that contains it: config.g or config-override.g of RepRapFirmware, of Marlin the output of \
             M503 or Configuration.h, of Smoothieware that of M503, or of Repetier that of M205",
        ));
    }
    let of_marlin = firmware == Firmware::Marlin;
    if of_marlin && words.all(M665, "U")?.iter().any(|own| own.abs() > 0.0) {
        let cause = format!("{RADIUS_TRIMS} is not 0, and M665 cannot state it");
        return Err(words
            .fault(M665, "U", &cause)
            .with_remedy("set it to { 0, 0, 0 }; M665 R compensates"));
    }
    let radius = words.require_above_zero(M665, "R")?;
    let rod = words.require_above_zero(M665, "L")?;
    let (high, angles) = match firmware {
        Firmware::Smoothieware | Firmware::Repetier => ("Z", ["D", "E", "H"]),
        _ => ("H", ["X", "Y", "Z"]),
    };
    let height = words.number(M665, high)?.ok_or_else(|| {
        words.lacking(M665, high).with_remedy(format!(
            "add {high}, the homed height: that of the nozzle above the bed with all carriages at their end stops"
        ))
    })?;
    let mut corrections = words.three(M665, angles)?;
    let stops = words.three(M666, ["X", "Y", "Z"])?;
    let mut one_rod = false;
    let mut tilt = [0.0; 2];
    let mut offsets = [0.0; 3];
    let mut steps = None;
    let (rods, endstops, bed) = if of_marlin {
        // Without A and C, B is the calibration radius of Marlin 1.1.
        one_rod = words.get(M665, "B").is_some()
            && !["A", "C"]
                .iter()
                .any(|letter| words.get(M665, letter).is_some());
        let bed = words.number(M665, "P")?;
        let bed = bed.or(words.number(M665, "B")?.filter(|_| one_rod));
        let rods = words.trims(one_rod)?.map(|by| rod + by);
        (rods, stops.map(|by| height - by), bed)
    } else if high == "Z" {
        offsets = words.three(M665, ["A", "B", "C"])?;
        let mut up = -1.0;
        if firmware == Firmware::Repetier {
            // It counts steps upwards, and states where its towers are.
            let per_mm = words.steps_per_mm()?;
            (steps, up) = (Some(per_mm), 1.0 / per_mm);
            corrections = [0, 1, 2].map(|tower| corrections[tower] - USUAL_TOWERS[tower]);
        }
        let rods = words.three(M665, ["I", "J", "K"])?.map(|by| rod + by);
        let endstops = stops.map(|by| height + up * by);
        (rods, endstops, words.number(M665, "P")?)
    } else {
        let each = words.all(M665, "L")?;
        let rods = [0, 1, 2].map(|tower| each.get(tower).copied().unwrap_or(rod));
        // M666 A and B are percent.
        let [by_x, by_y, _] = words.three(M666, ["A", "B", "B"])?;
        tilt = [0.01 * by_x, 0.01 * by_y];
        (rods, stops.map(|by| height + by), words.number(M665, "B")?)
    };
    let mean = offsets.iter().sum::<f64>() / 3.0;
    let configured = Towers {
        radius: radius + mean,
        offsets: offsets.map(|own| own - mean),
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
        Firmware::Smoothieware => M565,
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
    imported.steps = steps;
    Ok(imported.with_probe(probe, stated.apart))
}
