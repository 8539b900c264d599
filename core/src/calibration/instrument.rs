use crate::robot::ArmIndex;
use core::fmt;

/// Something beside the robot whose place is estimated with the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Instrument {
    /// The frame in which coordinates were measured.
    Frame,
    /// A plane that heights were measured above, by its index.
    Plane(u8),
    /// A point that distances were measured from, by its index.
    Point(u8),
    /// The gear and encoder of a joint.
    Transmission(ArmIndex),
}

impl fmt::Display for Instrument {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame => formatter.write_str("the frame of the coordinates"),
            Self::Plane(index) => write!(formatter, "plane {index}"),
            Self::Point(index) => write!(formatter, "point {index}"),
            Self::Transmission(arm) => write!(formatter, "the transmission of {arm}"),
        }
    }
}
