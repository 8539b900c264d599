//! What is stated of a robot: arguments to what its file holds.

use crate::arrays::{numbers, several};
use crate::errors::{type_error, value_error};
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::{Drive, Transmission};
use delta_cal::{Noise, Parameter, Robot as Geometry, Tolerance};
use delta_cal_host::RobotFile;
use delta_cal_host::files::convention::Convention;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// σ of angles above these, radians, are degrees.
const LARGEST_ANGLE: f64 = 0.2;
pub(crate) const LARGEST_ZERO: f64 = 0.6;

pub(crate) const FRAMES: &str = "\"base\" or \"sensor\"";
pub(crate) const METHODS: &str = "\"joint\", \"ikm\" or \"fkm\"";

/// One of some words.
pub(crate) fn word<T: DeserializeOwned>(argument: &str, given: &str, all: &str) -> PyResult<T> {
    let found = serde_json::from_value(given.into());
    found.map_err(|_| value_error(argument, format!("{given:?}; {all} is needed")))
}

/// What is stated in place of what a robot has.
pub(crate) struct Stated<'py> {
    pub(crate) parameters: Option<Bound<'py, PyAny>>,
    pub(crate) transmissions: Option<Bound<'py, PyAny>>,
    pub(crate) limits: Option<Bound<'py, PyAny>>,
    pub(crate) noise: Option<Bound<'py, PyAny>>,
    pub(crate) tolerance: Option<Bound<'py, PyAny>>,
    pub(crate) zero: Option<f64>,
    /// Sections of the robot file by their names.
    pub(crate) sections: Bound<'py, PyDict>,
}

impl<'py> Stated<'py> {
    /// Of the arguments by their names; `noise` and `tolerance` may be sections themselves.
    pub(crate) fn of(py: Python<'py>, given: Option<&Bound<'py, PyDict>>) -> PyResult<Self> {
        let sections = given.map_or_else(|| Ok(PyDict::new(py)), PyDictMethods::copy)?;
        let take = |name: &str| -> PyResult<Option<Bound<'py, PyAny>>> {
            let Some(own) = sections.get_item(name)? else {
                return Ok(None);
            };
            if own.is_instance_of::<PyDict>() {
                return Ok(None);
            }
            sections.del_item(name)?;
            Ok((!own.is_none()).then_some(own))
        };
        Ok(Self {
            parameters: take("parameters")?,
            transmissions: take("transmissions")?,
            limits: take("limits")?,
            noise: take("noise")?,
            tolerance: take("tolerance")?,
            zero: match take("zero")? {
                Some(zero) => Some(zero.extract().map_err(|_| {
                    type_error("zero", "a standard uncertainty in radians is needed")
                })?),
                None => None,
            },
            sections,
        })
    }
}

/// Keys of `more` replace those of `own`; null removes one.
pub(crate) fn merge(own: &mut Value, more: Value) {
    match (own, more) {
        (Value::Object(own), Value::Object(more)) => {
            for (key, value) in more {
                if value.is_null() {
                    own.remove(&key);
                } else {
                    merge(own.entry(key).or_insert(Value::Null), value);
                }
            }
        }
        (own, more) => *own = more,
    }
}

pub(crate) fn not_degrees(argument: &str, angle: f64, largest: f64) -> PyResult<()> {
    if angle <= largest || angle.is_nan() {
        return Ok(());
    }
    let cause = format!(
        "σ of {angle} rad is {:.0}°, above {largest} rad; angles are radians (numpy.deg2rad converts)",
        angle.to_degrees()
    );
    Err(value_error(argument, cause))
}

/// (σ of a coordinate in mm, or of each axis, σ of a joint).
pub(crate) fn noise_of(noise: &Bound<'_, PyAny>) -> PyResult<Noise<f64>> {
    let wanted = || {
        let cause = "(position, joint) is needed: standard uncertainties in mm and radians";
        value_error("noise", cause)
    };
    let parts: Vec<Bound<'_, PyAny>> = noise.extract().map_err(|_| wanted())?;
    let [position, joint] = &parts[..] else {
        return Err(wanted());
    };
    let joint: f64 = joint.extract().map_err(|_| wanted())?;
    let axes = numbers("noise", position)?;
    let noise = match *axes.as_slice()? {
        [position] => Noise::new(position, joint),
        [x, y, z] => Noise::by_axis([x, y, z], joint),
        _ => return Err(wanted()),
    };
    noise.map_err(|error| value_error("noise", error))
}

/// (σ of lengths in mm, σ of angles in radians), with what else a file states.
pub(crate) fn tolerance_of(given: &Bound<'_, PyAny>, file: &RobotFile) -> PyResult<Tolerance<f64>> {
    let [length, angle] = several("tolerance", given, "(length, angle) in mm and radians")?;
    not_degrees("tolerance", angle, LARGEST_ANGLE)?;
    let [arm, ..] = file.robot.arms();
    if length > arm.lb() {
        let cause = format!("σ of {length} mm is longer than the forearm");
        return Err(value_error("tolerance", cause));
    }
    let new = Tolerance::new(length, angle).map_err(|error| value_error("tolerance", error))?;
    let old = file.tolerance;
    let kept = match (file.robot.drive(), old) {
        (Drive::Linear, Some(old)) => new
            .with_linear(old.of(Parameter::Zero), old.of(Parameter::Scale))
            .and_then(|own| own.with_radius(old.radius()))
            .and_then(|own| own.with_forearm(old.forearm())),
        _ => match old.and_then(|own| own.joint_zero()) {
            Some(zero) => new.with_joint_zero(zero),
            None => Ok(new),
        },
    };
    kept.map_err(|error| value_error("tolerance", error))
}

/// So many numbers of each arm.
fn of_arms<const N: usize>(
    argument: &'static str,
    given: &Bound<'_, PyAny>,
) -> PyResult<[[f64; N]; 3]> {
    let given = numbers(argument, given)?;
    let shape = given.shape();
    match given.as_slice()?.as_chunks::<N>() {
        (&[first, second, third], []) if shape == [3, N] => Ok([first, second, third]),
        _ => {
            let cause = format!("shape {shape:?}; an array of shape (3, {N}) is needed");
            Err(value_error(argument, cause))
        }
    }
}

/// The parameters of three arms, in the internal axes.
pub(crate) fn arms_of(
    convention: &Convention,
    given: &Bound<'_, PyAny>,
) -> PyResult<[[f64; 8]; 3]> {
    let arms = of_arms::<8>("parameters", given)?;
    let signs = convention.signs();
    Ok(std::array::from_fn(|arm| {
        std::array::from_fn(|place| signs[place] * arms[arm][place])
    }))
}

pub(crate) fn with_transmissions(
    file: &RobotFile,
    given: &Bound<'_, PyAny>,
) -> PyResult<Geometry<f64>> {
    let arms = of_arms::<5>("transmissions", given)?;
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
