//! Samples to parameters, by any of the three estimators. Nothing is judged here.
//!
//! ```text
//! RobotFile, Readings, Options ─→ instruments, rows ─→ fkm | joint | ikm ─→ Solution
//!                                       ↑   noise of each kind, until it settles  │
//!                                       └─────────────────────────────────────────┘
//! ```

pub mod covariance;
mod estimators;
pub mod observations;
pub mod options;
pub mod solution;
mod solve;

pub(crate) use estimators::FromClosures;
pub use observations::Unsolved;
pub use options::{Frame, Method, Options};
pub use solution::Solution;
pub(crate) use solve::from_elsewhere;
pub use solve::solve;
