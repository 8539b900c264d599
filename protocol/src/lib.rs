//! What goes over the wire between a controller that calibrates its own robot and whoever drives
//! it: [messages](Request) in [frames](encode).
//!
//! The driver asks, the controller answers each request once; nothing is sent unasked. Any frame may
//! be lost, damaged or repeated, or come late: the driver sends the same request again until it is
//! answered, and every request is made so that a second one changes nothing, also one that comes after
//! others. Lengths are millimetres, angles radians.
//!
//! ```text
//! driver                                   controller
//! Identify ──────────────────────────────→ Identity
//! Begin { session, tolerance, noise } ───→ Taken { next: 0 }
//! Parameters ────────────────────────────→ Parameters { generation, … }
//! Sample { session, index: 0, … } ───────→ Taken { next: 1 }
//! …
//! Solve { session, samples } ────────────→ Status
//! Status ────────────────────────────────→ Status { phase: Solving | Solved | CalibrationRefused }
//! Outcome { session, arm } ──────────────→ Outcome
//! Apply { session, fingerprint, from } ──→ Parameters
//! ```
//!
//! A robot that was calibrated elsewhere: `Adopt` in place of all but `Identify` and `Parameters`.
//!
//! Every number on the wire is written down in this crate, independent of the order in which the core or this crate
//! declares the variants of an enum. A change of them is another [`VERSION`].

#![forbid(unsafe_code)]
#![no_std]

#[cfg(test)]
extern crate std;

mod calibration;
mod frame;
mod geometry;
#[cfg(test)]
mod golden;
mod messages;
mod wire;

pub use frame::{
    Direction, EncodeError, Frame, FrameError, LARGEST_FRAME, Receiver, UNKNOWN_SEQUENCE, VERSION,
    encode,
};
pub use geometry::Geometry;
pub use messages::{
    Adopt, ArmReport, Begin, ControlLoop, Counters, Estimator, Fault, GateStatus, Identity, Origin,
    ParameterSet, Parameters, Phase, Request, Response, RevertTo, SampleMessage, Scalar, Status,
};
pub use wire::{Reader, Wire, Writer};
