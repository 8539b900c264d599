//! Names and units of joints: motor angles or carriage travels.

use super::degrees;
use delta_cal::robot::Drive;

/// The unit of a joint in files and reports.
pub(crate) const fn unit(drive: Drive) -> &'static str {
    match drive {
        Drive::Rotary => "deg",
        Drive::Linear => "mm",
    }
}

/// The unit after a number: "12.5°", "12.5 mm".
pub const fn mark(drive: Drive) -> &'static str {
    match drive {
        Drive::Rotary => "°",
        Drive::Linear => " mm",
    }
}

/// "joint angle", "travel".
pub const fn name(drive: Drive) -> &'static str {
    match drive {
        Drive::Rotary => "joint angle",
        Drive::Linear => "travel",
    }
}

/// `min_deg`, `min_mm`.
pub fn key(name: &str, drive: Drive) -> String {
    format!("{name}_{}", unit(drive))
}

/// From the unit of files: radians, or mm.
pub fn inwards(drive: Drive, value: f64) -> f64 {
    match drive {
        Drive::Rotary => value.to_radians(),
        Drive::Linear => value,
    }
}

/// The value in the unit of files and reports; it reads back as the same number.
pub fn in_file(drive: Drive, value: f64) -> f64 {
    match drive {
        Drive::Rotary => degrees(value),
        Drive::Linear => value,
    }
}
