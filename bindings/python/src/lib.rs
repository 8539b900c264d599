//! The extension module of the Python package `delta_cal`: the host library over NumPy arrays.
//!
//! ```text
//! files        what is written in Python
//! errors       refusals, faults and wrong words as Python exceptions
//! wide         numbers and vectors of formulas without branches
//! lanes        kinematics of many rows at once, in vector instructions
//! arrays       rows of numbers to arrays; the cores
//! printer      the files of a printer's configuration
//! robot        the class Robot: kinematics of whole arrays
//! samples      the class Samples: files, or columns of arrays and frames
//! calibration  `calibrate`, and its report
//! tasks        plan, validate, export, import_, simulate, workspace, compare
//! ```
//!
//! Whatever its source, a sample passes through the reader of samples files: arrays give the same bits and the same
//! refusals as the command does with a file.

#![forbid(unsafe_code)]
// PyO3 hands over owned values and references to them as Python's calls need them.
#![allow(clippy::needless_pass_by_value, clippy::too_many_arguments)]

mod arrays;
mod calibration;
mod errors;
mod files;
mod lanes;
mod printer;
mod robot;
mod samples;
mod tasks;
mod wide;

use pyo3::prelude::*;

/// The compiled part of `delta_cal`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::calibration::{Report, calibrate};
    #[pymodule_export]
    use crate::robot::Robot;
    #[pymodule_export]
    use crate::samples::{Samples, samples_of_columns};
    #[pymodule_export]
    use crate::tasks::{compare, export, import_, plan, simulate, validate, workspace};

    use numpy::PyArray1;
    use pyo3::prelude::*;

    /// NumPy is loaded now: later an interrupt could come between.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        drop(PyArray1::<f64>::from_vec(module.py(), Vec::new()));
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
