//! Configurations of other controllers, read into a robot file and, where they hold measurements, a samples file.
//!
//! ```text
//! printer.cfg ─→ Configuration ─→ LinearPrinter or RotaryPrinter, Saved ─┐
//! config.g ─→ words of M665 and M666 ─→ LinearPrinter ───────────────────┴→ Imported: robot.toml, samples.csv
//! ```
//!
//! A configuration may hold secrets: nothing of a section that is not needed is kept, and no message quotes a
//! line.

pub mod configuration;
pub mod gcode;
pub mod imported;
pub mod klipper;
pub mod linear;
pub mod measured;
pub mod pattern;
pub mod robot_text;
pub mod rotary;
