use super::parameter::Parameter;
use core::fmt;

/// Why eight numbers are not the geometry of an arm, or three arms not a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum GeometryError {
    /// A parameter is NaN or infinite.
    NonFinite(Parameter),
    /// The upper arm (La_x, La_y) or the forearm Lb is not longer than 0.
    NotPositive(Parameter),
    /// |α| ≥ 90°: the arm plane's "up" would point down, or be undefined.
    TiltTooLarge,
    /// |θ| > 360°.
    AzimuthTooLarge,
    /// The base or the platform radius is negative or NaN.
    RadiusInvalid,
    /// The arms' "up" directions cancel, so that "below the base" has no meaning.
    NoCommonUp,
    /// A tower lies flat: it must lean by less than 90°.
    LeanTooLarge,
    /// Not all three arms have the same drive.
    MixedDrives,
    /// A transmission is so far from exact that the joint angle of an arm's angle is not certain, or the arm's drive
    /// is linear.
    TransmissionTooLarge,
}

impl fmt::Display for GeometryError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite(parameter) => write!(formatter, "{parameter} is not a finite number"),
            Self::NotPositive(parameter) => {
                write!(formatter, "the length {parameter} must be greater than 0")
            }
            Self::TiltTooLarge => formatter.write_str("the tilt alpha must lie within ±90°"),
            Self::AzimuthTooLarge => formatter.write_str("the azimuth theta must lie within ±360°"),
            Self::LeanTooLarge => formatter.write_str("a tower must lean by less than 90°"),
            Self::MixedDrives => {
                formatter.write_str("all three arms must be rotary, or all three linear")
            }
            Self::TransmissionTooLarge => formatter.write_str(
                "the transmission of a rotary drive must be exact but for a tenth of a radian in a radian",
            ),
            Self::RadiusInvalid => {
                formatter.write_str("the base and platform radii must not be negative")
            }
            Self::NoCommonUp => {
                formatter.write_str("the arms' up directions cancel: the robot has no below")
            }
        }
    }
}

impl core::error::Error for GeometryError {}
