use crate::stream::Stream;
use core::fmt::Debug;
use delta_cal::Real;
use delta_cal_protocol::{Scalar, Wire};

#[cfg(all(target_os = "none", feature = "defmt"))]
mod logged {
    pub(super) use defmt::Format as Logged;
}

#[cfg(not(all(target_os = "none", feature = "defmt")))]
mod logged {
    /// Types that can be logged; every type if there is no logger.
    pub trait Logged {}
    impl<T> Logged for T {}
}

/// The firmware's scalar type: `f32` or `f64`.
pub trait Number: Real + Wire + logged::Logged {
    /// Its name on the wire.
    const SCALAR: Scalar;
    /// Buffer for a session's samples while they are read from or written to flash.
    type StreamBytes: AsRef<[u8]> + AsMut<[u8]> + Debug;
    /// All zeros.
    const NO_STREAM_BYTES: Self::StreamBytes;
}

/// Record content that fits into 8 KiB and 16 KiB of flash with header and checksum, bytes.
const SINGLE: usize = 8_128;
const DOUBLE: usize = 16_320;

/// Maximum size of the request that precedes the snapshot, bytes.
const BEGIN: usize = 100;
const _: () = assert!(Stream::<f32>::SNAPSHOT_BYTES + BEGIN <= SINGLE);
const _: () = assert!(Stream::<f64>::SNAPSHOT_BYTES + BEGIN <= DOUBLE);

impl Number for f32 {
    const SCALAR: Scalar = Scalar::Single;
    type StreamBytes = [u8; SINGLE];
    const NO_STREAM_BYTES: Self::StreamBytes = [0; SINGLE];
}

impl Number for f64 {
    const SCALAR: Scalar = Scalar::Double;
    type StreamBytes = [u8; DOUBLE];
    const NO_STREAM_BYTES: Self::StreamBytes = [0; DOUBLE];
}
