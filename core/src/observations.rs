//! Measurements that are less than a position: a height above a plate, a distance from a point or between two
//! poses, one or two coordinates, in any mixture and in one row; and the calibration from them.
//!
//! ```text
//! minimise over P and the unknowns u of the instruments
//!     Σ |Lₖ⁻¹ (mₖ − h(FK(P; qₖ), u))|²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//!     Lₖ Lₖᵀ = diag σ²  +  σq² H_q H_qᵀ
//! ```
//!
//! h is what the instruments of a row would read, and H_q how that changes with the row's joint angles: all
//! readings of a row share the noise of its joints. Lₖ is that of the nominal robot.
//!
//! Without x, y and z the place of the robot in space is known from the tolerance alone. The relative
//! positions are what such measurements determine.

mod calibrator;
mod check;
mod equation;
mod instruments;
mod linearization;
mod observation;
mod problem;
mod solve;
mod start;

pub use crate::calibration::Instrument;
pub use calibrator::{FkmCalibrator, TouchCalibrator};
pub use instruments::{Instruments, ObservationNoise, Plane, Point, PositionFrame};
pub use observation::{
    Distance, DistanceFrom, Height, Observation, ObservationError, ObservationRow,
};
pub use problem::{InstrumentsAt, ObservationProblem, PrepareError};
pub use solve::ObservationOutcome;
pub use start::StartValues;
