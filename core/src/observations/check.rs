//! Checks that observations are usable and sufficient for every instrument.

use super::instruments::Instruments;
use super::observation::{
    Distance, DistanceFrom, Height, Observation, ObservationError, ObservationRow,
};
use crate::Real;
use crate::calibration::Instrument;
use crate::robot::{ArmIndex, Robot};
use crate::samples::{FARTHEST_SQUARED, check_joint};
use nalgebra::Vector3;

impl<T: Real> Observation<T> {
    /// Checks that every number is usable for this robot, and every instrument known.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(
        &self,
        robot: &Robot<T>,
        instruments: &Instruments<'_, T>,
    ) -> Result<(), ObservationError> {
        let joints = self
            .joints
            .iter()
            .chain(self.other_joints().into_iter().flatten());
        for (q, arm) in joints.zip(ArmIndex::ALL.into_iter().cycle()) {
            check_joint(*q, arm, robot.drive()).map_err(ObservationError::Joints)?;
        }
        if self.readings() == 0 {
            return Err(ObservationError::Nothing);
        }
        let height = self.height.map(|height| height.height);
        let distance = self.distance.map(|distance| distance.distance);
        let [first, ..] = robot.arms();
        let readings = self.position.iter().copied().flatten();
        for reading in readings.chain(height).chain(distance) {
            if !reading.squared().finite() {
                return Err(ObservationError::NonFinite);
            }
            // Its rounding would hide what all others say.
            if !((reading / first.lb()).squared() <= T::from_f64(FARTHEST_SQUARED)) {
                return Err(ObservationError::TooFar);
            }
        }
        if distance.is_some_and(|distance| !(distance > T::ZERO)) {
            return Err(ObservationError::DistanceNotPositive);
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
    /// The first plane or point with invalid stated values.
    pub(super) fn unusable(&self) -> Option<Instrument> {
        let usable = |sigma: T| sigma > T::ZERO && sigma.finite();
        for (index, plane) in (0..).zip(self.planes) {
            let known = |(height, sigma): (T, T)| height.finite() && usable(sigma);
            if !(plane.known.is_none_or(known) && plane.level.is_none_or(usable)) {
                return Some(Instrument::Plane(index));
            }
        }
        for (index, point) in (0..).zip(self.points) {
            let known = |(place, sigma): (Vector3<T>, T)| {
                place.iter().all(|number| number.finite()) && usable(sigma)
            };
            if !point.known.is_none_or(known) {
                return Some(Instrument::Point(index));
            }
        }
        None
    }

    /// The instrument with the fewest readings for its unknowns, the number of its readings and the number needed. A
    /// placement known to a σ needs fewer.
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
