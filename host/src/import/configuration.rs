//! A Klipper configuration: the sections that a calibration needs, with those of included files and of the block
//! that `SAVE_CONFIG` wrote.

use super::pattern::{fits, is_pattern};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What is kept of a configuration. Everything else is skipped unread.
const SECTIONS: [&str; 5] = [
    "printer",
    "stepper_a",
    "stepper_b",
    "stepper_c",
    "delta_calibrate",
];
/// What every line of the saved block begins with.
const SAVED: &str = "#*#";

/// A value, and where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// As it is written, without comments.
    pub value: String,
    file: String,
    line: u64,
}

/// The options of the sections that a calibration needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Configuration {
    /// The file's name.
    pub name: String,
    entries: BTreeMap<(String, String), Entry>,
    /// Names and lines of includes whose files are not there.
    missing: Vec<(String, u64)>,
}

impl Configuration {
    /// Reads a file and what it includes.
    ///
    /// # Errors
    /// A file that cannot be read, files that include each other, or a line of a needed section that is no option.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = InputText::from_file(path)?;
        let mut configuration = Self {
            name: text.name().to_owned(),
            entries: BTreeMap::new(),
            missing: Vec::new(),
        };
        let [written, saved] = split(text.text());
        let mut visited = vec![path.to_owned()];
        configuration.add(&text, &written, path, &mut visited)?;
        // What is written by hand wins over what was saved, as in Klipper.
        let mut of_saved = Self {
            entries: BTreeMap::new(),
            ..configuration.clone()
        };
        of_saved.add(&text, &saved, path, &mut visited)?;
        for (key, entry) in of_saved.entries {
            configuration.entries.entry(key).or_insert(entry);
        }
        Ok(configuration)
    }

    /// Lines with their numbers.
    fn add(
        &mut self,
        text: &InputText,
        lines: &[(u64, &str)],
        path: &Path,
        visited: &mut Vec<PathBuf>,
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
                    self.include(text, *line, path, wanted.trim(), visited)?;
                    section = None;
                } else {
                    section = SECTIONS.into_iter().find(|own| *own == header);
                }
                continue;
            }
            let Some(section) = section else {
                // Continued lines of what is not needed are skipped like the line itself.
                last = Some(((String::new(), String::new()), indentation));
                continue;
            };
            let Some(at) = value.find([':', '=']) else {
                let cause =
                    format!("this line of [{section}] is no option: it has neither : nor =");
                return Err(InputError::new(text.name(), cause)
                    .at_line(*line)
                    .with_remedy("correct the line, or put # before it"));
            };
            let key = (section.to_owned(), value[..at].trim().to_lowercase());
            let entry = Entry {
                value: value[at + 1..].trim().to_owned(),
                file: text.name().to_owned(),
                line: *line,
            };
            self.entries.insert(key.clone(), entry);
            last = Some((key, indentation));
        }
        Ok(())
    }

    fn include(
        &mut self,
        text: &InputText,
        line: u64,
        path: &Path,
        wanted: &str,
        visited: &mut Vec<PathBuf>,
    ) -> Result<(), InputError> {
        let fault = |cause: &str, remedy: &str| {
            InputError::new(text.name(), cause)
                .at_line(line)
                .with_remedy(remedy)
        };
        let found = included(path, wanted);
        if found.is_empty() && !is_pattern(wanted) {
            self.missing.push((text.name().to_owned(), line));
        }
        for file in found {
            if visited.contains(&file) || visited.len() > 64 {
                return Err(fault(
                    "this line includes a file that includes this one again",
                    "remove one of the two includes",
                ));
            }
            let other = InputText::from_file(&file).map_err(|_| {
                fault(
                    "this line includes a file that cannot be read as text",
                    "check the file and its permissions",
                )
            })?;
            let lines = numbered(other.text());
            visited.push(file.clone());
            self.add(&other, &lines, &file, visited)?;
            visited.pop();
        }
        Ok(())
    }

    /// Whether an option is there.
    pub fn has(&self, section: &str, option: &str) -> bool {
        self.get(section, option).is_some()
    }

    /// An option.
    pub fn get(&self, section: &str, option: &str) -> Option<&Entry> {
        self.entries.get(&(section.to_owned(), option.to_owned()))
    }

    /// An option that must be there.
    ///
    /// # Errors
    /// It is not there.
    pub fn require(&self, section: &str, option: &str) -> Result<&Entry, InputError> {
        self.get(section, option)
            .ok_or_else(|| self.lacking(section, option))
    }

    /// The fault of an option that is not there.
    pub fn lacking(&self, section: &str, option: &str) -> InputError {
        let fault = InputError::new(&self.name, "the option is missing")
            .at_key(format!("[{section}] {option}"));
        match self.missing.first() {
            Some((file, line)) => fault.with_remedy(format!(
                "{file}:{line} includes a file that is not there: copy it beside this one, for the option may stand \
                 in it"
            )),
            None => fault.with_remedy("give the whole configuration that Klipper runs with"),
        }
    }

    /// A number, if the option is there.
    ///
    /// # Errors
    /// It is no finite number.
    pub fn number(&self, section: &str, option: &str) -> Result<Option<f64>, InputError> {
        let Some(entry) = self.get(section, option) else {
            return Ok(None);
        };
        match entry.value.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.damaged(section, option, "a finite number")),
        }
    }

    /// A number above 0, if the option is there.
    ///
    /// # Errors
    /// It is none.
    pub fn above_zero(&self, section: &str, option: &str) -> Result<Option<f64>, InputError> {
        match self.number(section, option)? {
            Some(value) if !(value > 0.0) => Err(self.damaged(section, option, "a number above 0")),
            value => Ok(value),
        }
    }

    /// The fault of an option whose value is not what it must be.
    pub fn damaged(&self, section: &str, option: &str, wanted: &str) -> InputError {
        let place = format!("[{section}] {option}");
        let cause = format!("the value is not {wanted}");
        match self.get(section, option) {
            Some(entry) => InputError::new(&entry.file, cause).at_line(entry.line),
            None => InputError::new(&self.name, cause),
        }
        .at_key(place)
        .with_remedy("correct the value; of a saved measurement: measure again in Klipper")
    }

    /// Includes whose files are not there: file and line.
    pub fn missing(&self) -> &[(String, u64)] {
        &self.missing
    }
}

/// What stands before the comment. A ; or # begins one at the start of a line, behind a space, and # anywhere.
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

/// The lines by hand, and those of the saved block without what each begins with.
fn split(text: &str) -> [Vec<(u64, &str)>; 2] {
    let lines = numbered(text);
    let begin = lines
        .iter()
        .position(|(_, line)| line.starts_with(SAVED) && line.contains("SAVE_CONFIG"));
    let Some(begin) = begin else {
        return [lines, Vec::new()];
    };
    let (written, saved) = lines.split_at(begin);
    let saved = saved.iter().skip(1).filter_map(|(line, own)| {
        let own = own.strip_prefix(SAVED)?;
        let own = own.strip_prefix(' ').unwrap_or(own);
        // The block's own warning is no option.
        (!own.starts_with("DO NOT EDIT")).then_some((*line, own))
    });
    [written.to_vec(), saved.collect()]
}

/// The files that an include names, sorted. Patterns may stand in the last part of the name.
fn included(path: &Path, wanted: &str) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or_else(|| Path::new(""));
    let wanted = folder.join(wanted);
    let name = wanted
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    let Some(name) = name.filter(|name| is_pattern(name)) else {
        return wanted.is_file().then_some(wanted).into_iter().collect();
    };
    let folder = match wanted.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut found: Vec<_> = entries
        .flatten()
        .filter(|entry| fits(&name, &entry.file_name().to_string_lossy()))
        .map(|entry| wanted.with_file_name(entry.file_name()))
        .filter(|file| file.is_file())
        .collect();
    found.sort();
    found
}
