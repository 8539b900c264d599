//! Everything that exists once for each scalar; compiled twice.
#![allow(unsafe_code)] // naming symbols

use super::Real;

macro_rules! name {
    ($name:literal) => {
        concat!("dcal_", $name, suffix!())
    };
}

macro_rules! family {
    ($family:ident, $name:literal) => {
        concat!("dcal_", stringify!($family), "_", $name, suffix!())
    };
}

#[macro_use]
mod family;
pub mod fkm;
pub mod outcome;
pub mod robot;
pub mod sample;
pub mod verdict;

families! {
    /// The per-arm calibrator: each arm separately.
    ikm Ikm: of_positions calibrator;
    /// The joint calibrator: all 24 parameters at once.
    joint Joint: of_positions calibrator;
    /// The per-arm calibrator behind a gate, which tests each sample before it is added.
    gate Gate: gated calibrator;
    /// The joint calibrator behind a gate.
    joint_gate JointGate: gated calibrator;
}
