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
mod robust;
pub mod solution;
pub(crate) mod solve;

pub use observations::Unsolved;
pub use options::{Frame, Method, Options};
pub use robust::{Loss, RobustRefusal};
pub use solution::Solution;
pub use solve::solve;
