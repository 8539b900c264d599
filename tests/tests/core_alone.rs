//! The core by itself: what `cargo verify mutants` runs for every change of its arithmetic.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // in tests a panic is the failure

mod derivatives;
mod drift;
mod exact;
mod frames;
mod free_frame;
mod gate;
mod hard_cases;
mod held_out;
mod joint;
mod kinematics;
mod linear;
mod messages;
mod observations;
mod oracles;
mod outcomes;
mod refusals;
mod robust_estimate;
mod samples;
mod single_precision;
mod statistics;
mod stream_calibrator;
mod stream_figures;
mod streams;
mod thresholds;
