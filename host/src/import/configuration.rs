//! A Klipper configuration: the sections that a calibration needs, including those of included files and of the
//! `SAVE_CONFIG` block.

use crate::files::input::{InputError, InputText};
use std::collections::BTreeMap;

/// Returns the files that a line includes, sorted, given the name of the file with the line and the included name or
/// pattern.
pub type Includes<'a> = dyn Fn(&str, &str) -> Result<Vec<InputText>, InputError> + 'a;

/// The deepest level of includes.
const DEEPEST: usize = 64;

/// The sections that are read. Everything else is skipped.
const SECTIONS: [&str; 5] = [
    "printer",
    "stepper_a",
    "stepper_b",
    "stepper_c",
    "delta_calibrate",
];
/// The start of every line of the saved block, and the block's first lines.
const SAVED: &str = "#*#";
const HEADER: [&str; 3] = [
    "#*# <---------------------- SAVE_CONFIG ---------------------->",
    "#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.",
    SAVED,
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

/// A value and its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The value without comments.
    pub value: String,
    /// The line in its file.
    pub line: u64,
    /// Whether it is in the `SAVE_CONFIG` block.
    pub saved: bool,
    file: String,
}

/// The options of the sections that a calibration needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Configuration {
    /// The file's name.
    pub name: String,
    entries: BTreeMap<(String, String), Entry>,
    /// Names and lines of includes whose files do not exist.
    pub missing: Vec<(String, u64)>,
    /// The line that makes Klipper ignore the `SAVE_CONFIG` block.
    pub broken: Option<u64>,
}

impl Configuration {
    /// Reads a file and its includes.
    ///
    /// # Errors
    /// Files that include each other or cannot be read, or a line of a needed section that is not an option.
    pub fn read(text: &InputText, includes: &Includes<'_>) -> Result<Self, InputError> {
        let (written, saved, broken) = split(text.text());
        let mut configuration = Self {
            name: text.name().to_owned(),
            entries: BTreeMap::new(),
            missing: Vec::new(),
            broken,
        };
        let mut visited = vec![text.name().to_owned()];
        configuration.add(text, &saved, includes, &mut visited)?;
        let mut of_saved = std::mem::take(&mut configuration.entries);
        for entry in of_saved.values_mut() {
            entry.saved = true;
        }
        configuration.add(text, &written, includes, &mut visited)?;
        // As in Klipper, values written by hand override saved ones.
        of_saved.append(&mut configuration.entries);
        configuration.entries = of_saved;
        Ok(configuration)
    }

    /// Adds the options of numbered lines.
    fn add(
        &mut self,
        text: &InputText,
        lines: &[(u64, &str)],
        includes: &Includes<'_>,
        visited: &mut Vec<String>,
    ) -> Result<(), InputError> {
        let mut section: Option<&str> = None;
        // The option that an indented line continues, and its indentation.
        let mut last: Option<((String, String), usize)> = None;
        for (line, own) in lines {
            let content = own.find(['#', ';']).map_or(*own, |at| comment_at(own, at));
            let value = content.trim();
            if value.is_empty() {
                continue;
            }
            let indentation = content.len() - content.trim_start().len();
            if let Some((key, above)) = &last
                && indentation > *above
            {
                if let Some(entry) = self.entries.get_mut(key) {
                    entry.value.push('\n');
                    entry.value.push_str(value);
                }
                continue;
            }
            if let Some(header) = header(value) {
                last = None;
                if let Some(wanted) = header.strip_prefix("include ") {
                    self.include((text, *line), wanted.trim(), includes, visited)?;
                    section = None;
                } else {
                    section = SECTIONS.into_iter().find(|own| *own == header);
                }
                continue;
            }
            let Some(section) = section else {
                // Continuation lines are skipped like the line itself.
                last = Some(((String::new(), String::new()), indentation));
                continue;
            };
            let Some(at) = value.find([':', '=']) else {
                let cause =
                    format!("this line of [{section}] is not an option: it has neither : nor =");
                return Err(InputError::new(text.name(), cause)
                    .at_line(*line)
                    .with_remedy("correct the line, or put # before it"));
            };
            let key = (section.to_owned(), value[..at].trim().to_lowercase());
            let entry = Entry {
                value: value[at + 1..].trim().to_owned(),
                file: text.name().to_owned(),
                line: *line,
                saved: false,
            };
            self.entries.insert(key.clone(), entry);
            last = Some((key, indentation));
        }
        Ok(())
    }

    fn include(
        &mut self,
        (text, line): (&InputText, u64),
        wanted: &str,
        includes: &Includes<'_>,
        visited: &mut Vec<String>,
    ) -> Result<(), InputError> {
        let fault = |cause: &str, remedy: &str| {
            InputError::new(text.name(), cause)
                .at_line(line)
                .with_remedy(remedy)
        };
        let found = includes(text.name(), wanted).map_err(|_| {
            fault(
                "this line includes a file that cannot be read as text",
                "check the file and its permissions",
            )
        })?;
        if found.is_empty() && !wanted.contains(['*', '?', '[']) {
            self.missing.push((text.name().to_owned(), line));
        }
        for other in found {
            if visited.iter().any(|name| name == other.name()) || visited.len() > DEEPEST {
                return Err(fault(
                    "this line includes a file that includes this one again",
                    "delete one of the two includes",
                ));
            }
            visited.push(other.name().to_owned());
            self.add(&other, &numbered(other.text()), includes, visited)?;
            visited.pop();
        }
        Ok(())
    }

    /// Refuses options of geometry that are not Klipper's own.
    ///
    /// # Errors
    /// The first such option.
    pub fn refuse_foreign(&self) -> Result<(), InputError> {
        for ((section, option), entry) in &self.entries {
            let foreign = option.split('_').any(|word| GEOMETRY.contains(&word));
            if section != "delta_calibrate" && foreign && !OPTIONS.contains(&option.as_str()) {
                let cause = "this geometry option is not Klipper's own, and its meaning is unknown";
                let remedy =
                    "set it to have no effect, delete it from this copy, and calibrate again";
                return Err(InputError::new(&entry.file, cause)
                    .at_line(entry.line)
                    .at_key(format!("[{section}] {option}"))
                    .with_remedy(remedy));
            }
        }
        Ok(())
    }

    /// A note if an included file sets an option that a calibration changes.
    pub fn included_geometry(&self) -> Option<String> {
        let changed = |option: &str| option != "print_radius" && OPTIONS.contains(&option);
        let mut entries = self.entries.iter().filter(|((_, option), entry)| {
            entry.file != self.name && (changed(option) || option == "position_endstop")
        });
        entries.next().map(|((_, option), entry)| {
            format!(
                "{}:{} sets {option} in an included file: replace the lines there. SAVE_CONFIG refuses options that an \
                 included file sets.",
                entry.file, entry.line
            )
        })
    }

    /// An option.
    pub fn get(&self, section: &str, option: &str) -> Option<&Entry> {
        self.entries.get(&(section.to_owned(), option.to_owned()))
    }

    /// A required option.
    ///
    /// # Errors
    /// The option is missing.
    pub fn require(&self, section: &str, option: &str) -> Result<&Entry, InputError> {
        self.get(section, option)
            .ok_or_else(|| self.lacking(section, option))
    }

    /// The error for a missing option.
    pub fn lacking(&self, section: &str, option: &str) -> InputError {
        let fault = InputError::new(&self.name, "the option is missing")
            .at_key(format!("[{section}] {option}"));
        match self.missing.first() {
            Some((file, line)) => fault.with_remedy(format!(
                "{file}:{line} includes a file that does not exist and may contain the option: copy it beside this one"
            )),
            None => fault.with_remedy("give the complete configuration that Klipper uses"),
        }
    }

    /// An optional number.
    ///
    /// # Errors
    /// It is not a finite number.
    pub fn number(&self, section: &str, option: &str) -> Result<Option<f64>, InputError> {
        let Some(entry) = self.get(section, option) else {
            return Ok(None);
        };
        match entry.value.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.damaged(section, option, "a finite number")),
        }
    }

    /// An optional number above 0.
    ///
    /// # Errors
    /// It is not such a number.
    pub fn above_zero(&self, section: &str, option: &str) -> Result<Option<f64>, InputError> {
        match self.number(section, option)? {
            Some(value) if !(value > 0.0) => Err(self.damaged(section, option, "a number above 0")),
            value => Ok(value),
        }
    }

    /// A required number above 0.
    ///
    /// # Errors
    /// It is missing or not such a number.
    pub fn require_above_zero(&self, section: &str, option: &str) -> Result<f64, InputError> {
        let value = self.above_zero(section, option)?;
        value.ok_or_else(|| self.lacking(section, option))
    }

    /// The error for an option whose value is not as `wanted`.
    pub fn damaged(&self, section: &str, option: &str, wanted: &str) -> InputError {
        let place = format!("[{section}] {option}");
        let cause = format!("the value is not {wanted}");
        match self.get(section, option) {
            Some(entry) => InputError::new(&entry.file, cause).at_line(entry.line),
            None => InputError::new(&self.name, cause),
        }
        .at_key(place)
        .with_remedy("correct the value; if it is a saved measurement, measure again in Klipper")
    }
}

/// The line without its comment. A # starts one anywhere, a ; at the start of a line or after a space.
fn comment_at(line: &str, first: usize) -> &str {
    let mut at = first;
    loop {
        let before = &line[..at];
        let sharp = line[at..].starts_with('#');
        if sharp || before.is_empty() || before.ends_with(char::is_whitespace) {
            return before;
        }
        match line[at + 1..].find(['#', ';']) {
            Some(next) => at += 1 + next,
            None => return line,
        }
    }
}

/// The name in `[name]`.
fn header(line: &str) -> Option<&str> {
    let inside = line.strip_prefix('[')?;
    inside.rfind(']').map(|end| inside[..end].trim())
}

fn numbered(text: &str) -> Vec<(u64, &str)> {
    (1..).zip(text.lines()).collect()
}

/// A line with its number.
type Numbered<'a> = (u64, &'a str);

/// The lines written by hand, those of the saved block without their prefix, and the line that makes Klipper ignore the
/// block: below its header every line, even an empty one, begins with `#*#`, and above it none does
/// (`ConfigAutoSave._find_autosave_data` in `klippy/configfile.py`).
fn split(text: &str) -> (Vec<Numbered<'_>>, Vec<Numbered<'_>>, Option<u64>) {
    let lines = numbered(text.trim_end());
    let is_header = |own: &[Numbered<'_>]| own.iter().map(|(_, line)| *line).eq(HEADER);
    // Klipper's header begins with the end of a line.
    let begin = lines.windows(HEADER.len()).skip(1).position(is_header);
    let begin = begin.map_or(lines.len(), |at| at + 1);
    let (written, block) = lines.split_at(begin);
    let saved = block.iter().skip(HEADER.len());
    let saved = saved.skip_while(|(_, own)| own.trim().is_empty());
    let above = written.iter().skip(1);
    let mut above = above.filter(|(_, own)| own.starts_with("#*# "));
    let of_block = |own: &str| own == SAVED || own.starts_with("#*# ");
    let mut foreign = saved
        .clone()
        .filter(|(_, own)| !of_block(own) || *own == HEADER[0]);
    if let Some((line, _)) = above.next().or(foreign.next()) {
        return (lines.clone(), Vec::new(), Some(*line));
    }
    let saved = saved.map(|(line, own)| (*line, own.get(4..).unwrap_or_default()));
    (written.to_vec(), saved.collect(), None)
}
