//! `delta-cal import` and `delta-cal klipper`: configurations made of the numbers of ten printers, and kinematics
//! that are written from Klipper's source.

mod agreement;
mod assessed;
mod fixtures;
mod gcode;
mod refusals;
