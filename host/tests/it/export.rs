//! `delta-cal export`: its output is read back and evaluated with kinematics written here from each controller's
//! equations; the loss must be the one the command states.

pub(crate) mod controllers;
pub(crate) mod klipper;
pub(crate) mod robots;
mod round_trip;
mod structured_text;
mod tables;
