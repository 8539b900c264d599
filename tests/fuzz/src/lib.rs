//! The fuzz targets: see `README.md` beside this package's `Cargo.toml`.
//!
//! A target reads robots, samples and settings, files, or frames from the bytes, uses them as the program would, and
//! asserts what is promised of the result. A panic is a finding.

#![forbid(unsafe_code)]
// A panic is how a fuzz target fails.
#![allow(clippy::expect_used, clippy::panic, clippy::missing_panics_doc)]

/// A target that runs a function in single or double precision, as the first byte of the input says.
macro_rules! in_either_precision {
    ($target:ident, $function:ident) => {
        #[doc = concat!("Runs `", stringify!($function), "` in `f32` or `f64`, as the first byte says.")]
        pub fn $target(data: &[u8]) {
            let mut source = Source::new(data);
            if source.byte() & 1 == 0 {
                $function::<f32>(&mut source);
            } else {
                $function::<f64>(&mut source);
            }
        }
    };
}

mod calibration;
mod controller;
mod driver;
mod files;
mod kinematics;
mod numbers;
mod solver;
mod store;

pub use calibration::calibration;
pub use controller::controller;
pub use driver::driver;
pub use files::{campaign_file, robot_file, samples_file};
pub use kinematics::kinematics;
pub use solver::solver;
pub use store::store;

/// The target with this name.
pub fn target(name: &str) -> fn(&[u8]) {
    match name {
        "robot_file" => robot_file,
        "samples_file" => samples_file,
        "campaign_file" => campaign_file,
        "calibration" => calibration,
        "controller" => controller,
        "driver" => driver,
        "store" => store,
        "kinematics" => kinematics,
        "solver" => solver,
        _ => panic!("no target {name}"),
    }
}
