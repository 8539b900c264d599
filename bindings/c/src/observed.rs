//! The outcome of a calibration from observations, with the instruments that it speaks of.

use crate::plain::{PLANES, POINTS, UNKNOWNS};
use delta_cal::Real;
use delta_cal::observations::{
    Instruments, ObservationNoise, ObservationOutcome, Plane, Point, PositionFrame,
};

/// Parameters in all: the robot's and those of the instruments.
pub(crate) const N: usize = 24 + UNKNOWNS;
/// Columns, and entries of a triangle of so many.
pub(crate) const M: usize = N + 1;
pub(crate) const E: usize = M * (M + 1) / 2;

/// The instruments by value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OwnInstruments<T: Real> {
    pub(crate) frame: PositionFrame,
    pub(crate) planes: [Plane<T>; PLANES],
    pub(crate) plane_count: usize,
    pub(crate) points: [Point<T>; POINTS],
    pub(crate) point_count: usize,
    pub(crate) noise: ObservationNoise<T>,
}

impl<T: Real> OwnInstruments<T> {
    pub(crate) fn instruments(&self) -> Instruments<'_, T> {
        Instruments {
            frame: self.frame,
            planes: self.planes.get(..self.plane_count).unwrap_or_default(),
            points: self.points.get(..self.point_count).unwrap_or_default(),
            noise: self.noise,
            transmission: None,
        }
    }
}

/// A robot calibrated from observations, and where the instruments are.
#[derive(Debug, Clone, Copy)]
pub struct Observed<T: Real> {
    pub(crate) outcome: ObservationOutcome<T, N>,
    pub(crate) instruments: OwnInstruments<T>,
}
