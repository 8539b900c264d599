//! Everything that exists once for each scalar; compiled twice.
#![allow(unsafe_code)] // naming symbols

use super::Real;

macro_rules! name {
    ($name:literal) => {
        concat!("dcal_", $name, suffix!())
    };
}

macro_rules! family {
    ($family:literal, $name:literal) => {
        concat!("dcal_", $family, "_", $name, suffix!())
    };
}

#[macro_use]
mod family;
pub mod fkm;
pub mod gate;
pub mod outcome;
pub mod robot;
pub mod sample;

of_positions!(
    /// The per-arm calibrator: each arm separately.
    ikm, "ikm", Ikm
);
of_positions!(
    /// The joint calibrator: all 24 parameters at once.
    joint, "joint", Joint
);
