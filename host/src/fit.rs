//! From samples to parameters, by either method; nothing here judges the result.

pub mod fkm;
pub mod outcome;
pub mod robust;
pub(crate) mod sensor_frame;
pub mod stream;
