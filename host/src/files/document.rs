//! Identification of a report: robot, operator, input files and date.

use crate::files::input::InputText;
use crate::files::robot_file::{Record, RobotFile};
use crate::files::time::day;
use serde::{Serialize, Serializer};

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
    /// The command with its options, if there was one.
    #[serde(rename = "command", skip_serializing_if = "Option::is_none")]
    pub options: Option<String>,
}

fn as_day<S: Serializer>(seconds: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&day(*seconds))
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
            options: None,
        }
    }

    /// The date, in UTC.
    pub(crate) fn date(&self) -> String {
        day(self.written)
    }

    /// The same with the options of the command.
    #[must_use]
    pub fn with_options(mut self, options: impl Into<String>) -> Self {
        self.options = Some(options.into());
        self
    }

    /// Comment for a calibrated robot file: the files with the measurements.
    pub fn comment(&self) -> String {
        let files = [Some(&self.samples), self.beside.as_ref()];
        let lines = files
            .into_iter()
            .flatten()
            .map(|Source { name, sha256 }| format!("SHA-256 of {name}: {sha256}"));
        lines.collect::<Vec<_>>().join("\n")
    }

    /// The known entries, each with its name.
    pub(crate) fn entries(&self) -> Vec<(&'static str, String)> {
        let version = env!("CARGO_PKG_VERSION");
        let written = format!("{} (UTC), by delta-cal {version}", self.date());
        let options = self.options.clone().map(|own| ("Command", own));
        let ends = [("Report written on", written)].into_iter().chain(options);
        self.record.entries().into_iter().chain(ends).collect()
    }
}
