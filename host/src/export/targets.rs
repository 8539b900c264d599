//! The controllers: what each holds, its conventions, and its lines.

pub(super) mod b_and_r;
pub(super) mod four_lengths;
pub(super) mod klipper;
pub(super) mod linuxcnc;
pub(super) mod marlin;
pub(super) mod reprapfirmware;
