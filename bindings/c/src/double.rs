//! The functions in double precision.
#![allow(clippy::duplicate_mod)] // the same text for both scalars

macro_rules! suffix {
    () => {
        "_f64"
    };
}

/// `double` in C.
pub type Real = f64;

#[path = "scalar/mod.rs"]
mod scalar;
pub use scalar::*;
