//! From samples to parameters, by either method; nothing here judges the result.

pub mod fkm;
pub mod options;
pub mod outcome;
pub(crate) mod outlier;
pub mod robust;
pub(crate) mod sensor_frame;
pub mod stream;
pub mod weights;
