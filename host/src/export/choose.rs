//! All targets.

use super::target::Target;
use super::targets::b_and_r::B_AND_R;
use super::targets::four_lengths::{CODESYS, DELTA_X, FLUIDNC, GRBLHAL, UCNC};
use super::targets::klipper::KLIPPER;
use super::targets::linuxcnc::LINUXCNC;
use super::targets::reprapfirmware::REPRAPFIRMWARE;
use super::targets::smoothieware::SMOOTHIEWARE;

/// What a robot is exported for.
#[derive(Debug, Clone, Copy)]
pub enum Choice {
    /// A controller with parameters of its own.
    Controller(&'static Target),
    /// A simulator's model, with all 24 parameters.
    Sdf,
    /// Position corrections for any controller.
    CorrectionTable,
}

/// All, by their names on the command line.
pub const CHOICES: [(&str, Choice); 12] = [
    ("klipper", Choice::Controller(&KLIPPER)),
    ("reprapfirmware", Choice::Controller(&REPRAPFIRMWARE)),
    ("b-and-r", Choice::Controller(&B_AND_R)),
    ("linuxcnc", Choice::Controller(&LINUXCNC)),
    ("smoothieware", Choice::Controller(&SMOOTHIEWARE)),
    ("fluidnc", Choice::Controller(&FLUIDNC)),
    ("grblhal", Choice::Controller(&GRBLHAL)),
    ("ucnc", Choice::Controller(&UCNC)),
    ("delta-x", Choice::Controller(&DELTA_X)),
    ("codesys", Choice::Controller(&CODESYS)),
    ("sdf", Choice::Sdf),
    ("correction-table", Choice::CorrectionTable),
];
