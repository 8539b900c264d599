//! What a calibrator consists of: what it keeps of the samples, and how it solves them.

use super::minimizer::Progress;
use super::refusal::Refusal;
use super::settings::Settings;
use crate::Real;
use crate::robot::Robot;
use crate::samples::{Forgetting, MergeError, NominalArm, Sample, SampleError};
use crate::state::State;
use core::fmt::Debug;

/// What is kept of samples.
pub trait Samples<T: Real>: Clone + Debug + PartialEq + State<T> {
    /// None yet.
    fn new(robot: &Robot<T>, settings: &Settings<T>) -> Self;
    /// Drops all.
    fn reset(&mut self);
    /// Whether the numbers of a sample are usable.
    fn check(&self, sample: &Sample<T>) -> Result<(), SampleError>;
    /// Takes in a sample that is checked.
    fn push(&mut self, sample: &Sample<T>);
    /// The same, and those before it fade.
    fn push_forgetting(&mut self, sample: &Sample<T>, forgetting: &Forgetting<T>);
    /// Takes in samples that are checked, while none waits.
    fn take_in(&mut self, samples: &[Sample<T>]);
    /// Takes in those that wait.
    fn flush(&mut self);
    /// Adds those of another, while none waits here.
    fn merge(&mut self, other: &Self) -> Result<(), MergeError>;
    /// Lets all count λ times as much, while none waits.
    fn forget(&mut self, lambda: T);
    /// How many came.
    fn count(&self) -> u64;
    /// The robot before calibration.
    fn robot(&self) -> Robot<T>;
    /// What the calibration assumes.
    fn settings(&self) -> &Settings<T>;
    /// What the samples are expressed against.
    fn nominal_arms(&self) -> [&NominalArm<T>; 3];
}

/// How samples are solved, of which none waits.
pub trait Solver<T: Real, S>: Clone + Debug {
    /// Before it begins.
    fn vacant() -> Self;
    /// Begins anew.
    fn begin(&mut self, samples: &S) -> Result<(), Refusal>;
    /// One short step.
    fn step(&mut self, samples: &S) -> Result<Progress, Refusal>;
}
