//! The protocol between a controller that calibrates its own robot and its driver: [messages](Request) in
//! [frames](encode).
//!
//! The controller answers each of the driver's requests once and sends nothing unasked. Any frame may be lost, damaged,
//! repeated or delayed: the driver repeats a request until it is answered, and every request is idempotent, even if a
//! copy arrives after later requests; only a late `Begin` discards the open session, which the driver then begins again.
//! There is no authentication. Lengths are in millimetres, angles in radians.
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
//! For a robot calibrated elsewhere, `Adopt` replaces everything but `Identify` and `Parameters`.
//!
//! This crate defines every number on the wire, independently of the order in which it or the core declares enum
//! variants. Any change to them requires a new [`VERSION`].

#![forbid(unsafe_code)]
#![no_std]

#[cfg(test)]
extern crate std;

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
    ArmReport, Begin, ControlLoop, Counters, Estimator, Fault, GateStatus, Identity, Motion,
    Origin, ParameterSet, Parameters, Phase, Request, Response, RevertTo, SampleMessage, Scalar,
    Status,
};
pub use wire::{Reader, Wire, Writer};
