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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use crate::calibration::Instrument;
    use crate::fixtures::instruments;
    use crate::observations::{
        Distance, DistanceFrom, Height, Observation, ObservationRow, Plane, Point,
    };
    use nalgebra::Vector3;

    fn at(q: f64) -> Observation<f64> {
        Observation::at([0.1, q, 0.3])
    }

    fn height(plane: u8, height: f64) -> Observation<f64> {
        Observation {
            height: Some(Height { plane, height }),
            ..at(0.2)
        }
    }

    fn distance(from: DistanceFrom<f64>, distance: f64) -> Observation<f64> {
        Observation {
            distance: Some(Distance { from, distance }),
            ..at(0.2)
        }
    }

    /// A plane needs three heights, a point three distances, an offset one more; prior knowledge of a placement
    /// replaces two or all but one of them.
    #[test]
    fn the_instrument_with_too_few_readings_is_named() {
        let unknown = Plane::default();
        let known = Plane {
            known: Some((-560.0, 0.1)),
            ..unknown
        };
        let level = Plane {
            level: Some(0.01),
            ..unknown
        };
        let place = Some((Vector3::new(0.0, 0.0, -700.0), 1.0));
        let point = |known, offset| Point { known, offset };
        let planes =
            [(unknown, 3), (known, 1), (level, 1)].map(|own| (own, (point(place, false), 1)));
        let points = [
            (None, false, 3),
            (None, true, 4),
            (place, false, 1),
            (place, true, 2),
        ]
        .map(|(known, offset, needed)| ((level, 1), (point(known, offset), needed)));
        for ((plane, heights), (of_point, distances)) in planes.into_iter().chain(points) {
            let (planes, points) = ([level, plane], [point(place, false), of_point]);
            let instruments = instruments(&planes, &points);
            // Readings of the first plane and point, and so many of the second.
            let rows = |count: u64, of: &dyn Fn(u8) -> Observation<f64>| {
                core::array::from_fn::<_, 5, _>(|index| {
                    let mut row = ObservationRow::new(of(u8::from(index > 0)));
                    row.left_out = index as u64 > count;
                    row
                })
            };
            for count in 0..=4 {
                let heights_alone = rows(count, &|plane| height(plane, 1.0));
                let distances_alone =
                    rows(count, &|point| distance(DistanceFrom::Point(point), 100.0));
                let all = [rows(4, &|plane| height(plane, 1.0)), distances_alone].concat();
                let few = (count < distances).then_some((Instrument::Point(1), count, distances));
                assert_eq!(instruments.lacking(&all), few);
                let all = [
                    heights_alone,
                    rows(4, &|point| distance(DistanceFrom::Point(point), 1.0)),
                ]
                .concat();
                let few = (count < heights).then_some((Instrument::Plane(1), count, heights));
                assert_eq!(instruments.lacking(&all), few);
            }
        }
    }
}
