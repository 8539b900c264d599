//! From samples to parameters, by any method; nothing here judges the result.

pub mod fkm;
pub mod ikm;
pub mod joint;
pub mod method;
pub mod observations;
pub mod options;
pub mod outcome;
pub mod outlier;
pub mod robust;
pub mod samples;
pub(crate) mod sensor_frame;
pub(crate) mod shared_noise;
pub mod stream;
pub mod weights;
