use delta_cal::Real;
use delta_cal_protocol::Scalar;
use serde::Serialize;
use serde::de::DeserializeOwned;

#[cfg(target_os = "none")]
mod logged {
    pub(super) use defmt::Format as Logged;
}

#[cfg(not(target_os = "none"))]
mod logged {
    /// What can be logged: on the host anything, for nothing is.
    pub trait Logged {}
    impl<T> Logged for T {}
}

/// What the firmware computes in: `f32` or `f64`.
pub trait Number: Real + Serialize + DeserializeOwned + logged::Logged {
    /// Its name on the wire.
    const SCALAR: Scalar;
}

impl Number for f32 {
    const SCALAR: Scalar = Scalar::Single;
}

impl Number for f64 {
    const SCALAR: Scalar = Scalar::Double;
}
