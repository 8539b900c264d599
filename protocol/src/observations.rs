//! A calibration from observations: how it begins, one observation, and where its instruments are.

use delta_cal::Real;
use delta_cal::observations::{DistanceFrom, Instruments, ObservationOutcome, ObservationSolver};
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
