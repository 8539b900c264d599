//! Which robot it is, and who measured it with what: for reports and certificates, nothing is computed from it.

use super::messages::fault_at;
use super::schema::{RobotToml, Words};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use std::fmt::Write;
use toml::Value;

/// Letters that a text may have, so that a certificate stays one page.
const LONGEST: usize = 60;

/// What identifies a robot and its measurement. `None` where the file does not say it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Record {
    /// The robot's name.
    pub name: Option<String>,
    /// The robot's serial number.
    pub serial: Option<String>,
    /// Who measured.
    pub operator: Option<String>,
    /// With what.
    pub instrument: Option<String>,
    /// On which day.
    pub date: Option<String>,
}

impl Record {
    pub(super) fn read(input: &InputText, toml: &RobotToml) -> Result<Self, InputError> {
        let of = |key: &str, words: &Words| text(input, key, words);
        let (robot, measurement) = (&toml.robot, &toml.measurement);
        Ok(Self {
            name: of("name", &robot.name)?,
            serial: of("serial", &robot.serial)?,
            operator: of("operator", &measurement.operator)?,
            instrument: of("instrument", &measurement.instrument)?,
            date: of("date", &measurement.date)?,
        })
    }

    /// Why a text cannot stand in a record, if it cannot.
    pub fn fault(text: &str) -> Option<String> {
        if text.trim().is_empty() {
            Some("the text is empty".to_owned())
        } else if text.chars().any(char::is_control) {
            Some("the text has a line end or another control character".to_owned())
        } else if text.chars().count() > LONGEST {
            Some(format!("the text has more than {LONGEST} letters"))
        } else {
            None
        }
    }

    /// Without the measurement: that of a calibration is not that of what is measured afterwards.
    #[must_use]
    pub fn of_the_robot(&self) -> Self {
        Self {
            name: self.name.clone(),
            serial: self.serial.clone(),
            ..Self::default()
        }
    }

    pub(super) fn write(&self, text: &mut String) {
        let sections = [
            (
                "[robot]",
                vec![("name", &self.name), ("serial", &self.serial)],
            ),
            (
                "[measurement]",
                vec![
                    ("operator", &self.operator),
                    ("instrument", &self.instrument),
                    ("date", &self.date),
                ],
            ),
        ];
        for (head, entries) in sections {
            let stated = entries
                .into_iter()
                .filter_map(|(key, value)| Some((key, value.as_ref()?)));
            for (index, (key, value)) in stated.enumerate() {
                if index == 0 {
                    let _ = writeln!(text, "\n{head}");
                }
                let _ = writeln!(text, "{key} = {}", Value::from(value.as_str()));
            }
        }
    }
}

fn text(input: &InputText, key: &str, words: &Words) -> Result<Option<String>, InputError> {
    let Some(words) = words else { return Ok(None) };
    let fault = |cause: String| {
        fault_at(input, words, key, cause)
            .with_remedy("write one short line of text in quotation marks, or delete the line")
    };
    let text = match words.as_ref() {
        Value::String(text) => text.trim().to_owned(),
        Value::Integer(number) => number.to_string(),
        Value::Datetime(date) => date.to_string(),
        _ => return Err(fault("the value is no text".to_owned())),
    };
    match Record::fault(&text) {
        Some(cause) => Err(fault(cause)),
        None => Ok(Some(text)),
    }
}
