//! The values that a configuration states, each with its place: `[printer] delta_radius`, `M665 L`.

use super::Firmware;
use crate::files::InputError;
use std::collections::BTreeMap;

/// A value and its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Entry {
    /// The value without comments.
    pub(super) value: String,
    pub(super) file: String,
    /// The line in its file.
    pub(super) line: u64,
    /// Whether it is in the `SAVE_CONFIG` block.
    pub(super) saved: bool,
}

/// The values of a configuration by section and option, or by command and letter; later ones replace earlier ones.
pub(super) struct Settings {
    pub(super) firmware: Firmware,
    /// The file's name.
    pub(super) name: String,
    pub(super) entries: BTreeMap<(String, String), Entry>,
    /// Names and lines of includes whose files do not exist.
    pub(super) missing: Vec<(String, u64)>,
}

impl Settings {
    /// None yet.
    pub(super) fn of(firmware: Firmware, name: &str) -> Self {
        Self {
            firmware,
            name: name.to_owned(),
            entries: BTreeMap::new(),
            missing: Vec::new(),
        }
    }

    /// Adds a value in place of an earlier one.
    pub(super) fn set(
        &mut self,
        (section, option): (&str, &str),
        value: impl Into<String>,
        (file, line): (&str, u64),
        saved: bool,
    ) {
        let entry = Entry {
            value: value.into(),
            file: file.to_owned(),
            line,
            saved,
        };
        let key = (section.to_owned(), option.to_owned());
        self.entries.insert(key, entry);
    }

    pub(super) fn get(&self, section: &str, option: &str) -> Option<&Entry> {
        self.entries.get(&(section.to_owned(), option.to_owned()))
    }

    /// Whether it states anything in this section or command.
    pub(super) fn states(&self, section: &str) -> bool {
        self.entries.keys().any(|(own, _)| own == section)
    }

    /// A fault of an option, at its place if it is stated.
    pub(super) fn fault(&self, section: &str, option: &str, cause: &str) -> InputError {
        let fault = match self.get(section, option) {
            Some(entry) => InputError::new(&entry.file, cause).at_line(entry.line),
            None => InputError::new(&self.name, cause),
        };
        let remedy = match self.firmware {
            Firmware::Klipper => {
                "correct the value; if it is a saved measurement, measure again in Klipper"
            }
            _ => "correct the line, or let the controller write it again",
        };
        let key = format!("{section} {option}");
        fault.at_key(key).with_remedy(remedy)
    }

    /// The error for an option whose value is not as `wanted`.
    pub(super) fn damaged(&self, section: &str, option: &str, wanted: &str) -> InputError {
        self.fault(section, option, &format!("the value is not {wanted}"))
    }

    /// The error for a missing option.
    pub(super) fn lacking(&self, section: &str, option: &str) -> InputError {
        if self.firmware != Firmware::Klipper {
            return self.fault(section, option, "the word is missing");
        }
        let remedy = match self.missing.first() {
            Some((file, line)) => format!(
                "{file}:{line} includes a file that does not exist and may contain the option: copy it beside this one"
            ),
            None => "give the complete configuration that Klipper uses".to_owned(),
        };
        let fault = self.fault(section, option, "the option is missing");
        fault.with_remedy(remedy)
    }

    /// A required option.
    pub(super) fn require(&self, section: &str, option: &str) -> Result<&Entry, InputError> {
        let entry = self.get(section, option);
        entry.ok_or_else(|| self.lacking(section, option))
    }

    /// The finite numbers of an option with these marks between them; none if it is not stated.
    pub(super) fn numbers(
        &self,
        section: &str,
        option: &str,
        (mark, wanted): (char, &str),
    ) -> Result<Vec<f64>, InputError> {
        let Some(entry) = self.get(section, option) else {
            return Ok(Vec::new());
        };
        let number = |part: &str| part.trim().parse().ok().filter(|own: &f64| own.is_finite());
        let numbers: Option<_> = entry.value.split(mark).map(number).collect();
        numbers.ok_or_else(|| self.damaged(section, option, wanted))
    }

    /// An optional number, the first of several of a G-code word.
    pub(super) fn number(&self, section: &str, option: &str) -> Result<Option<f64>, InputError> {
        let mark = match self.firmware {
            // No text contains this mark.
            Firmware::Klipper => '\0',
            _ => ':',
        };
        let numbers = self.numbers(section, option, (mark, "a finite number"))?;
        Ok(numbers.first().copied())
    }

    /// An optional number above 0.
    pub(super) fn above_zero(
        &self,
        section: &str,
        option: &str,
    ) -> Result<Option<f64>, InputError> {
        match self.number(section, option)? {
            Some(value) if !(value > 0.0) => Err(self.damaged(section, option, "a number above 0")),
            value => Ok(value),
        }
    }

    /// A required number above 0.
    pub(super) fn require_above_zero(
        &self,
        section: &str,
        option: &str,
    ) -> Result<f64, InputError> {
        let value = self.above_zero(section, option)?;
        value.ok_or_else(|| self.lacking(section, option))
    }
}
