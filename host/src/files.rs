//! Input and output files: the robot file, the samples file, and the faults found in them.

pub mod columns;
pub mod convention;
pub mod document;
pub mod example;
pub mod input;
pub mod kinematics;
pub mod length;
mod region;
pub mod robot_file;
pub mod samples_file;
mod time;

pub(crate) use columns::Quantity;
pub use convention::Convention;
pub use document::Document;
pub use input::{InputError, InputText};
pub use robot_file::{DatumPoint, KnownPlane, RobotFile, Target, Tool};
pub(crate) use robot_file::{ONLY_TARGET, TRANSMISSION_KEYS, Tooled};
pub use samples_file::{Kind, READINGS, Reading, ReadingFrom, Readings, Row};
