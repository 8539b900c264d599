//! The controllers, one file each.

pub(crate) mod b_and_r;
pub(crate) mod four_lengths;
pub(crate) mod klipper;
pub(crate) mod linuxcnc;
pub(crate) mod reprapfirmware;
pub(crate) mod smoothieware;
