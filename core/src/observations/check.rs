//! Whether observations are usable, and whether there are enough for every instrument.

use super::instruments::Instruments;
use super::observation::{Distance, DistanceFrom, Height, Observation, ObservationError};
use super::row::ObservationRow;
use crate::Real;
use crate::calibration::Instrument;
use crate::robot::{ArmIndex, Drive};
use crate::samples::check_joint;
use nalgebra::Vector3;

impl<T: Real> Observation<T> {
    /// Whether every number is usable for a robot with such drives, and every instrument known.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(
        &self,
        drive: Drive,
        instruments: &Instruments<'_, T>,
    ) -> Result<(), ObservationError> {
        let joints = self
            .joints
            .iter()
            .chain(self.other_joints().into_iter().flatten());
        for (q, arm) in joints.zip(ArmIndex::ALL.into_iter().cycle()) {
            check_joint(*q, arm, drive).map_err(ObservationError::Joints)?;
        }
        if self.readings() == 0 {
            return Err(ObservationError::Nothing);
        }
        let height = self.height.map(|height| height.height);
        let distance = self.distance.map(|distance| distance.distance);
        let mut numbers = self.position.iter().copied().flatten().chain(height);
        if !numbers.all(|value| value.squared().finite()) {
            return Err(ObservationError::NonFinite);
        }
        if let Some(distance) = distance {
            if !distance.squared().finite() {
                return Err(ObservationError::NonFinite);
            }
            if !(distance > T::ZERO) {
                return Err(ObservationError::DistanceNotPositive);
            }
        }
        if let Some(Height { plane, .. }) = self.height
            && usize::from(plane) >= instruments.planes.len()
        {
            return Err(ObservationError::NoSuchPlane(plane));
        }
        match self.distance {
            Some(Distance {
                from: DistanceFrom::Point(point),
                ..
            }) if usize::from(point) >= instruments.points.len() => {
                Err(ObservationError::NoSuchPoint(point))
            }
            _ => Ok(()),
        }
    }
}

impl<T: Real> Instruments<'_, T> {
    /// The first plane or point of which something is stated that is not usable.
    pub(super) fn unusable(&self) -> Option<Instrument> {
        let usable = |sigma: T| sigma > T::ZERO && sigma.finite();
        for (index, plane) in (0..).zip(self.planes) {
            let known = plane.known;
            if !known.is_none_or(|(place, sigma)| place.finite() && usable(sigma))
                || !plane.level.is_none_or(usable)
            {
                return Some(Instrument::Plane(index));
            }
        }
        for (index, point) in (0..).zip(self.points) {
            let finite = |place: &Vector3<T>| place.iter().all(|number| number.finite());
            if !point
                .known
                .is_none_or(|(place, sigma)| finite(&place) && usable(sigma))
            {
                return Some(Instrument::Point(index));
            }
        }
        None
    }

    /// The instrument that has the fewest readings for its unknowns: which, how many readings it has, and
    /// how many it needs. A place that is known to a σ needs fewer.
    pub(super) fn lacking(&self, rows: &[ObservationRow<T>]) -> Option<(Instrument, u64, u64)> {
        let count = |of: &dyn Fn(&Observation<T>) -> bool| {
            rows.iter()
                .filter(|row| !row.is_left_out() && of(row.observation()))
                .count() as u64
        };
        for (index, plane) in (0..).zip(self.planes) {
            let needed = match (plane.known, plane.level) {
                (None, None) => 3,
                _ => 1,
            };
            let found = count(&|row| row.height.is_some_and(|height| height.plane == index));
            if found < needed {
                return Some((Instrument::Plane(index), found, needed));
            }
        }
        for (index, point) in (0..).zip(self.points) {
            let place = if point.known.is_some() { 1 } else { 3 };
            let needed = place + u64::from(point.offset);
            let from = DistanceFrom::Point(index);
            let found = count(&|row| row.distance.is_some_and(|distance| distance.from == from));
            if found < needed {
                return Some((Instrument::Point(index), found, needed));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests;
