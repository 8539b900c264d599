//! The controller, run in this process and driven with real frames: sessions,
//! faults of the link, faults of the store, and the control loop beside it.

// Numbers that must be the same are compared as such.
#![allow(clippy::float_cmp)]

mod control_loop;
pub(crate) mod driver;
mod motion;
mod parameters;
mod sessions;
mod store;
pub(crate) mod streams;
