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
    /// What can be logged. Without a logger that is every type.
    pub trait Logged {}
    impl<T> Logged for T {}
}

/// What the firmware computes in: `f32` or `f64`.
pub trait Number: Real + Wire + logged::Logged {
    /// Its name on the wire.
    const SCALAR: Scalar;
    /// Memory for the samples of a session while they are read from flash or written to it.
    type StreamBytes: AsRef<[u8]> + AsMut<[u8]> + Debug;
    /// All zeros.
    const NO_STREAM_BYTES: Self::StreamBytes;
}

/// Bytes of a record's content that fit into 8 KiB and 16 KiB of flash together with its header and checksum.
const SINGLE: usize = 8_128;
const DOUBLE: usize = 16_320;

/// Bytes of the request that stands before the snapshot, at most.
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
