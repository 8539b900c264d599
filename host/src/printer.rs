//! A printer's configuration, from the readings that it holds to what is wrong, what to measure next and what to
//! paste.

mod area;
mod assess;
mod contradiction;
mod effector;
mod next;
mod notes;
mod shape;

use crate::calibration::{CalibrateError, Refused, read_samples};
use crate::files::input::{InputError, InputText};
use crate::fit::Options;
use crate::import::{Firmware, Imported, Includes, Stated, kept, lengths, print_within, touched};
pub use area::{ACROSS, Better, Map, Off};
use area::{bed, radius_of};
pub use assess::{Printer, as_printed};
pub(crate) use contradiction::{
    DOUBTFUL, bad_touch, contradicted_length, contradicting, lack_of_fit, worst_reading,
};
pub use effector::{Differing, Effector};
pub use next::{Next, touches_of_bed};
pub use notes::Change;
pub(crate) use notes::{alike, common_scale};
pub use shape::Uneven;

/// How far out the bed is held as configured where nothing was touched, as a part of its radius.
const HELD_OUT: f64 = 0.9;

/// A printer's configuration with its measurements: those of samples files, of a console's answers, of lengths of prints, or
/// those that the configuration holds, and what its owner states. Lines that were pasted say what was configured at first.
///
/// # Errors
/// A configuration or samples at fault, and no measurements at all.
pub fn read(
    firmware: Firmware,
    text: &InputText,
    samples: &[InputText],
    stated: &Stated,
    includes: &Includes<'_>,
    options: &Options,
) -> Result<Imported, CalibrateError> {
    let remembered = samples.iter().find_map(|own| kept(own.text()));
    let stated = &Stated {
        kept: remembered.or(stated.kept),
        ..stated.clone()
    };
    let mut printer = firmware.import(text, stated, includes)?;
    let mut of_prints = Vec::new();
    let pasted = |own: &InputText| kept(own.text()).is_some();
    for samples in samples.iter().filter(|own| !pasted(own)) {
        if let Some(found) = lengths(samples)? {
            of_prints.extend(found);
        } else if let Some(touched) = touched(&printer, samples)? {
            printer = touched;
        } else if let Some(own) = Firmware::wrote(samples) {
            let cause = format!(
                "this is a configuration of {}, without touches",
                own.title()
            );
            return Err(InputError::new(samples.name(), cause)
                .with_remedy("give the console's answers to touching the bed in its place")
                .into());
        } else {
            let readings = read_samples(samples, &printer.robot, options)?;
            printer = printer.with_readings(readings);
        }
    }
    if samples.iter().all(pasted)
        && printer.readings.rows.is_empty()
        && let Some(touched) = touched(&printer, text)?
    {
        printer = touched;
    }
    printer = printer.with_prints(stated, &of_prints)?;
    if printer.readings.rows.is_empty() {
        return Err(printer.without_readings().into());
    }
    let radius = radius_of(&printer);
    print_within(&mut printer.robot, &printer.home, radius);
    if printer.counts()[0] == 0 {
        // Distances say nothing of the bed.
        printer = printer.holding(&bed(HELD_OUT * radius, 2, 6));
    }
    Ok(printer)
}

/// A refusal with what explains a printer's readings: one bad touch, or distances that share a scale.
pub fn explained(error: CalibrateError, printer: Option<&Imported>) -> CalibrateError {
    if error.refused()
        && let Some(bad) = printer.and_then(bad_touch)
    {
        return bad.into();
    }
    match printer.and_then(common_scale) {
        Some(scale) if error.refused() => Refused::new(error.to_string(), scale).into(),
        _ => error,
    }
}
