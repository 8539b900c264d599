//! A controller that calibrates itself, driven over a link: see [`delta_cal_protocol`].
//!
//! ```text
//! Port ─→ open ─→ Transport ─→ Client ─→ session: calibrate, apply, adopt ─→ report
//! ```

mod client;
mod link;
#[cfg(feature = "cli")]
pub(crate) mod report;
mod session;

use crate::accuracy::position_error::position_errors;
use crate::accuracy::uncertainty::WorkspacePoses;
use crate::files::{InputError, Readings, RobotFile, Tool};
use crate::text::{in_file_units, small};
pub use client::{Client, Patience};
use delta_cal::robot::{ParameterKind, Transmission};
use delta_cal::{ArmIndex, Parameter, Real, Robot, Sample, Tolerance};
use delta_cal_protocol::{Begin, Estimator, Geometry, Wire};
pub use link::{DeviceError, Link, Port, Transport};
pub use session::{Finished, Outcome, adopt, apply, calibrate, in_use};

/// A number on the wire: `f32` or `f64`.
pub trait Number: Real + Wire {}

impl<T: Real + Wire> Number for T {}

/// Accepted difference of a nominal parameter, in rounding errors.
const ROUNDINGS: f64 = 4.0;
/// A position difference above this fraction of the forearm indicates a different robot.
const ANOTHER_ROBOT: f64 = 0.05;
/// Most parameters named in a message.
const NAMED: usize = 3;

/// The request that starts a session: tolerance and noise of a robot file, rounded to the controller's number type. The
/// session number is 0 until the session starts.
pub fn begin<T: Number>(robot: &RobotFile, estimator: Estimator) -> Begin<T> {
    let rounded = T::from_f64;
    let tolerance = robot.tolerance.as_ref();
    Begin {
        session: 0,
        tolerance: tolerance.map(|own| {
            let [length, angle] = [own.length(), own.angle()];
            (rounded(length), rounded(angle))
        }),
        joint_zero: tolerance.and_then(Tolerance::joint_zero).map(rounded),
        noise: robot.noise.map(|noise| {
            let axes = noise.position_by_axis().map(rounded);
            (axes, rounded(noise.joint()))
        }),
        estimator,
        gate: false,
        forgetting: None,
    }
}

/// The samples of a file, rounded to the controller's number type.
pub fn samples<T: Number>(file: &Readings) -> Vec<Sample<T>> {
    let samples = file.samples().map(|row| Sample {
        joints: row.value.joints.map(T::from_f64),
        position: row.value.position.map(T::from_f64),
    });
    samples.collect()
}

/// The robot with this geometry.
///
/// # Errors
/// The numbers are not a robot's geometry.
pub fn robot<T: Real>(geometry: &Geometry<T>) -> Result<Robot<f64>, DeviceError> {
    let robot = geometry.robot().ok();
    let robot = robot.and_then(|own| own.cast().ok());
    robot.ok_or(DeviceError::ImpossibleGeometry)
}

/// Checks that a calibrated robot is the controller's: its positions are near the nominal ones. Returns the difference
/// over the workspace, rms, mm.
///
/// # Errors
/// Positions so far off that they are another robot's.
pub fn check_calibrated(file: &RobotFile, nominal: &Robot<f64>) -> Result<f64, InputError> {
    let poses = WorkspacePoses::of(&file.robot, &file.reach());
    let joints = poses.inside.iter().map(|pose| pose.joints);
    let none = Tool::default();
    let [rms, _] = position_errors((&file.robot, &none), (nominal, &none), joints);
    let [arm, ..] = nominal.arms();
    if rms <= ANOTHER_ROBOT * arm.lb() {
        return Ok(rms);
    }
    let cause = format!(
        "not the controller's robot: its positions differ by {} mm rms from the nominal ones",
        small(rms)
    );
    Err(InputError::new(&file.name, cause).with_remedy(
        "delta-cal device --port PORT parameters --nominal writes the controller's nominal robot",
    ))
}

/// Checks that a robot file holds the controller's nominal geometry, up to the rounding of a controller that computed
/// it itself.
///
/// # Errors
/// Parameters that differ.
pub fn check_nominal<T: Number>(file: &RobotFile, nominal: &Geometry<T>) -> Result<(), InputError> {
    let mut different = Vec::new();
    let transmissions = nominal.transmissions.unwrap_or([[T::ZERO; 5]; 3]);
    let controllers = nominal.arms.into_iter().zip(transmissions);
    for (index, (parameters, transmission)) in ArmIndex::ALL.into_iter().zip(controllers) {
        let arm = file.robot.arm(index);
        let own = arm.parameters();
        let longest = own.into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for ((parameter, own), device) in Parameter::ROTARY.into_iter().zip(own).zip(parameters) {
            let size = match parameter.kind() {
                ParameterKind::Length => longest,
                ParameterKind::Angle | ParameterKind::Ratio => std::f64::consts::TAU,
            };
            let device = device.to_f64();
            if !((own - device).abs() <= ROUNDINGS * T::EPSILON.to_f64() * size) {
                different.push(format!(
                    "{parameter} of {index} is {} in the file and {} in the controller",
                    in_file_units(parameter, file.convention.parameter(parameter, own)),
                    in_file_units(parameter, file.convention.parameter(parameter, device))
                ));
            }
        }
        let own = arm.transmission().unwrap_or(&Transmission::EXACT).numbers();
        if own.map(T::from_f64) != transmission {
            different.push(format!("the transmission of {index} differs"));
        }
    }
    if different.is_empty() {
        return Ok(());
    }
    let more = match different.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!("; and {more} more"),
    };
    different.truncate(NAMED);
    let cause = format!(
        "not the controller's nominal robot: {}{more}",
        different.join("; ")
    );
    Err(InputError::new(&file.name, cause).with_remedy(
        "write it with delta-cal device --port PORT parameters --nominal --output ROBOT.toml",
    ))
}
