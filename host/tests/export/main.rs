//! `delta-cal export`: the lines that it writes, read again and computed by kinematics that are written here
//! from each controller's equations, lose what the command states.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../support/mod.rs"]
mod support;

mod controllers;
mod klipper;
mod models;
mod refusals;
mod robots;
mod round_trip;
mod tables;
mod towers;
