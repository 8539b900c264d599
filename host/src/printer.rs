//! A printer's configuration, from the readings that it holds to what is wrong, what to measure next and what to
//! paste.

mod area;
mod assess;
mod next;

pub use area::{Area, Off};
pub use assess::{Assessment, Change};

#[cfg(feature = "cli")]
pub(crate) use assess::{lack_of_fit, worst};
pub use next::Next;

use crate::files::input::InputError;
use crate::files::input::InputText;
use crate::import::{Firmware, Imported, Includes};

/// The printer of a configuration, whoever wrote it. `rods`, mm, take the place of its own.
///
/// # Errors
/// No configuration of a Delta, or a wrong one.
pub fn read(
    input: &InputText,
    rods: Option<[f64; 3]>,
    includes: &Includes<'_>,
) -> Result<Imported, InputError> {
    Firmware::of(input)?.import(input, rods, includes)
}
