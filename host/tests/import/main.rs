//! `delta-cal import` and `delta-cal klipper`: configurations made of the numbers of ten printers, and kinematics
//! that are written from Klipper's source.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod agreement;
mod assessed;
mod fixtures;
mod gcode;
#[path = "../export/klipper.rs"]
mod klipper;
mod refusals;
