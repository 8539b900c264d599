//! The functions in single precision.
#![allow(clippy::duplicate_mod)] // the same text for both scalars

macro_rules! suffix {
    () => {
        "_f32"
    };
}

/// `float` in C.
pub type Real = f32;

#[path = "scalar/mod.rs"]
mod scalar;
pub use scalar::*;
