//! When a report is written, on which robot and from which files.

use super::failure::Failure;
use crate::report::document::{Document, Source};
use crate::{InputText, RobotFile};
use std::time::{SystemTime, UNIX_EPOCH};

/// Of the standard for reproducible builds: the time in place of the clock's.
const SOURCE_DATE_EPOCH: &str = "SOURCE_DATE_EPOCH";

/// What identifies a report on this robot, from these files.
pub(crate) fn document(
    robot: &RobotFile,
    robot_file: Source,
    samples: (Source, Option<Source>),
) -> Result<Document, Failure> {
    Ok(Document {
        written: now()?,
        record: robot.record.clone(),
        robot: robot_file,
        samples: samples.0,
        beside: samples.1,
    })
}

/// Of a samples file and the one beside it.
pub(crate) fn sources(samples: &InputText) -> (Source, Option<Source>) {
    (Source::from(samples), samples.beside().map(Source::from))
}

/// Seconds since the beginning of 1970.
fn now() -> Result<u64, Failure> {
    // No calendar goes beyond the year 9999.
    const LAST: u64 = 253_402_300_799;
    let Some(value) = std::env::var_os(SOURCE_DATE_EPOCH) else {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        return Ok(since.map_or(0, |since| since.as_secs()));
    };
    let seconds = value.to_str().and_then(|text| text.parse().ok());
    seconds
        .filter(|seconds| *seconds <= LAST)
        .ok_or_else(|| Failure::Usage {
            cause: format!("{SOURCE_DATE_EPOCH} is {}, not a time", value.display()),
            remedy: "set it to whole seconds since the beginning of 1970, or unset it".to_owned(),
        })
}
