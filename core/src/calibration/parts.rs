//! The components of a calibrator: accumulated samples and solver.

use super::minimizer::Progress;
use super::refusal::Refusal;
use super::settings::Settings;
use crate::Real;
use crate::robot::Robot;
use crate::samples::{Forgetting, MergeError, NominalArm, Sample, SampleError};
use crate::state::{Reader, State};
use core::fmt::Debug;

/// Accumulated samples.
pub trait Samples<T: Real>: Clone + Debug + PartialEq + State<T> {
    /// No samples.
    fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self;
    /// Discards all samples: the state of a new object is zeros.
    fn reset(&mut self) {
        self.load(&mut Reader::new(&[]));
    }
    /// Checks that the numbers of a sample are usable.
    fn check(&self, sample: &Sample<T>) -> Result<(), SampleError> {
        NominalArm::check_sample(self.nominal_arms(), sample)
    }
    /// Adds a checked sample.
    fn push(&mut self, sample: &Sample<T>);
    /// Adds a checked sample, and lets earlier ones fade.
    fn push_forgetting(&mut self, sample: &Sample<T>, forgetting: &Forgetting<T>);
    /// Adds checked samples, while none is waiting.
    fn take_in(&mut self, samples: &[Sample<T>]);
    /// Absorbs waiting samples.
    fn flush(&mut self);
    /// Adds the samples of another, while none is waiting here.
    fn merge(&mut self, other: &Self) -> Result<(), MergeError>;
    /// Multiplies the weight of all samples by λ, while none is waiting.
    fn forget(&mut self, lambda: T);
    /// Number of samples received.
    fn count(&self) -> u64;
    /// The uncalibrated robot.
    fn robot(&self) -> Robot<T> {
        Robot::of_valid(self.nominal_arms().map(|nominal| *nominal.arm()))
    }
    /// What the calibration assumes.
    fn settings(&self) -> &Settings<T>;
    /// The nominal arms, relative to which samples are expressed.
    fn nominal_arms(&self) -> [&NominalArm<T>; 3];
}

/// Solves samples, none of which may be waiting.
pub trait Solver<T: Real, S>: Clone + Debug {
    /// A solver that has not started.
    fn vacant() -> Self;
    /// Starts over.
    fn begin(&mut self, samples: &S) -> Result<(), Refusal>;
    /// One short step.
    fn step(&mut self, samples: &S) -> Result<Progress, Refusal>;
}
