//! Kinematic calibration of Delta parallel robots, for the robot's own controller.
//!
//! `no_std`, no allocation, no `unsafe`, no panic; the same bits on host and target.
//!
//! The modules follow the data: [`Robot`] (24 parameters) → kinematics (where the platform is) →
//! [`Sample`]s (where it was measured) → calibration → [`RobotOutcome`] or [`Refusal`].
//!
//! Angles are in radians, lengths in any one unit that the caller chooses.

#![forbid(unsafe_code)]
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

mod calibration;
#[cfg(feature = "defmt")]
mod format;
mod kinematics;
mod real;
mod robot;
mod samples;

pub use calibration::{
    Alarm, ArmOutcome, ArmProblem, ArmSolver, Calibrator, Gate, GateCounts, GateError, HeldOut,
    HeldOutRefusal, Innovation, Loss, Method, Progress, Refusal, RobotCalibrator, RobotOutcome,
    RobotSolver, RobustOutcome, RobustRefusal, Settings, Start, StartUsed, StoredCalibrator,
    Termination, Tolerance, ToleranceError, Untested, Validation, Verdict, WeighedSample, Worth,
    robust_fit,
};
pub use calibration::{limits, step_control};
pub use kinematics::{Conditioning, KinematicsError, PlatformJacobian, Singularity};
pub use real::Real;
pub use robot::{
    AlignmentError, Arm, ArmBasis, ArmIndex, GeometryError, Parameter, ParameterKind,
    RigidTransform, Robot, SymmetricRobot,
};
pub use samples::{
    ArmFactor, JointLimits, JointLimitsError, Memory, MemoryError, MergeError, Noise, NoiseError,
    PoseError, Reference, Sample, SampleError, StoredArmSamples, StoredError, random_pose,
    simulate_sample, standard_normal,
};

/// The README's example, compiled and run with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
