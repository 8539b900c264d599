//! The text of a Klipper configuration: the sections that a calibration needs, including those of included files and of
//! the `SAVE_CONFIG` block.

use super::settings::Settings;
use super::{Firmware, Includes};
use crate::files::{InputError, InputText};

/// The deepest level of includes.
const DEEPEST: usize = 64;

pub(super) const PRINTER: &str = "[printer]";
pub(super) const STEPPERS: [&str; 3] = ["[stepper_a]", "[stepper_b]", "[stepper_c]"];
pub(super) const SAVED: &str = "[delta_calibrate]";
/// The bed as probed last.
pub(super) const MESH: &str = "[bed_mesh default]";
/// The sections that are read. Everything else is skipped.
const SECTIONS: [&str; 6] = [PRINTER, STEPPERS[0], STEPPERS[1], STEPPERS[2], SAVED, MESH];
/// The probe's section, under any of its names.
pub(super) const PROBE: &str = "[probe]";
const PROBES: [&str; 5] = [
    "probe",
    "bltouch",
    "smart_effector",
    "probe_eddy_current",
    "load_cell_probe",
];

/// The start of every line of the saved block, and the block's first lines.
const MARK: &str = "#*#";
const HEADER: [&str; 3] = [
    "#*# <---------------------- SAVE_CONFIG ---------------------->",
    "#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.",
    MARK,
];

/// Words in options that state geometry, and Klipper's own options among these.
const GEOMETRY: [&str; 9] = [
    "radius", "lean", "tilt", "arm", "rod", "tower", "angle", "shoulder", "diagonal",
];
const OPTIONS: [&str; 8] = [
    "delta_radius",
    "print_radius",
    "angle",
    "arm_length",
    "upper_arm_length",
    "lower_arm_length",
    "shoulder_radius",
    "shoulder_height",
];

/// Reads a file and its includes; also returns the line that makes Klipper ignore the `SAVE_CONFIG` block.
///
/// # Errors
/// Files that include each other or cannot be read, or a line of a needed section that is not an option.
pub(super) fn read(
    text: &InputText,
    includes: &Includes<'_>,
) -> Result<(Settings, Option<u64>), InputError> {
    let (written, saved, broken) = split(text.text());
    let mut reader = Reader {
        settings: Settings::of(Firmware::Klipper, text.name()),
        includes,
        visited: vec![text.name().to_owned()],
    };
    // As in Klipper, values written by hand override saved ones.
    reader.add(text, &saved, true)?;
    reader.add(text, &written, false)?;
    Ok((reader.settings, broken))
}

struct Reader<'a> {
    settings: Settings,
    includes: &'a Includes<'a>,
    /// The names of the files that include the present one, and its own.
    visited: Vec<String>,
}

impl Reader<'_> {
    /// Adds the options of numbered lines.
    fn add(
        &mut self,
        text: &InputText,
        lines: &[Numbered<'_>],
        saved: bool,
    ) -> Result<(), InputError> {
        let mut section: Option<&str> = None;
        // The option that more indented lines continue, and its indentation.
        let mut last: Option<((String, String), usize)> = None;
        for (line, own) in lines {
            let content = without_comment(own);
            let value = content.trim();
            if value.is_empty() {
                continue;
            }
            let indentation = content.len() - content.trim_start().len();
            if let Some((key, above)) = &last
                && indentation > *above
            {
                if let Some(entry) = self.settings.entries.get_mut(key) {
                    entry.value.push('\n');
                    entry.value.push_str(value);
                }
                continue;
            }
            if let Some(header) = header(value) {
                last = None;
                if let Some(wanted) = header.strip_prefix("include ") {
                    self.include(text, *line, wanted.trim(), saved)?;
                }
                let named = |own: &&str| own.trim_matches(['[', ']']) == header;
                let kind = header.split_whitespace().next().unwrap_or_default();
                let probe = PROBES.contains(&kind).then_some(PROBE);
                section = SECTIONS.into_iter().find(named).or(probe);
                continue;
            }
            let Some(section) = section else {
                // Continuation lines are skipped like the line itself.
                last = Some(((String::new(), String::new()), indentation));
                continue;
            };
            let Some((option, value)) = value.split_once([':', '=']) else {
                if section == PROBE {
                    continue;
                }
                let cause =
                    format!("this line of {section} is not an option: it has neither : nor =");
                return Err(InputError::new(text.name(), cause)
                    .at_line(*line)
                    .with_remedy("correct the line, or put # before it"));
            };
            let option = option.trim().to_ascii_lowercase();
            let place = (text.name(), *line);
            let settings = &mut self.settings;
            settings.set((section, &option), value.trim(), place, saved);
            last = Some(((section.to_owned(), option), indentation));
        }
        Ok(())
    }

    fn include(
        &mut self,
        text: &InputText,
        line: u64,
        wanted: &str,
        saved: bool,
    ) -> Result<(), InputError> {
        let fault = |cause: &str, remedy: &str| {
            InputError::new(text.name(), cause)
                .at_line(line)
                .with_remedy(remedy)
        };
        let found = (self.includes)(text.name(), wanted).map_err(|_| {
            fault(
                "this line includes a file that cannot be read as text",
                "check the file and its permissions",
            )
        })?;
        if found.is_empty() && !wanted.contains(['*', '?', '[']) {
            self.settings.missing.push((text.name().to_owned(), line));
        }
        for other in found {
            let visited = &mut self.visited;
            if visited.iter().any(|name| name == other.name()) || visited.len() > DEEPEST {
                return Err(fault(
                    "this line includes a file that includes this one again",
                    "delete one of the two includes",
                ));
            }
            visited.push(other.name().to_owned());
            self.add(&other, &numbered(other.text()), saved)?;
            self.visited.pop();
        }
        Ok(())
    }
}

/// Refuses options of geometry that are not Klipper's own.
///
/// # Errors
/// The first such option.
pub(super) fn refuse_foreign(settings: &Settings) -> Result<(), InputError> {
    for (section, option) in settings.entries.keys() {
        let foreign = option.split('_').any(|word| GEOMETRY.contains(&word));
        let read = ![SAVED, MESH, PROBE].contains(&section.as_str());
        if read && foreign && !OPTIONS.contains(&option.as_str()) {
            let cause = "this geometry option is not Klipper's own, and its meaning is unknown";
            let remedy = "set it to have no effect, delete it from this copy, and calibrate again";
            let fault = settings.fault(section, option, cause);
            return Err(fault.with_remedy(remedy));
        }
    }
    Ok(())
}

/// Notes on included files that do not exist, on one that sets an option which a calibration changes, and on a block that
/// Klipper ignores.
pub(super) fn notes(settings: &Settings, broken: Option<u64>) -> Vec<String> {
    let name = &settings.name;
    let missing = settings.missing.iter().map(|(file, line)| {
        format!(
            "{file}:{line} includes a file that does not exist. If it contains part of [printer], [stepper_a] to \
             [stepper_c] or [delta_calibrate], copy it beside the configuration and import again."
        )
    });
    let mut notes: Vec<_> = missing.collect();
    let changed = |option: &str| option != "print_radius" && OPTIONS.contains(&option);
    let mut included = settings.entries.iter().filter(|((_, option), entry)| {
        entry.file != *name && (changed(option) || option == "position_endstop")
    });
    notes.extend(included.next().map(|((_, option), entry)| {
        format!(
            "{}:{} sets {option} in an included file: replace the lines there. SAVE_CONFIG refuses options that an \
             included file sets.",
            entry.file, entry.line
        )
    }));
    notes.extend(broken.map(|line| {
        format!(
            "{name}:{line} makes Klipper ignore the SAVE_CONFIG block: every line in and below it must begin with #*#. \
             Move the line above the block, or delete it if it is empty."
        )
    }));
    notes
}

/// A # starts a comment anywhere, a ; at the start of a line or after a space.
fn without_comment(line: &str) -> &str {
    let starts = |(at, own): &(usize, char)| {
        let before = line[..*at].chars().next_back();
        *own == '#' || (*own == ';' && before.is_none_or(char::is_whitespace))
    };
    let comment = line.char_indices().find(starts);
    &line[..comment.map_or(line.len(), |(at, _)| at)]
}

/// The name in `[name]`.
fn header(line: &str) -> Option<&str> {
    let inside = line.strip_prefix('[')?;
    inside.rfind(']').map(|end| inside[..end].trim())
}

/// A line with its number.
type Numbered<'a> = (u64, &'a str);

fn numbered(text: &str) -> Vec<Numbered<'_>> {
    (1..).zip(text.lines()).collect()
}

/// The lines written by hand, those of the saved block without their prefix, and the line that makes Klipper ignore the
/// block: below its header every line, even an empty one, begins with `#*#`, and above it none does
/// (`ConfigAutoSave._find_autosave_data` in `klippy/configfile.py`).
fn split(text: &str) -> (Vec<Numbered<'_>>, Vec<Numbered<'_>>, Option<u64>) {
    let mut lines = numbered(text.trim_end());
    let is_header = |own: &[Numbered<'_>]| own.iter().map(|(_, line)| *line).eq(HEADER);
    // Klipper's header begins with the end of a line.
    let begin = lines.windows(HEADER.len()).skip(1).position(is_header);
    let begin = begin.map_or(lines.len(), |at| at + 1);
    let (written, block) = lines.split_at(begin);
    let saved = block.iter().skip(HEADER.len());
    let saved = saved.skip_while(|(_, own)| own.trim().is_empty());
    let above = written.iter().skip(1);
    let mut above = above.filter(|(_, own)| own.starts_with("#*# "));
    let of_block = |own: &str| own == MARK || own.starts_with("#*# ");
    let mut foreign = saved
        .clone()
        .filter(|(_, own)| !of_block(own) || *own == HEADER[0]);
    if let Some((line, _)) = above.next().or(foreign.next()) {
        let broken = Some(*line);
        return (lines, Vec::new(), broken);
    }
    let saved = saved.map(|(line, own)| (*line, own.get(4..).unwrap_or_default()));
    let saved = saved.collect();
    lines.truncate(begin);
    (lines, saved, None)
}
