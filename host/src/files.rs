//! What is read and written: the robot file, the samples file, and the faults that they can have.

pub mod columns;
pub mod convention;
pub mod document;
pub mod example;
pub mod input;
pub mod kinematics;
pub mod robot_file;
pub mod samples_file;
