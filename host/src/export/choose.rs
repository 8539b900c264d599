//! All targets.

use super::linear::target::LinearTarget;
use super::linear::targets as linear;
use super::target::Target;
use super::targets::b_and_r::B_AND_R;
use super::targets::four_lengths::{CODESYS, DELTA_X, FLUIDNC, GRBLHAL, UCNC};
use super::targets::klipper::KLIPPER;
use super::targets::linuxcnc::LINUXCNC;
use super::targets::reprapfirmware::REPRAPFIRMWARE;
use super::targets::smoothieware::SMOOTHIEWARE;
use delta_cal::robot::Drive;

/// What a robot is exported for.
#[derive(Debug, Clone, Copy)]
pub enum Choice {
    /// A controller with parameters of its own: for robots whose motors turn their arms, for robots with
    /// towers, or for both.
    Controller(Option<&'static Target>, Option<&'static LinearTarget>),
    /// A simulator's model, with all 24 parameters.
    Sdf,
    /// LinuxCNC's kinematics component, with all 24 parameters.
    LinuxcncComponent,
    /// Position corrections for any controller.
    CorrectionTable,
}

/// All, by their names on the command line.
pub const CHOICES: [(&str, Choice); 14] = [
    (
        "klipper",
        Choice::Controller(Some(&KLIPPER), Some(&linear::KLIPPER)),
    ),
    (
        "reprapfirmware",
        Choice::Controller(Some(&REPRAPFIRMWARE), Some(&linear::REPRAPFIRMWARE)),
    ),
    ("b-and-r", Choice::Controller(Some(&B_AND_R), None)),
    ("linuxcnc", Choice::Controller(Some(&LINUXCNC), None)),
    ("linuxcnc-component", Choice::LinuxcncComponent),
    (
        "smoothieware",
        Choice::Controller(Some(&SMOOTHIEWARE), None),
    ),
    ("fluidnc", Choice::Controller(Some(&FLUIDNC), None)),
    ("grblhal", Choice::Controller(Some(&GRBLHAL), None)),
    ("ucnc", Choice::Controller(Some(&UCNC), None)),
    ("delta-x", Choice::Controller(Some(&DELTA_X), None)),
    ("codesys", Choice::Controller(Some(&CODESYS), None)),
    ("marlin", Choice::Controller(None, Some(&linear::MARLIN))),
    ("sdf", Choice::Sdf),
    ("correction-table", Choice::CorrectionTable),
];

impl Choice {
    /// Whether it takes robots with such drives.
    pub const fn takes(&self, drive: Drive) -> bool {
        match (self, drive) {
            (Self::Controller(rotary, _), Drive::Rotary) => rotary.is_some(),
            (Self::Controller(_, linear), Drive::Linear) => linear.is_some(),
            (Self::Sdf | Self::LinuxcncComponent, drive) => matches!(drive, Drive::Rotary),
            (Self::CorrectionTable, _) => true,
        }
    }
}

/// The names of those that take robots with such drives.
pub(crate) fn names_for(drive: Drive) -> Vec<String> {
    let taking = CHOICES.iter().filter(|(_, choice)| choice.takes(drive));
    taking.map(|(name, _)| (*name).to_owned()).collect()
}
