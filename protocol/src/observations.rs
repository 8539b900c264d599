//! A calibration from observations: how it begins, one observation, and where its instruments are.

use crate::begin::tolerance;
use crate::messages::Fault;
use delta_cal::nalgebra::Vector3;
use delta_cal::observations::{
    Distance, DistanceFrom, Height, Instruments, Observation, ObservationNoise, ObservationOutcome,
    ObservationSolver, Plane, Point, PositionFrame,
};
use delta_cal::{Noise, Real, Settings};
use serde::{Deserialize, Serialize};

/// Planes that a session has at most.
pub const PLANES: usize = 4;
/// Points that a session has at most.
pub const POINTS: usize = 4;
/// Unknowns that its planes and points have at most: three a plane, three a point, and one for an offset.
pub const UNKNOWNS: usize = 12;

/// Parameters in all: the robot's and those of the instruments.
const PARAMETERS: usize = 24 + UNKNOWNS;
const COLUMNS: usize = PARAMETERS + 1;
const ENTRIES: usize = COLUMNS * (COLUMNS + 1) / 2;

/// The solver of a session: the same on the controller and on whoever compares with it.
pub type Solver<T> = ObservationSolver<T, PARAMETERS, COLUMNS, ENTRIES>;
/// What comes out of it.
pub type Solved<T> = ObservationOutcome<T, PARAMETERS>;

/// How a calibration from observations begins. Coordinates are in the robot's own frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BeginObservations<T> {
    /// A number that the driver draws; not 0.
    pub session: u32,
    /// One σ of the manufacturing tolerance: millimetres, radians.
    pub tolerance: Option<(T, T)>,
    /// One σ of each coordinate and of a joint angle: millimetres, radians.
    pub noise: ([T; 3], T),
    /// One σ of a height, mm.
    pub height_noise: T,
    /// One σ of a distance, mm.
    pub distance_noise: T,
    /// How many of the planes there are.
    pub plane_count: u8,
    /// The planes; those behind the last one have no meaning.
    pub planes: [PlaneMessage<T>; PLANES],
    /// How many of the points there are.
    pub point_count: u8,
    /// The points; those behind the last one have no meaning.
    pub points: [PointMessage<T>; POINTS],
}

/// A plane z = c + a x + b y.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlaneMessage<T> {
    /// c and its σ, mm, if something is known of it.
    pub known: Option<(T, T)>,
    /// One σ of a and b about 0, if the plane is known to be nearly level.
    pub level: Option<T>,
}

/// A fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PointMessage<T> {
    /// x, y, z and the σ of each, mm, if something is known of them.
    pub known: Option<([T; 3], T)>,
    /// Whether the sensor there reads a constant too much that is unknown as well.
    pub offset: bool,
}

/// One observation. What was not measured is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ObservationMessage<T> {
    /// The session.
    pub session: u32,
    /// Counted from 0; each observation is taken in once.
    pub index: u32,
    /// q₁, q₂, q₃ in radians.
    pub joints: [T; 3],
    /// x, y, z, mm.
    pub position: [Option<T>; 3],
    /// Which plane, and the height above it, mm.
    pub height: Option<(u8, T)>,
    /// From where, and how far, mm.
    pub distance: Option<(DistanceFrom<T>, T)>,
}

/// Where the instruments of a calibration are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Places<T> {
    /// c (mm), a and b of each plane z = c + a x + b y; 0 behind the last one.
    pub planes: [[T; 3]; PLANES],
    /// x, y and z of each point and what its sensor reads too much, mm; 0 behind the last one.
    pub points: [[T; 4]; POINTS],
}

impl<T> Default for PlaneMessage<T> {
    fn default() -> Self {
        Self {
            known: None,
            level: None,
        }
    }
}

impl<T> Default for PointMessage<T> {
    fn default() -> Self {
        Self {
            known: None,
            offset: false,
        }
    }
}

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

impl<T: Real> Places<T> {
    /// Of an outcome.
    pub fn new(outcome: &Solved<T>, instruments: &Instruments<'_, T>) -> Self {
        let mut places = Self {
            planes: [[T::ZERO; 3]; PLANES],
            points: [[T::ZERO; 4]; POINTS],
        };
        for ((index, place), _) in (0..).zip(&mut places.planes).zip(instruments.planes) {
            *place = outcome.plane(instruments, index);
        }
        for ((index, place), _) in (0..).zip(&mut places.points).zip(instruments.points) {
            *place = outcome.point(instruments, index);
        }
        places
    }
}
