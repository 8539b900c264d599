use crate::calibration::{Instrument, positive};
use crate::robot::{ArmIndex, OF_ROBOT, TRANSMISSION_NUMBERS, TransmissionTolerance};
use crate::samples::Noise;
use crate::{Real, SettingError};
use core::mem::ManuallyDrop;
use heapless::Vec;
use nalgebra::Vector3;

/// Unknowns of the frame, of a plane, and of a point without offset.
pub(super) const OF_FRAME: usize = 6;
pub(super) const OF_PLANE: usize = 3;
pub(super) const OF_POINT: usize = 3;
/// Numbers of the three transmissions, which come next if they are estimated.
pub(super) const OF_TRANSMISSIONS: usize = 3 * TRANSMISSION_NUMBERS;

/// σ of each kind of reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservationNoise<T> {
    position: Noise<T>,
    height: T,
    distance: T,
    #[cfg(feature = "linear")]
    scale: Option<T>,
}

/// A plane z = c + a x + b y, with unknown c (length), a and b (slopes).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plane<T> {
    /// c and its σ, if known. Length.
    pub known: Option<(T, T)>,
    /// σ of the slopes a and b about 0, if the plane is known to be nearly level. No unit.
    pub level: Option<T>,
}

/// A fixed point with unknown position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point<T: Real> {
    /// The position and the σ of its coordinates, if known. Length.
    pub known: Option<(Vector3<T>, T)>,
    /// Whether the sensor's readings have a constant, unknown offset.
    pub offset: bool,
}

/// The instruments the readings refer to, and their noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruments<'a, T: Real> {
    /// Whether the coordinates are in the frame of a sensor, placed arbitrarily: six unknowns. Otherwise they are in the
    /// robot's own frame.
    pub sensor_frame: bool,
    /// The planes above which heights are measured.
    pub planes: &'a [Plane<T>],
    /// The points from which distances are measured.
    pub points: &'a [Point<T>],
    /// The noise of the readings.
    pub noise: ObservationNoise<T>,
    /// The tolerance of the joints' transmissions, if they are to be estimated. `None` treats the robot's own as exact.
    pub transmission: Option<TransmissionTolerance<T>>,
}

/// Most planes, and most points, of a calibrator.
pub(super) const PLACES: usize = 4;

/// [`Instruments`] that own their planes and points. Never dropped, as they need no drop.
#[derive(Debug, Clone)]
pub(super) struct OwnInstruments<T: Real> {
    sensor_frame: bool,
    noise: ObservationNoise<T>,
    transmission: Option<TransmissionTolerance<T>>,
    planes: ManuallyDrop<Vec<Plane<T>, PLACES>>,
    points: ManuallyDrop<Vec<Point<T>, PLACES>>,
}

impl<T: Real> OwnInstruments<T> {
    /// `None` if there are too many.
    pub(super) fn new(stated: &Instruments<'_, T>) -> Option<Self> {
        Some(Self {
            sensor_frame: stated.sensor_frame,
            noise: stated.noise,
            transmission: stated.transmission,
            planes: ManuallyDrop::new(Vec::from_slice(stated.planes).ok()?),
            points: ManuallyDrop::new(Vec::from_slice(stated.points).ok()?),
        })
    }

    pub(super) fn view(&self) -> Instruments<'_, T> {
        Instruments {
            planes: &self.planes,
            points: &self.points,
            sensor_frame: self.sensor_frame,
            noise: self.noise,
            transmission: self.transmission,
        }
    }
}

impl<T: Real> ObservationNoise<T> {
    /// σ of positions and joint angles, of a height and of a distance (length).
    ///
    /// # Errors
    /// A σ of a height or distance that is not finite and greater than 0.
    pub fn new(position: Noise<T>, height: T, distance: T) -> Result<Self, SettingError> {
        positive(height, SettingError::HeightNoise)?;
        positive(distance, SettingError::DistanceNoise)?;
        Ok(Self {
            position,
            height,
            distance,
            #[cfg(feature = "linear")]
            scale: None,
        })
    }

    /// With σ of a relative error common to all distances between two poses, such as the shrinkage of a printed object:
    /// one more unknown.
    ///
    /// # Errors
    /// A σ that is not finite and greater than 0.
    #[cfg(feature = "linear")]
    pub fn with_scale(self, sigma: T) -> Result<Self, SettingError> {
        positive(sigma, SettingError::DistanceNoise)?;
        Ok(Self {
            scale: Some(sigma),
            ..self
        })
    }

    /// σ of the relative error common to all distances between two poses; `None` if there is none.
    pub const fn scale(&self) -> Option<T> {
        #[cfg(feature = "linear")]
        return self.scale;
        #[cfg(not(feature = "linear"))]
        None
    }

    /// Noise of positions and of joint angles.
    pub const fn position(&self) -> &Noise<T> {
        &self.position
    }

    /// σ of a height. Length.
    pub const fn height(&self) -> T {
        self.height
    }

    /// σ of a distance. Length.
    pub const fn distance(&self) -> T {
        self.distance
    }
}

impl<T: Real> Point<T> {
    /// Number of its unknowns.
    pub(super) fn unknowns(&self) -> usize {
        OF_POINT + usize::from(self.offset)
    }
}

impl<T: Real> Instruments<'_, T> {
    /// Coordinates in the robot's own frame with this noise, its joints exact: no planes, no points.
    pub const fn new(noise: ObservationNoise<T>) -> Self {
        Self {
            sensor_frame: false,
            planes: &[],
            points: &[],
            noise,
            transmission: None,
        }
    }

    /// Number of unknowns in addition to the robot's parameters.
    pub fn unknowns(&self) -> usize {
        let scale = usize::from(self.noise.scale().is_some());
        self.transmission_unknowns() + self.of_places() + scale
    }

    /// Index of the distances' common relative error among all parameters, if it is unknown: the last.
    pub fn of_scale(&self) -> Option<usize> {
        let before = OF_ROBOT + self.transmission_unknowns() + self.of_places();
        self.noise.scale().map(|_| before)
    }

    /// How many of them describe the placement of instruments.
    pub fn of_places(&self) -> usize {
        let points: usize = self.points.iter().map(Point::unknowns).sum();
        self.frame_unknowns() + OF_PLANE * self.planes.len() + points
    }

    fn transmission_unknowns(&self) -> usize {
        match self.transmission {
            None => 0,
            Some(_) => OF_TRANSMISSIONS,
        }
    }

    /// Index of the frame's first unknown among all parameters.
    pub(super) fn frame_column(&self) -> usize {
        OF_ROBOT + self.transmission_unknowns()
    }

    fn frame_unknowns(&self) -> usize {
        if self.sensor_frame { OF_FRAME } else { 0 }
    }

    /// Index of a plane's first unknown among all parameters; the order is c, a, b.
    pub fn first_of_plane(&self, plane: u8) -> usize {
        self.frame_column() + self.frame_unknowns() + OF_PLANE * usize::from(plane)
    }

    /// Index of a point's first unknown among all parameters; the order is x, y, z, offset.
    pub fn first_of_point(&self, point: u8) -> usize {
        let before = self.points.iter().take(usize::from(point));
        let before: usize = before.map(Point::unknowns).sum();
        self.frame_column() + self.frame_unknowns() + OF_PLANE * self.planes.len() + before
    }

    /// The instrument to which the parameter at an index belongs.
    pub(super) fn instrument_of(&self, parameter: usize) -> Option<Instrument> {
        let unknown = parameter.checked_sub(OF_ROBOT)?;
        if unknown < self.transmission_unknowns() {
            let joint = ArmIndex::ALL.get(unknown / TRANSMISSION_NUMBERS)?;
            return Some(Instrument::Transmission(*joint));
        }
        if parameter < self.frame_column() + self.frame_unknowns() {
            return Some(Instrument::Frame);
        }
        let planes = (0..).take(self.planes.len()).map(|plane| {
            let first = self.first_of_plane(plane);
            (first..first + OF_PLANE, Instrument::Plane(plane))
        });
        let points = (0..).zip(self.points).map(|(index, point)| {
            let first = self.first_of_point(index);
            (first..first + point.unknowns(), Instrument::Point(index))
        });
        planes
            .chain(points)
            .find(|(columns, _)| columns.contains(&parameter))
            .map(|(_, instrument)| instrument)
    }
}

#[cfg(test)]
#[cfg(feature = "transmission")]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{Instruments, Plane, Point};
    use crate::calibration::Instrument;
    use crate::fixtures;
    use crate::robot::{ArmIndex, TransmissionTolerance};

    const PLANE: Plane<f64> = Plane {
        known: None,
        level: None,
    };
    const POINTS: [Point<f64>; 2] = [
        Point {
            known: None,
            offset: true,
        },
        Point {
            known: None,
            offset: false,
        },
    ];

    /// Every kind of unknown: after the robot's 24 parameters, 15 for the transmissions, 6 for the frame, 3 for each of
    /// two planes, 4 for a point with offset, 3 for one without.
    fn instruments() -> Instruments<'static, f64> {
        Instruments {
            sensor_frame: true,
            transmission: Some(TransmissionTolerance::new(1e-3).unwrap()),
            ..fixtures::instruments(&[PLANE; 2], &POINTS)
        }
    }

    #[test]
    fn every_place_belongs_to_its_instrument() {
        let [first, second, third] = ArmIndex::ALL.map(Instrument::Transmission);
        let layout = [
            (24, None),
            (5, Some(first)),
            (5, Some(second)),
            (5, Some(third)),
            (6, Some(Instrument::Frame)),
            (3, Some(Instrument::Plane(0))),
            (3, Some(Instrument::Plane(1))),
            (4, Some(Instrument::Point(0))),
            (3, Some(Instrument::Point(1))),
            (5, None),
        ];
        let mut place = 0;
        for (count, expected) in layout {
            for _ in 0..count {
                assert_eq!(instruments().instrument_of(place), expected, "{place}");
                place += 1;
            }
        }
        assert_eq!(instruments().unknowns(), place - 24 - 5);

        // The robot's own frame and exact joints: the planes come first.
        let few = Instruments {
            sensor_frame: false,
            transmission: None,
            ..instruments()
        };
        assert_eq!(few.instrument_of(23), None);
        assert_eq!(few.instrument_of(24), Some(Instrument::Plane(0)));
        assert_eq!(few.instrument_of(30), Some(Instrument::Point(0)));
    }
}
