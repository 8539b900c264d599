//! A printer's configuration, from the readings that it holds to what is wrong, what to measure next and what to
//! paste.

mod area;
mod assess;
mod next;
mod notes;

use crate::calibration::{CalibrateError, Refused, read_samples};
use crate::files::input::InputText;
use crate::fit::Options;
use crate::import::{Firmware, Imported, Includes, Stated, touches};
pub use area::{ACROSS, Better, Map, Off};
pub use assess::Printer;
pub(crate) use assess::{DOUBTFUL, contradicting};
pub use next::{Next, touches_of_bed};
pub use notes::Change;
pub(crate) use notes::{alike, common_scale};

/// A printer's configuration with its measurements: those of a samples file, of a console's answers, or those that the
/// configuration holds, and what its owner states.
///
/// # Errors
/// A configuration or samples at fault, and no measurements at all.
pub fn read(
    firmware: Firmware,
    text: &InputText,
    samples: Option<&InputText>,
    stated: &Stated,
    includes: &Includes<'_>,
    options: &Options,
) -> Result<Imported, CalibrateError> {
    let mut printer = firmware.import(text, stated, includes)?;
    if let Some(samples) = samples {
        let readings = match touches(&printer, samples)? {
            Some(readings) => readings,
            None => read_samples(samples, &printer.robot, options)?,
        };
        printer = printer.with_readings(readings);
    } else if printer.readings.rows.is_empty()
        && let Some(readings) = touches(&printer, text)?
    {
        printer = printer.with_readings(readings);
    }
    printer = printer.with_prints(stated)?;
    if printer.readings.rows.is_empty() {
        return Err(printer.without_readings().into());
    }
    Ok(printer)
}

/// A refusal with what explains a printer's distances, if they share a scale.
pub fn explained(error: CalibrateError, printer: Option<&Imported>) -> CalibrateError {
    match printer.and_then(common_scale) {
        Some(scale) if error.refused() => Refused::new(error.to_string(), scale).into(),
        _ => error,
    }
}
