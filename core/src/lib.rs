//! Kinematic calibration of Delta parallel robots, for the robot's own controller: from joint angles and
//! measured positions of the platform to the 24 geometric parameters that explain them, with their
//! uncertainty, or the reason why these measurements cannot tell.
//!
//! `no_std`, no allocation, no `unsafe`, no panic; `f32` or `f64`; the same bits on host and target.
//! Angles are in radians, lengths in any one unit that the caller chooses.
//!
//! ```
//! use delta_cal::{ArmIndex, IkmCalibrator, Noise, Parameter, Sample, Settings, SymmetricRobot};
//! # fn main() -> Result<(), Box<dyn core::error::Error>> {
//! // The robot as drawn, mm, and the one that was built.
//! let drawn = SymmetricRobot { base_radius: 194.0, platform_radius: 30.0, upper_arm: 260.0, forearm: 480.0 };
//! let built = SymmetricRobot { upper_arm: 260.7, forearm: 479.1, ..drawn }.robot()?;
//!
//! // One σ of a measured coordinate: 0.02 mm. The joint angles are taken as exact.
//! let settings = Settings::default().with_noise(Noise::new(0.02, 0.0)?);
//! let mut calibrator = IkmCalibrator::new(&drawn.robot()?, &settings);
//! for k in 0..20 {
//!     let t = f64::from(k);
//!     let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
//!     // Here the position is computed; on a robot it is measured.
//!     calibrator.add(&Sample { joints, position: built.forward(&joints)? })?;
//! }
//!
//! let outcome = calibrator.calibrate()?;
//! let arm = &outcome.arms[ArmIndex::First.index()];
//! assert!((arm.arm.lb() - 479.1).abs() < 1e-6);
//! assert!(arm.standard_deviation(Parameter::Lb).is_some_and(|sigma| sigma < 1.0));
//! // Where the platform really is at these joint angles.
//! let position = outcome.robot.forward(&[0.1, 0.2, 0.3])?;
//! # assert!((position - built.forward(&[0.1, 0.2, 0.3])?).norm() < 1e-6);
//! # Ok(())
//! # }
//! ```
//!
//! There are three calibrators, with the same five calls: `add`, `solve`, which begins, `step`, which is short and
//! fits between the turns of a control loop, `outcome` and `reset`.
//!
//! | calibrator | solves | from | memory |
//! | --- | --- | --- | --- |
//! | [`IkmCalibrator`] | each arm by itself | complete positions | constant |
//! | [`JointCalibrator`] | all 24 parameters together | complete positions | constant |
//! | [`FkmCalibrator`] | the same, and where the instruments are | touches, distances, single coordinates | rows |
//!
//! The examples show whole programs: `calibrate`, `stream` (with a gate against wrong samples) and `firmware`.
//!
//! The modules follow the data, each using only those above it:
//!
//! | module | holds |
//! | --- | --- |
//! | [`robot`] | the three arms and their 24 parameters |
//! | [`frame`] | a change of Cartesian frame, and the one that fits two sets of points |
//! | [`kinematics`] | where the platform is at given joint angles, and back; singularities, joint limits |
//! | [`samples`] | measurements, their noise, and the factor that keeps what they say |
//! | [`calibration`] | settings, calibrators, outcome, refusal |
//! | [`observations`] | heights, distances and single coordinates, and the calibration from them |
//! | [`stream`] | gate and forgetting, for samples that keep coming |
//! | [`snapshot`] | what a calibrator has seen, as bytes that outlast a power cut |
//!
//! Cargo features, none of them on by default: `simulate` adds random poses and simulated measurements
//! (module `simulate`), `serde` adds `Serialize` and `Deserialize` of robots, samples, settings and
//! outcomes, `defmt` adds `defmt::Format`, `linear` adds robots whose elbows are carriages on towers, and
//! `transmission` adds gears and encoders that are not exact.
//!
//! Vectors and matrices are those of [`nalgebra`], which is re-exported so that your crate uses the same
//! version.

#![forbid(unsafe_code)]
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

pub mod calibration;
#[cfg(feature = "defmt")]
mod format;
pub mod frame;
pub mod kinematics;
pub mod observations;
mod real;
pub mod robot;
pub mod samples;
#[cfg(feature = "serde")]
mod serialization;
#[cfg(feature = "simulate")]
pub mod simulate;
pub mod snapshot;
mod state;
pub mod stream;

pub use calibration::{
    IkmCalibrator, JointCalibrator, Progress, Refusal, RobotOutcome, Settings, Tolerance,
};
pub use nalgebra;
pub use observations::FkmCalibrator;
pub use real::Real;
pub use robot::{ArmIndex, Parameter, Robot, SymmetricRobot};
pub use samples::{Noise, Sample};

/// The README's example, compiled and run with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
