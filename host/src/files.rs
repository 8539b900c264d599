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
