//! `delta-cal import` and `delta-cal calibrate`: configurations with the figures of ten printers, and kinematics
//! written from Klipper's source.

mod agreement;
mod assessed;
mod beds;
mod campaign;
mod fixtures;
mod gcode;
mod owner;
mod tilting;

use crate::support::Folder;

/// Runs the command that a report suggests next.
pub(crate) fn run_next(folder: &Folder, printed: &str) {
    let mut lines = printed.lines();
    let next = lines.find_map(|line| line.strip_prefix("Next: delta-cal "));
    folder.run(next.unwrap()).ok();
    assert!(folder.path("mine/samples.csv").exists());
}
