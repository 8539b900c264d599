use crate::Real;
use crate::samples::SampleError;
use core::fmt;

/// What was measured at one set of joint angles: any of the coordinates, a height, a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation<T: Real> {
    /// q₁, q₂, q₃ in radians.
    pub joints: [T; 3],
    /// The coordinates that were measured, in the frame of the positions. Length.
    pub position: [Option<T>; 3],
    /// A height above a plane.
    pub height: Option<Height<T>>,
    /// A distance.
    pub distance: Option<Distance<T>>,
}

/// How far the platform point is above a plane, along the plane's upward normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Height<T> {
    /// Which of [`Instruments::planes`](super::Instruments::planes).
    pub plane: u8,
    /// Length.
    pub height: T,
}

/// How far the platform point is from somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance<T> {
    /// From where.
    pub from: DistanceFrom<T>,
    /// Length.
    pub distance: T,
}

/// Where a distance begins.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DistanceFrom<T> {
    /// At one of [`Instruments::points`](super::Instruments::points).
    Point(u8),
    /// At the platform's position at these joint angles, radians.
    Pose([T; 3]),
}

/// Why an observation is not taken in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ObservationError {
    /// A joint angle is not usable.
    Joints(SampleError),
    /// Nothing was measured.
    Nothing,
    /// A number is NaN, infinite, or too large to be squared.
    NonFinite,
    /// The weight of the row is NaN, infinite or negative.
    Weight,
    /// A distance is not greater than 0.
    DistanceNotPositive,
    /// There is no plane with this index.
    NoSuchPlane(u8),
    /// There is no point with this index.
    NoSuchPoint(u8),
    /// The distance between two poses that the nominal robot has in the same place.
    SamePlace,
}

impl fmt::Display for ObservationError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joints(error) => error.fmt(formatter),
            Self::Nothing => formatter.write_str("nothing was measured"),
            Self::NonFinite => formatter.write_str("a measured number is not finite"),
            Self::Weight => formatter.write_str("the weight is not a finite number, 0 or greater"),
            Self::DistanceNotPositive => formatter.write_str("the distance is not greater than 0"),
            Self::NoSuchPlane(index) => write!(formatter, "there is no plane {index}"),
            Self::NoSuchPoint(index) => write!(formatter, "there is no point {index}"),
            Self::SamePlace => formatter.write_str("the two poses of the distance are the same"),
        }
    }
}

impl core::error::Error for ObservationError {}

impl<T: Real> Observation<T> {
    /// At joint angles (radians), nothing measured yet.
    pub const fn at(joints: [T; 3]) -> Self {
        Self {
            joints,
            position: [None; 3],
            height: None,
            distance: None,
        }
    }

    /// How many numbers were measured.
    pub fn readings(&self) -> usize {
        self.position.iter().flatten().count()
            + usize::from(self.height.is_some())
            + usize::from(self.distance.is_some())
    }

    /// The joint angles at which a distance between two poses begins. Radians.
    pub const fn other_joints(&self) -> Option<&[T; 3]> {
        match &self.distance {
            Some(Distance {
                from: DistanceFrom::Pose(joints),
                ..
            }) => Some(joints),
            _ => None,
        }
    }
}
