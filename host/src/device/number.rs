use delta_cal::Real;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A number as it goes over the wire: `f32` or `f64`.
pub trait Number: Real + Serialize + DeserializeOwned {}

impl<T: Real + Serialize + DeserializeOwned> Number for T {}
