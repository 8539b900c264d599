//! Points that do not fix the sensor's frame.

use super::Refused;
use super::advice::{SPREAD, joined};
use crate::files::samples_file::SamplesFile;

/// The points do not fix the sensor's frame.
pub(crate) fn sensor_frame(samples: &SamplesFile, cause: &str) -> Refused {
    Refused {
        cause: format!("{}: {cause}", samples.name),
        remedy: joined(&[
            samples.unit_hint(),
            Some(format!("measure more poses and {SPREAD}")),
        ]),
    }
}
