//! Degrees for files and people, radians for everything else.

use delta_cal::Parameter;
use delta_cal::robot::ParameterKind;

/// The angle in degrees that reads back as exactly these radians if there is one, and the shortest
/// to write if there are several.
pub fn degrees(radians: f64) -> f64 {
    let plain = radians.to_degrees();
    let short = (plain * 1e12).round() / 1e12;
    [short, plain, plain.next_up(), plain.next_down()]
        .into_iter()
        .find(|candidate| candidate.to_radians().to_bits() == radians.to_bits())
        .unwrap_or(plain)
}

/// The unit of a parameter in files and reports.
pub const fn unit(parameter: Parameter) -> &'static str {
    match parameter.kind() {
        ParameterKind::Length => "mm",
        ParameterKind::Angle => "deg",
        ParameterKind::Ratio => "",
    }
}

/// A difference or σ of a parameter in that unit.
pub fn in_unit(parameter: Parameter, value: f64) -> f64 {
    match parameter.kind() {
        ParameterKind::Length | ParameterKind::Ratio => value,
        ParameterKind::Angle => value.to_degrees(),
    }
}

#[cfg(test)]
mod tests {
    use super::degrees;

    #[test]
    fn round_numbers_of_degrees_come_back_round() {
        for written in [-60.0, 90.0, 0.2, 0.002, 120.0, 240.0, 33.3, 0.0] {
            assert!((degrees(f64::to_radians(written)) - written).abs() < f64::MIN_POSITIVE);
        }
    }
}
