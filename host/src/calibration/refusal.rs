//! Why the measurements cannot calibrate this robot, in plain words, and what to do next. Nothing is
//! computed here: what was found out stands in the objection and in the
//! findings.

mod explain;
mod fit;
mod judgement;
mod noise;
mod robust;
mod stream;

pub(crate) use explain::Explainer;
