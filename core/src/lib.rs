//! Kinematic calibration of Delta parallel robots, for the robot's own controller: joint angles and measured platform
//! positions in; the 24 geometric parameters with their uncertainties out, or the reason why the measurements cannot
//! determine them.
//!
//! `no_std`, no allocation, no `unsafe`, no panics; `f32` or `f64`; bit-identical results on host and target.
//! Angles are in radians, lengths in any one unit of the caller's choice.
//!
//! ```
//! use delta_cal::{ArmIndex, IkmCalibrator, Noise, Parameter, Sample, Settings, SymmetricRobot};
//! # fn main() -> Result<(), Box<dyn core::error::Error>> {
//! // The robot as designed, mm, and as built.
//! let drawn = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
//! let built = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..drawn }.robot()?;
//!
//! // σ of a measured coordinate: 0.02 mm. The joint angles are treated as exact.
//! let settings = Settings::default().with_noise(Noise::new(0.02, 0.0)?);
//! let mut calibrator = IkmCalibrator::new(&drawn.robot()?, &settings);
//! for k in 0..20 {
//!     let t = f64::from(k);
//!     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
//!     // The position is computed here; on a real robot it is measured.
//!     calibrator.add(&Sample { joints, position: built.forward(&joints)? })?;
//! }
//!
//! let outcome = calibrator.calibrate()?;
//! let arm = &outcome.arms[ArmIndex::First.index()];
//! assert!((arm.arm.lb() - 479.1).abs() < 1e-6);
//! assert!(arm.standard_deviation(Parameter::Lb).is_some_and(|sigma| sigma < 1.0));
//! // The platform's actual position at these joint angles.
//! let position = outcome.robot.forward(&[0.1, 0.2, 0.3])?;
//! # assert!((position - built.forward(&[0.1, 0.2, 0.3])?).norm() < 1e-6);
//! # Ok(())
//! # }
//! ```
//!
//! The three calibrators share five calls: `add`, `solve`, which starts a solve, `step`, which is short enough to run
//! between the cycles of a control loop, `outcome` and `reset`.
//!
//! | calibrator | solves | from | memory |
//! | --- | --- | --- | --- |
//! | [`IkmCalibrator`] | each arm separately | complete positions | constant |
//! | [`JointCalibrator`] | all 24 parameters together | complete positions | constant |
//! | [`FkmCalibrator`] | the same, and instrument placement | touches, distances, single coordinates | rows |
//!
//! The package `delta-cal-controller` is a whole controller; the repository's `firmware-example` has it on boards, and two
//! small ones.
//!
//! The modules follow the flow of data; each uses only those above it:
//!
//! | module | contents |
//! | --- | --- |
//! | [`robot`] | the three arms and their 24 parameters |
//! | [`frame`] | Cartesian frames, and the rigid alignment of two point sets |
//! | [`kinematics`] | forward and inverse kinematics, singularities, joint limits |
//! | [`samples`] | measurements, their noise, and the triangular factor that accumulates them |
//! | [`calibration`] | settings, calibrators, outcomes, refusals |
//! | [`observations`] | heights, distances and single coordinates, and calibration from them |
//! | [`stream`] | gating and forgetting for continuous streams of samples |
//! | [`snapshot`] | a calibrator's state as bytes, to survive a power cut |
//!
//! Cargo features, all off by default: `simulate` adds random poses and simulated measurements (module `simulate`),
//! `defmt` adds `defmt::Format`, `linear` adds robots whose elbows are carriages on towers, and `transmission` adds
//! imperfect gears and encoders.
//!
//! Vectors and matrices come from [`nalgebra`], which is re-exported so that your crate uses the same version.

#![forbid(unsafe_code)]
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

pub mod calibration;
mod errors;
#[cfg(test)]
mod fixtures;
#[cfg(feature = "defmt")]
mod format;
pub mod frame;
mod kernels;
pub mod kinematics;
pub mod observations;
mod real;
pub mod robot;
pub mod samples;
#[cfg(feature = "simulate")]
pub mod simulate;
pub mod snapshot;
mod state;
pub mod stream;

pub use calibration::{
    IkmCalibrator, JointCalibrator, Progress, Refusal, RobotOutcome, Settings, Tolerance,
};
pub use errors::{Busy, SettingError};
pub use nalgebra;
pub use observations::FkmCalibrator;
pub use real::Real;
pub use robot::{ArmIndex, Parameter, Robot, SymmetricRobot};
pub use samples::{Noise, Sample};

/// Compiles and runs the README's example as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
