//! A tolerance in a sentence.

use super::units::degrees;
use delta_cal::robot::Drive;
use delta_cal::{Parameter, Tolerance};

/// "0.5 mm, 0.2°", of linear drives "0.5 mm, 0.2°, end stops 5 mm, scale 0.001".
pub fn in_words(drive: Drive, tolerance: &Tolerance<f64>) -> String {
    let length = tolerance.of(Parameter::Lb);
    let angle = degrees(tolerance.of(Parameter::Theta));
    match drive {
        Drive::Rotary => format!("{length} mm, {angle}°"),
        Drive::Linear => {
            let (zero, scale) = (
                tolerance.of(Parameter::Zero),
                tolerance.of(Parameter::Scale),
            );
            let mut own = format!("{length} mm, {angle}°, end stops {zero} mm, scale {scale}");
            let common = [
                ("radius", tolerance.radius()),
                ("forearm", tolerance.forearm()),
            ];
            for (what, sigma) in common.into_iter().filter(|(_, sigma)| *sigma > 0.0) {
                own += &format!(", common {what} {sigma} mm");
            }
            own
        }
    }
}
