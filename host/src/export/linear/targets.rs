//! The controllers, one file each.

mod klipper;
mod marlin;
mod reprapfirmware;

pub(crate) use klipper::KLIPPER;
pub(crate) use marlin::MARLIN;
pub(crate) use reprapfirmware::REPRAPFIRMWARE;
