//! Measurements of less than a full position: the height above a plate, the distance from a point or between two poses,
//! one or two coordinates, in any mixture within a row; and calibration from them.
//!
//! ```text
//! minimise over P and the unknowns u of the instruments
//!     Σ |Lₖ⁻¹ (mₖ − h(FK(P; qₖ), u))|²  +  Σ ((pⱼ − pⱼ,nominal)/toleranceⱼ)²
//!     Lₖ Lₖᵀ = diag σ²  +  σq² H_q H_qᵀ
//! ```
//!
//! h is the expected reading of the row's instruments, and H_q its derivative with respect to the row's joint angles:
//! all readings of a row share the joint noise. Lₖ is evaluated at the nominal robot.
//!
//! Without x, y and z, only the tolerance determines the robot's placement in space; the measurements determine
//! relative positions.
//!
//! Firmware uses [`FkmCalibrator`]; [`ObservationProblem`] is for programs that hold and weigh the rows themselves.

mod calibrator;
mod check;
mod equation;
mod instruments;
mod linearization;
mod observation;
mod problem;
mod snapshots;
mod solve;
mod start;

pub use crate::calibration::Instrument;
pub use calibrator::FkmCalibrator;
pub(crate) use equation::{At, Equation};
pub use instruments::{Instruments, ObservationNoise, Plane, Point};
pub(crate) use linearization::Pose;
pub(crate) use observation::READINGS;
pub use observation::{
    Distance, DistanceFrom, Height, Observation, ObservationError, ObservationRow,
};
pub use problem::{ObservationProblem, PrepareError};
pub use solve::ObservationOutcome;
pub(crate) use start::{align, nearest_rotation};
