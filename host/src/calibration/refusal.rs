//! Why the measurements cannot calibrate this robot, in plain words, and what to do next. Nothing is
//! computed here: what was found out stands in the [objection](super::objection) and in the
//! [findings](super::investigation).

mod advice;
mod explain;
mod fit;
mod judgement;
mod noise;
mod refused;
mod robust;
mod sensor_frame;
mod stream;

pub(crate) use explain::Explainer;
pub use refused::Refused;
pub(crate) use sensor_frame::sensor_frame;
