//! Observations, and rows: observations with the weights of their readings.

use crate::samples::SampleError;
use crate::{Busy, Real};
use nalgebra::Vector3;

/// Readings taken at one set of joint angles: any of the coordinates, a height, a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation<T: Real> {
    /// q₁, q₂, q₃ in radians.
    pub joints: [T; 3],
    /// The measured coordinates, in the frame of the positions. Length.
    pub position: [Option<T>; 3],
    /// A height above a plane.
    pub height: Option<Height<T>>,
    /// A distance.
    pub distance: Option<Distance<T>>,
}

/// The height of the platform point above a plane, along the plane's upward normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Height<T> {
    /// Index into [`Instruments::planes`](super::Instruments::planes).
    pub plane: u8,
    /// Length.
    pub height: T,
}

/// The distance of the platform point from a point or another pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance<T> {
    /// The start of the distance.
    pub from: DistanceFrom<T>,
    /// Length.
    pub distance: T,
}

/// Where a distance starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DistanceFrom<T> {
    /// Index into [`Instruments::points`](super::Instruments::points).
    Point(u8),
    /// The platform's position at these joint angles, radians.
    Pose([T; 3]),
}

/// Why an observation is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ObservationError {
    /// A joint angle is invalid.
    #[error(transparent)]
    Joints(SampleError),
    /// The observation has no reading.
    #[error("nothing was measured")]
    Nothing,
    /// A number is NaN, infinite, or too large to be squared.
    #[error("a measured number is not finite")]
    NonFinite,
    /// A reading is more than 10,000 forearm lengths.
    #[error("a reading is thousands of forearms long")]
    TooFar,
    /// The weight of the row is NaN, infinite or negative.
    #[error("the weight is not a finite number, 0 or greater")]
    Weight,
    /// A distance is not greater than 0.
    #[error("the distance is not greater than 0")]
    DistanceNotPositive,
    /// No plane has this index.
    #[error("there is no plane {0}")]
    NoSuchPlane(u8),
    /// No point has this index.
    #[error("there is no point {0}")]
    NoSuchPoint(u8),
    /// The nominal robot has no pose at the joint angles, or a singular one.
    #[error("the nominal robot does not reach these joint angles")]
    Unreached,
    /// The nominal robot puts both poses of a distance in the same place.
    #[error("the two poses of the distance are the same")]
    SamePlace,
    /// The calibrator has no room for more observations.
    #[error("there is no room for another observation")]
    Full,
    /// A solve is in progress.
    #[error(transparent)]
    Busy(#[from] Busy),
}

impl<T: Real> Observation<T> {
    /// An observation at joint angles (radians), without readings.
    pub const fn at(joints: [T; 3]) -> Self {
        Self {
            joints,
            position: [None; 3],
            height: None,
            distance: None,
        }
    }

    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.position.iter().flatten().count()
            + usize::from(self.height.is_some())
            + usize::from(self.distance.is_some())
    }

    /// Whether one of the five readings is present: x, y, z, height, distance.
    pub(super) fn is_read(&self, reading: usize) -> bool {
        match reading {
            0..3 => self.position.get(reading).is_some_and(Option::is_some),
            3 => self.height.is_some(),
            _ => self.distance.is_some(),
        }
    }

    /// The joint angles at which a distance between two poses starts. Radians.
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

/// Most readings of an observation.
pub(crate) const READINGS: usize = 5;
/// Entries of a lower triangle with as many rows.
pub(super) const LOWER: usize = READINGS * (READINGS + 1) / 2;

/// An observation with the weights of its readings.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationRow<T: Real> {
    pub(super) observation: Observation<T>,
    /// L of the readings' covariance, each row up to its diagonal, which is 1 for a missing reading.
    pub(super) factor: [T; LOWER],
    /// The nominal robot's position at the joint angles, if it reaches them.
    pub(super) nominal: Vector3<T>,
    /// √ of the row's weight.
    pub(super) root_weight: T,
    /// Whether the nominal robot does not reach its joint angles.
    pub(super) left_out: bool,
}

impl<T: Real> ObservationRow<T> {
    /// A row that is not yet [prepared](super::ObservationProblem::prepare).
    pub const fn new(observation: Observation<T>) -> Self {
        Self {
            observation,
            factor: [T::ZERO; LOWER],
            nominal: Vector3::new(T::ZERO, T::ZERO, T::ZERO),
            root_weight: T::ONE,
            left_out: false,
        }
    }

    /// The observation.
    pub const fn observation(&self) -> &Observation<T> {
        &self.observation
    }

    /// Sets the row's weight in the sum of squares.
    pub fn set_weight(&mut self, weight: T) {
        self.root_weight = weight.square_root();
    }

    pub(super) fn check_weight(&self) -> Result<(), ObservationError> {
        if self.root_weight.finite() {
            Ok(())
        } else {
            Err(ObservationError::Weight)
        }
    }

    /// The row's weight.
    pub fn weight(&self) -> T {
        if self.left_out {
            T::ZERO
        } else {
            self.root_weight.squared()
        }
    }

    /// |L|, where L Lᵀ is the covariance of the row's readings: the product of their σ, each given those before it.
    pub fn spread(&self) -> T {
        self.factor_rows()
            .filter_map(<[T]>::last)
            .fold(T::ONE, |product, pivot| product * *pivot)
    }

    /// The rows of L, each up to its diagonal.
    pub(super) fn factor_rows(&self) -> impl Iterator<Item = &[T]> {
        let mut rest = self.factor.as_slice();
        (1..=READINGS).map_while(move |length| {
            let (row, below) = rest.split_at_checked(length)?;
            rest = below;
            Some(row)
        })
    }

    /// Whether the row is ignored because the nominal robot does not reach its joint angles, so that its readings have
    /// no weights.
    pub const fn is_left_out(&self) -> bool {
        self.left_out
    }
}
