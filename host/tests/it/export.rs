//! `delta-cal export`: the lines that it writes, read again and computed by kinematics that are written here
//! from each controller's equations, lose what the command states.

mod controllers;
pub(crate) mod klipper;
mod refusals;
mod robots;
mod round_trip;
mod tables;
mod towers;
