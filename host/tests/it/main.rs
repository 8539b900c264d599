//! The command from outside, and the library behind it: one program of all these files, for each by itself would
//! compile the generic core and link the host once more.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // in tests a panic is the failure

mod support;

mod bad_input;
mod bad_robot_file;
mod calibrate;
mod causes;
mod check;
mod check_measurements;
mod device;
mod device_on_target;
mod diagnosis;
mod documents;
mod export;
mod fkm;
mod help;
mod import;
mod init;
mod kinematics;
mod linear;
mod linuxcnc;
mod many_rows;
mod measurements;
mod mistakes;
mod no_measurement;
mod noise;
mod observations;
mod outliers;
mod plan;
mod plausibility;
mod plot;
mod report;
mod report_document;
mod reproduce;
mod robust;
mod rows_on_disk;
mod sensor_frame;
mod simulate;
mod stream;
mod table_formats;
mod transmissions;
mod validate;
mod workspace;
