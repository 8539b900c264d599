//! Everything that exists once for each scalar; compiled twice.

use super::Real;

macro_rules! name {
    ($name:literal) => {
        concat!("dcal_", $name, suffix!())
    };
}

pub mod fkm;
pub mod gate;
pub mod ikm;
pub mod joint;
pub mod outcome;
pub mod robot;
pub mod sample;
