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
    use crate::observations::{
        Distance, DistanceFrom, FkmCalibrator, Height, Instruments, Observation, ObservationError,
        ObservationNoise, ObservationProblem, ObservationRow, Plane, Point, PositionFrame,
        PrepareError,
    };
    use crate::robot::{ArmIndex, Drive, SymmetricRobot};
    use crate::samples::{Noise, SampleError};
    use nalgebra::Vector3;

    fn instruments<'a>(planes: &'a [Plane<f64>], points: &'a [Point<f64>]) -> Instruments<'a, f64> {
        Instruments {
            frame: PositionFrame::Base,
            planes,
            points,
            noise: ObservationNoise::new(Noise::new(0.02, 0.0).unwrap(), 0.02, 0.05).unwrap(),
            transmission: None,
        }
    }

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
        let instruments = instruments(
            &[Plane {
                known: None,
                level: None,
            }; 2],
            &[Point {
                known: None,
                offset: false,
            }],
        );
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
            (x(f64::NAN), Err(ObservationError::NonFinite)),
            (x(1e200), Err(ObservationError::NonFinite)),
            (at(0.2), Err(ObservationError::Nothing)),
            (
                Observation {
                    joints: [0.1, f64::NAN, 0.3],
                    ..x(12.0)
                },
                Err(not_finite),
            ),
            (height(1, -3.0), Ok(())),
            (height(2, 3.0), Err(ObservationError::NoSuchPlane(2))),
            (height(0, f64::INFINITY), Err(ObservationError::NonFinite)),
            (distance(point(0), 100.0), Ok(())),
            (
                distance(point(1), 100.0),
                Err(ObservationError::NoSuchPoint(1)),
            ),
            (
                distance(point(0), 0.0),
                Err(ObservationError::DistanceNotPositive),
            ),
            (
                distance(point(0), -1.0),
                Err(ObservationError::DistanceNotPositive),
            ),
            (
                distance(point(0), f64::NAN),
                Err(ObservationError::NonFinite),
            ),
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
        let unknown = Plane {
            known: None,
            level: None,
        };
        let known = Plane {
            known: Some((-560.0, 0.1)),
            ..unknown
        };
        let level = Plane {
            level: Some(0.01),
            ..unknown
        };
        for (plane, needed) in [(unknown, 3), (known, 1), (level, 1)] {
            let planes = [level, plane];
            let instruments = instruments(&planes, &[]);
            let rows = [0, 1, 1, 1].map(|plane| ObservationRow::new(height(plane, 1.0)));
            for count in 0..=3_u8 {
                let expected = (u64::from(count) < needed).then_some((
                    Instrument::Plane(1),
                    u64::from(count),
                    needed,
                ));
                assert_eq!(instruments.lacking(&rows[..=usize::from(count)]), expected);
            }
            // An observation that the robot does not reach does not count.
            let mut rows = rows;
            for row in &mut rows[1..] {
                row.left_out = true;
            }
            assert_eq!(
                instruments.lacking(&rows),
                Some((Instrument::Plane(1), 0, needed))
            );
        }
        let place = Some((Vector3::new(0.0, 0.0, -700.0), 1.0));
        for (known, offset, needed) in [
            (None, false, 3),
            (None, true, 4),
            (place, false, 1),
            (place, true, 2),
        ] {
            let other = Point {
                known: place,
                offset: false,
            };
            let points = [other, Point { known, offset }];
            let instruments = instruments(&[], &points);
            let rows = [0, 1, 1, 1, 1]
                .map(|point| ObservationRow::new(distance(DistanceFrom::Point(point), 100.0)));
            for count in 0..=4_u8 {
                let expected = (u64::from(count) < needed).then_some((
                    Instrument::Point(1),
                    u64::from(count),
                    needed,
                ));
                assert_eq!(instruments.lacking(&rows[..=usize::from(count)]), expected);
            }
        }
    }

    /// A σ of 0 would be an infinite weight. Both ways of solving name the fault.
    #[test]
    fn known_places_without_a_sigma_are_refused() {
        let robot = SymmetricRobot::PAPER.robot().unwrap();
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
        let robot = SymmetricRobot::PAPER.robot().unwrap();
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
