//! Checks that observations are usable and sufficient for every instrument.

use super::instruments::Instruments;
use super::observation::{
    Distance, DistanceFrom, Height, Observation, ObservationError, ObservationRow,
};
use crate::Real;
use crate::calibration::Instrument;
use crate::robot::{ArmIndex, Drive};
use crate::samples::check_joint;
use nalgebra::Vector3;

impl<T: Real> Observation<T> {
    /// Checks that every number is usable for a robot with this drive, and every instrument known.
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

    use crate::calibration::{Instrument, Refusal, Settings};
    use crate::fixtures::{instruments, paper};
    use crate::observations::{
        Distance, DistanceFrom, FkmCalibrator, Height, Observation, ObservationError,
        ObservationProblem, ObservationRow, Plane, Point, PrepareError,
    };
    use crate::robot::{ArmIndex, Drive};
    use crate::samples::SampleError;
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

    #[test]
    fn unusable_observations_are_refused_with_their_fault() {
        use ObservationError::{DistanceNotPositive, NoSuchPlane, NoSuchPoint, NonFinite, Nothing};

        let (planes, points) = ([Plane::default(); 2], [Point::default()]);
        let instruments = instruments(&planes, &points);
        let x = |x| Observation {
            position: [None, Some(x), None],
            ..at(0.2)
        };
        let point = DistanceFrom::Point;
        let of = |q| DistanceFrom::Pose([0.1, 0.2, q]);
        let too_large = ObservationError::Joints(SampleError::JointTooLarge(ArmIndex::Third));
        let not_finite = ObservationError::Joints(SampleError::JointNonFinite(ArmIndex::Second));
        for (observation, expected) in [
            (x(12.0), Ok(())),
            (x(f64::NAN), Err(NonFinite)),
            (x(1e200), Err(NonFinite)),
            (at(0.2), Err(Nothing)),
            (at(f64::NAN), Err(not_finite)),
            (height(1, -3.0), Ok(())),
            (height(2, 3.0), Err(NoSuchPlane(2))),
            (height(0, f64::INFINITY), Err(NonFinite)),
            (distance(point(0), 100.0), Ok(())),
            (distance(point(1), 100.0), Err(NoSuchPoint(1))),
            (distance(point(0), 0.0), Err(DistanceNotPositive)),
            (distance(point(0), -1.0), Err(DistanceNotPositive)),
            (distance(point(0), f64::NAN), Err(NonFinite)),
            (distance(of(0.4), 100.0), Ok(())),
            (distance(of(13.0), 100.0), Err(too_large)),
        ] {
            assert_eq!(observation.check(Drive::Rotary, &instruments), expected);
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

    /// A σ of 0 would be an infinite weight. Both ways of solving name the fault.
    #[test]
    fn known_places_without_a_sigma_are_refused() {
        let robot = paper();
        let settings = Settings::new();
        let refused = |planes: &[Plane<f64>], points: &[Point<f64>], expected| {
            let instruments = instruments(planes, points);
            let mut rows = [ObservationRow::new(height(0, 100.0)); 9];
            let refused = Refusal::UnusableInstrument(expected);
            let problem = ObservationProblem::<f64, 30>::prepare(&robot, &instruments, &mut rows);
            assert_eq!(problem.unwrap_err(), PrepareError::Refused(refused));
            let made = FkmCalibrator::<f64, 9, 33, 34, 595>::new(&robot, &instruments, &settings);
            assert_eq!(made.unwrap_err(), refused);
        };
        let good = Plane {
            known: Some((-700.0, 1.0)),
            level: Some(0.01),
        };
        for sigma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let known = Plane {
                known: Some((-700.0, sigma)),
                ..good
            };
            refused(&[known], &[], Instrument::Plane(0));
            let level = Plane {
                level: Some(sigma),
                ..good
            };
            refused(&[good, level], &[], Instrument::Plane(1));
            let point = Point {
                known: Some((Vector3::new(0.0, 0.0, -700.0), sigma)),
                offset: false,
            };
            refused(&[good], &[point], Instrument::Point(0));
        }
        let nowhere = Plane {
            known: Some((f64::NAN, 1.0)),
            level: None,
        };
        refused(&[nowhere], &[], Instrument::Plane(0));
    }

    #[test]
    fn a_row_whose_weight_is_no_number_is_refused() {
        let robot = paper();
        let planes = [Plane::default()];
        let instruments = instruments(&planes, &[]);
        for weight in [f64::INFINITY, f64::NAN, -1.0] {
            let mut rows = [ObservationRow::new(height(0, 100.0)); 9];
            rows[4].set_weight(weight);
            let problem = ObservationProblem::<f64, 27>::prepare(&robot, &instruments, &mut rows);
            let error = ObservationError::Weight;
            assert_eq!(problem.unwrap_err(), PrepareError::Row { index: 4, error });
        }
    }
}
