//! Identification of a report: robot, operator, input files and date.

use crate::files::input::InputText;
use crate::files::robot_file::{Record, RobotFile};
use jiff::Timestamp;
use serde::{Serialize, Serializer};
use std::fmt::Write;

/// An input file, identified by name and content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Source {
    /// The name as given.
    pub name: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

impl From<&InputText> for Source {
    fn from(text: &InputText) -> Self {
        Self {
            name: text.name().to_owned(),
            sha256: text.sha256().to_owned(),
        }
    }
}

/// Identification of a report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Document {
    /// When it was written, in seconds since 1970-01-01 UTC.
    #[serde(rename = "date", serialize_with = "as_day")]
    pub written: u64,
    /// Robot and measurement.
    #[serde(flatten)]
    pub record: Record,
    /// The robot file.
    #[serde(rename = "robot_file")]
    pub robot: Source,
    /// The samples file.
    #[serde(rename = "samples_file")]
    pub samples: Source,
    /// The second samples file, if there are two.
    #[serde(
        rename = "second_samples_file",
        skip_serializing_if = "Option::is_none"
    )]
    pub beside: Option<Source>,
}

fn as_day<S: Serializer>(seconds: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&day(*seconds))
}

/// The UTC date of a time in seconds since 1970-01-01.
fn day(seconds: u64) -> String {
    let seconds = i64::try_from(seconds).unwrap_or(i64::MAX);
    let written = Timestamp::from_second(seconds).unwrap_or(Timestamp::MAX);
    written.strftime("%F").to_string()
}

impl Document {
    /// The identification of a report on a measured robot; `written` is in seconds since 1970-01-01 UTC.
    pub fn new(robot: &RobotFile, file: &InputText, samples: &InputText, written: u64) -> Self {
        Self {
            written,
            record: robot.record.clone(),
            robot: Source::from(file),
            samples: Source::from(samples),
            beside: samples.beside().map(Source::from),
        }
    }

    /// The date, in UTC.
    pub(crate) fn date(&self) -> String {
        day(self.written)
    }

    /// Comment for a calibrated robot file: the input files, and the measurement record, which the file itself omits.
    pub fn comment(&self) -> String {
        let files = [Some(&self.samples), self.beside.as_ref()];
        let lines = files
            .into_iter()
            .flatten()
            .map(|Source { name, sha256 }| format!("SHA-256 of {name}: {sha256}"));
        let mut text = lines.collect::<Vec<_>>().join("\n");
        let record = &self.record;
        let measurement = [
            ("on", &record.date),
            ("by", &record.operator),
            ("with", &record.instrument),
        ];
        let stated = measurement
            .into_iter()
            .filter_map(|(word, value)| Some(format!(" {word} {}", value.as_ref()?)));
        let stated: String = stated.collect();
        if !stated.is_empty() {
            let _ = write!(text, "\nMeasured{stated}.");
        }
        text
    }

    /// The known entries, each with its name.
    pub(crate) fn entries(&self) -> Vec<(&'static str, String)> {
        let record = &self.record;
        let stated = [
            ("Robot", &record.name),
            ("Serial number", &record.serial),
            ("Operator", &record.operator),
            ("Instrument", &record.instrument),
            ("Measured on", &record.date),
        ];
        let stated = stated
            .into_iter()
            .filter_map(|(name, value)| Some((name, value.clone()?)));
        let version = env!("CARGO_PKG_VERSION");
        let written = format!("{} (UTC), by delta-cal {version}", self.date());
        stated.chain([("Report written on", written)]).collect()
    }
}
