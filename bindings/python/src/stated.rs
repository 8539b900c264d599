//! What is stated of a robot: arguments, which `delta_cal/_stated.py` prepares, to what its file holds.

use crate::errors::value_error;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Drive, Transmission};
use delta_cal::{Robot as Geometry, Tolerance};
use delta_cal_host::RobotFile;
use delta_cal_host::files::convention::Convention;
use delta_cal_host::files::robot_file::with_kinds;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

pub(crate) const FRAMES: &str = "\"base\" or \"sensor\"";
pub(crate) const METHODS: &str = "\"joint\", \"ikm\" or \"fkm\"";

/// One of some words.
pub(crate) fn word<T: DeserializeOwned>(argument: &str, given: &str, all: &str) -> PyResult<T> {
    let found = serde_json::from_value(given.into());
    found.map_err(|_| value_error(argument, format!("{given:?}; {all} is needed")))
}

/// What is stated in place of what a robot has.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Stated {
    pub(crate) parameters: Option<[[f64; 8]; 3]>,
    pub(crate) transmissions: Option<[[f64; 5]; 3]>,
    pub(crate) limits: Option<[f64; 2]>,
    /// σ of each coordinate, and of a joint.
    pub(crate) noise: Option<([f64; 3], f64)>,
    /// σ of lengths and angles.
    pub(crate) tolerance: Option<[f64; 2]>,
    pub(crate) zero: Option<f64>,
    /// Of all that is stated.
    pub(crate) names: String,
}

/// With what else a file states.
pub(crate) fn tolerance_of(
    [length, angle]: [f64; 2],
    file: &RobotFile,
) -> PyResult<Tolerance<f64>> {
    let [arm, ..] = file.robot.arms();
    if length > arm.lb() {
        let cause = format!("σ of {length:?} mm is longer than the forearm");
        return Err(value_error("tolerance", cause));
    }
    let stated = match file.tolerance {
        Some(own) => with_kinds(&own, [length, angle], 1.0),
        None => Tolerance::new(length, angle),
    };
    stated.map_err(|error| value_error("tolerance", error))
}

/// The parameters of three arms, from a convention to the internal axes and back; no zero is negative.
pub(crate) fn arms_of(convention: &Convention, arms: &[[f64; 8]; 3]) -> [[f64; 8]; 3] {
    let signs = convention.signs();
    arms.map(|arm| std::array::from_fn(|place| signs[place] * arm[place] + 0.0))
}

pub(crate) fn with_transmissions(file: &RobotFile, arms: [[f64; 5]; 3]) -> PyResult<Geometry<f64>> {
    let fault = |error| value_error("transmissions", error);
    let own = |arm: usize| Transmission::new(file.convention.transmission(arms[arm]));
    let all = [
        own(0).map_err(fault)?,
        own(1).map_err(fault)?,
        own(2).map_err(fault)?,
    ];
    file.robot.with_transmissions(all).map_err(fault)
}

pub(crate) fn limits_of((low, high): (f64, f64), drive: Drive) -> PyResult<JointLimits<f64>> {
    let limits = match drive {
        Drive::Rotary => JointLimits::new(low, high),
        Drive::Linear => JointLimits::travel(low, high),
    };
    limits.map_err(|error| {
        let unit = match drive {
            Drive::Rotary => " (radians)",
            Drive::Linear => " (mm)",
        };
        value_error("limits", format!("{error}{unit}"))
    })
}
