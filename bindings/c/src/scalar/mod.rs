//! Everything that exists once for each scalar; compiled twice.

use super::{OBSERVATION_ROW, Real};

macro_rules! name {
    ($name:literal) => {
        concat!("dcal_", $name, suffix!())
    };
}

pub mod arms;
pub mod gate;
pub mod joint;
pub mod observations;
pub mod outcome;
pub mod robot;
pub mod sample;
