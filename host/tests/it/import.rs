//! `delta-cal import` and `delta-cal calibrate`: configurations made of the numbers of ten printers, and kinematics
//! that are written from Klipper's source.

mod agreement;
mod assessed;
mod campaign;
mod fixtures;
mod gcode;
mod owner;
mod refusals;

use crate::support::Folder;

/// The command that a report says to run next does its work.
pub(crate) fn run_next(folder: &Folder, printed: &str) {
    let mut lines = printed.lines();
    let next = lines.find_map(|line| line.strip_prefix("Next: delta-cal "));
    folder.run(next.unwrap()).ok();
    assert!(folder.path("mine/samples.csv").exists());
}
