//! Joints in words and units: the angle of a motor, or the travel of a carriage.

use super::degrees;
use delta_cal::robot::Drive;

/// The unit of a joint in files and reports.
pub(crate) const fn unit(drive: Drive) -> &'static str {
    match drive {
        Drive::Rotary => "deg",
        Drive::Linear => "mm",
    }
}

/// The same behind a number: "12.5°", "12.5 mm".
pub const fn mark(drive: Drive) -> &'static str {
    match drive {
        Drive::Rotary => "°",
        Drive::Linear => " mm",
    }
}

/// The letter of a joint: q an angle, s a travel.
pub const fn letter(drive: Drive) -> &'static str {
    match drive {
        Drive::Rotary => "q",
        Drive::Linear => "s",
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

/// In the unit of files and reports, so that it reads back as the same number.
pub fn in_file(drive: Drive, value: f64) -> f64 {
    match drive {
        Drive::Rotary => degrees(value),
        Drive::Linear => value,
    }
}

/// `q1_deg,q2_deg,q3_deg`, `s1_mm,s2_mm,s3_mm`.
pub fn columns(drive: Drive) -> String {
    let (letter, unit) = (letter(drive), unit(drive));
    format!("{letter}1_{unit},{letter}2_{unit},{letter}3_{unit}")
}

/// "q1, deg", "s1, mm": headings of a table's columns.
pub fn names(drive: Drive) -> [String; 3] {
    let (letter, unit) = (letter(drive), unit(drive));
    [1, 2, 3].map(|joint| format!("{letter}{joint}, {unit}"))
}

/// "12°", "341 mm".
pub fn whole(drive: Drive, value: f64) -> String {
    format!("{:.0}{}", in_file(drive, value), mark(drive))
}
