//! What a report says of the measurement, and when it is written.

use super::failure::Failure;
use crate::report::document::{Document, Source};
use crate::{Record, RobotFile};
use clap::Args;
use std::time::{SystemTime, UNIX_EPOCH};

/// Of the standard for reproducible builds: the time in place of the clock's.
const SOURCE_DATE_EPOCH: &str = "SOURCE_DATE_EPOCH";

/// Who measured, with what and when; in place of [measurement] in the robot file.
#[derive(Debug, Args)]
pub(crate) struct RecordArguments {
    /// Who measured, for the reports [default: operator in the robot file's [measurement]]
    #[arg(long, value_name = "NAME", value_parser = text)]
    operator: Option<String>,
    /// With what it was measured, for the reports [default: instrument in [measurement]]
    #[arg(long, value_name = "NAME", value_parser = text)]
    instrument: Option<String>,
    /// On which day it was measured, for the reports [default: date in [measurement]]
    #[arg(long, value_name = "DATE", value_parser = text)]
    measured_on: Option<String>,
}

fn text(text: &str) -> Result<String, String> {
    match Record::fault(text) {
        None => Ok(text.trim().to_owned()),
        Some(cause) => Err(cause),
    }
}

impl RecordArguments {
    /// What identifies a report on this robot, from these files.
    ///
    /// # Errors
    /// `SOURCE_DATE_EPOCH` is no time.
    pub(crate) fn document(
        &self,
        robot: &RobotFile,
        robot_file: Source,
        samples_file: Source,
    ) -> Result<Document, Failure> {
        let stated = robot.record.clone();
        Ok(Document {
            written: now()?,
            record: Record {
                operator: self.operator.clone().or(stated.operator),
                instrument: self.instrument.clone().or(stated.instrument),
                date: self.measured_on.clone().or(stated.date),
                ..stated
            },
            robot: robot_file,
            samples: samples_file,
        })
    }
}

/// Seconds since the beginning of 1970.
fn now() -> Result<u64, Failure> {
    // No calendar goes beyond the year 9999.
    const LAST: u64 = 253_402_300_799;
    match std::env::var_os(SOURCE_DATE_EPOCH) {
        None => Ok(SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_secs())),
        Some(value) => value
            .to_str()
            .and_then(|text| text.parse().ok())
            .filter(|seconds| *seconds <= LAST)
            .ok_or_else(|| Failure::Usage {
                cause: format!(
                    "the environment variable {SOURCE_DATE_EPOCH} is {}, which is no time",
                    value.display()
                ),
                remedy: "set it to whole seconds since the beginning of 1970, or unset it"
                    .to_owned(),
            }),
    }
}
