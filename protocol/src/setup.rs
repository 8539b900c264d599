//! What a session of observations is begun with, and its rows, as the core has them.

use crate::begin::tolerance;
use crate::messages::Fault;
use crate::observations::{
    BeginObservations, ObservationMessage, PLANES, POINTS, Solver, UNKNOWNS,
};
use delta_cal::nalgebra::Vector3;
use delta_cal::observations::{
    Distance, Height, Instruments, Observation, ObservationNoise, Plane, Point, PositionFrame,
};
use delta_cal::{Noise, Real, Settings};

/// What a session of observations is begun with, as the core has it.
#[derive(Debug, Clone, Copy)]
pub struct Setup<T: Real> {
    /// The tolerance.
    pub settings: Settings<T>,
    noise: ObservationNoise<T>,
    planes: [Plane<T>; PLANES],
    plane_count: usize,
    points: [Point<T>; POINTS],
    point_count: usize,
}

impl<T: Real> Setup<T> {
    /// What the readings refer to.
    pub fn instruments(&self) -> Instruments<'_, T> {
        Instruments {
            frame: PositionFrame::Base,
            planes: self.planes.get(..self.plane_count).unwrap_or_default(),
            points: self.points.get(..self.point_count).unwrap_or_default(),
            noise: self.noise,
            transmission: None,
        }
    }
}

/// Whether a place that is known can be used.
fn usable<T: Real>(numbers: &[T], sigma: T) -> bool {
    sigma > T::ZERO && sigma.finite() && numbers.iter().all(|number| number.finite())
}

impl<T: Real> BeginObservations<T> {
    /// As the core has it.
    ///
    /// # Errors
    /// [`Fault::Settings`], [`Fault::TooManyUnknowns`].
    pub fn setup(&self) -> Result<Setup<T>, Fault> {
        if self.session == 0 {
            return Err(Fault::Settings);
        }
        let (position, joint) = self.noise;
        let noise = Noise::by_axis(position, joint)
            .and_then(|noise| ObservationNoise::new(noise, self.height_noise, self.distance_noise))
            .map_err(|_| Fault::Settings)?;
        let mut setup = Setup {
            settings: Settings::new().with_tolerance(tolerance(self.tolerance)?),
            noise,
            planes: [Plane::default(); PLANES],
            plane_count: self.plane_count.into(),
            points: [Point::default(); POINTS],
            point_count: self.point_count.into(),
        };
        let planes = setup.planes.iter_mut().zip(&self.planes);
        for (plane, stated) in planes.take(setup.plane_count) {
            let known = stated.known.is_none_or(|(c, sigma)| usable(&[c], sigma));
            if !known || !stated.level.is_none_or(|sigma| usable(&[], sigma)) {
                return Err(Fault::Settings);
            }
            plane.known = stated.known;
            plane.level = stated.level;
        }
        let points = setup.points.iter_mut().zip(&self.points);
        for (point, stated) in points.take(setup.point_count) {
            if !stated
                .known
                .is_none_or(|(place, sigma)| usable(&place, sigma))
            {
                return Err(Fault::Settings);
            }
            point.known = stated
                .known
                .map(|(place, sigma)| (Vector3::from(place), sigma));
            point.offset = stated.offset;
        }
        let too_many = setup.plane_count > PLANES || setup.point_count > POINTS;
        if too_many || !Solver::has_room_for(&setup.instruments()) {
            let capacity = u32::try_from(UNKNOWNS).unwrap_or(u32::MAX);
            return Err(Fault::TooManyUnknowns { capacity });
        }
        Ok(setup)
    }
}

impl<T: Real> ObservationMessage<T> {
    /// As the core has it.
    pub fn observation(&self) -> Observation<T> {
        Observation {
            joints: self.joints,
            position: self.position,
            height: self.height.map(|(plane, height)| Height { plane, height }),
            distance: self
                .distance
                .map(|(from, distance)| Distance { from, distance }),
        }
    }
}
