//! Samples that come one by one for as long as the robot works: a [`Gate`] that rejects wrong ones before
//! they are taken in, [`Forgetting`] for a robot that changes, and samples [held out](HeldOut) to validate
//! a calibration.

mod forgetting;
mod gate;
mod held_out;

pub use forgetting::{Forgetting, ForgettingError};
pub use gate::{Alarm, Gate, GateCounts, GateError, Innovation, Untested, Verdict};
pub use held_out::{HeldOut, HeldOutRefusal, Validation};
