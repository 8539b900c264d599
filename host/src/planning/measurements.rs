//! Which measurements to take with an instrument that sees less than a position: a plate and gauge blocks, a
//! ball bar, a wire sensor, a calliper, a camera. And what each instrument would bring.
//!
//! ```text
//! RobotFile, Setup ─→ candidates ─→ rows of each (the core's) ─→ exchange ─→ MeasurementPlan
//!                                                                    └→ Precision, beside random ones
//! ```

mod additions;
mod candidates;
mod check;
mod compare;
mod draws;
mod instrument;
mod kind;
mod places;
mod plan;
mod planned;
mod precision;
mod request;
mod sequence;
mod setup;

pub use check::MeasurementCheck;
pub use compare::{COUNTS, Comparison, compare};
pub use draws::random_measurements;
pub use instrument::Instrument;
pub use kind::{Kind, Wish, Wishes};
pub use plan::{MeasurementPlan, plan_measurements};
pub use planned::Planned;
pub use precision::Precision;
pub(crate) use precision::covariance_after;
pub use request::{CheckRequest, LEAST_MEASUREMENTS, MeasurementRequest, NoiseOf};
pub use setup::{PLANE, Setup};
