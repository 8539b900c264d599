//! A controller that calibrates itself, driven over a link: see [`delta_cal_protocol`].
//!
//! ```text
//! Port ─→ open ─→ Transport ─→ Client ─→ session: calibrate, apply, adopt ─→ report
//! ```

mod client;
mod error;
pub mod report;
mod robot;
mod session;
mod transport;

pub use client::{Client, Patience};
pub use error::DeviceError;
pub use robot::{begin, check_calibrated, check_nominal, difference, robot, samples};
pub use session::{Finished, adopt, apply, calibrate, in_use};
pub use transport::{Port, PortError, Serial, Tcp, Transport};

use delta_cal::Real;
use delta_cal_protocol::Wire;

/// A number as it goes over the wire: `f32` or `f64`.
pub trait Number: Real + Wire {}

impl<T: Real + Wire> Number for T {}
