//! A controller that calibrates itself, driven over a link: see [`delta_cal_protocol`].
//!
//! ```text
//! Port ─→ open ─→ Transport ─→ Client ─→ session: calibrate, apply, adopt ─→ Finished
//!           └ emulator: QEMU with the example's firmware       └→ report, verify
//! ```

mod client;
mod convert;
mod emulator;
mod error;
mod number;
mod operations;
pub mod report;
mod sending;
mod session;
mod solution;
mod transport;
mod verify;

pub use client::{Client, Patience};
pub use convert::{Measurement, outcome, robot};
pub use emulator::{
    Emulation, Emulator, EmulatorError, FirmwareError, FlashError, Pace, build, check_firmware,
};
pub use error::{DeviceError, RowError};
pub use number::Number;
pub use operations::{
    DeviceFailure, Verified, calibrate_robot, calibrate_robot_from_observations, check_calibrated,
    check_nominal, verify,
};
pub use sending::Sending;
pub use session::{Finished, Step, adopt, apply, calibrate, in_use};
pub use solution::Solution;
pub use transport::{Board, Port, PortError, Serial, Tcp, Transport};
pub use verify::{Comparison, Difference, Ended, compare, solve_here};
