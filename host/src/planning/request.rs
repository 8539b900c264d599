//! What a plan may contain: kinds of measurements, and the region for the platform.

use crate::files::columns::length;
use crate::files::convention::Convention;
use crate::text::list;
use delta_cal::Real;
use nalgebra::Vector3;
use rand_core::Rng;
use std::fmt;
use std::str::FromStr;

/// The smallest number of measurements in a plan.
pub const LEAST: usize = 4;
/// The largest number of measurements in a plan.
pub const MOST: usize = 500;

/// What a measurement reads at a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A height above a plane.
    Plane,
    /// The distance between the platform's positions at two poses.
    Distance,
    /// The distance from a fixed point.
    Point,
    /// Coordinates: which of x, y and z.
    Position([bool; 3]),
}

impl Kind {
    /// x, y and z.
    pub const XYZ: Self = Self::Position([true; 3]);
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::XYZ,
        Self::Position([true, true, false]),
        Self::Position([true, false, true]),
        Self::Position([false, true, true]),
        Self::Position([true, false, false]),
        Self::Position([false, true, false]),
        Self::Position([false, false, true]),
        Self::Plane,
        Self::Distance,
        Self::Point,
    ];

    /// As written in options: `plane`, `distance`, `point`, or the letters of the coordinates.
    pub fn name(self) -> String {
        match self {
            Self::Plane => "plane".to_owned(),
            Self::Distance => "distance".to_owned(),
            Self::Point => "point".to_owned(),
            Self::Position(_) => self.letters().concat(),
        }
    }

    /// What is measured, in plural.
    pub fn title(self) -> String {
        match self {
            Self::Plane => "heights above a plane".to_owned(),
            Self::Distance => "distances between two poses".to_owned(),
            Self::Point => "distances from fixed points".to_owned(),
            Self::Position(_) => format!("positions in {}", list(&self.letters())),
        }
    }

    fn letters(self) -> Vec<String> {
        let axes = ["x", "y", "z"].into_iter().zip(self.coordinates());
        let read = axes.filter(|(_, read)| *read);
        read.map(|(letter, _)| letter.to_owned()).collect()
    }

    /// Which coordinates it reads.
    pub const fn coordinates(self) -> [bool; 3] {
        match self {
            Self::Plane | Self::Distance | Self::Point => [false; 3],
            Self::Position(read) => read,
        }
    }

    /// Whether it reads coordinates.
    pub const fn is_position(self) -> bool {
        matches!(self, Self::Position(_))
    }

    /// The number of readings per measurement.
    pub(super) fn readings(self) -> usize {
        let coordinates = self.coordinates();
        coordinates.iter().filter(|read| **read).count().max(1)
    }
}

/// A kind of measurement and how often it may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wish {
    /// The kind.
    pub kind: Kind,
    /// The most measurements of this kind; `None` for any number.
    pub most: Option<usize>,
}

/// The kinds that a plan may choose from. Written `plane`, or `plane,distance=12`: distances too, twelve at
/// most.
///
/// ```
/// use delta_cal_host::planning::{Kind, Wishes};
/// let wishes: Wishes = "plane,distance=12".parse().unwrap();
/// assert_eq!(wishes.0[1].kind, Kind::Distance);
/// assert_eq!(wishes.0[1].most, Some(12));
/// assert!("plate".parse::<Wishes>().is_err());
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wishes(pub Vec<Wish>);

impl Wishes {
    /// Any number of one kind.
    pub fn only(kind: Kind) -> Self {
        Self(vec![Wish { kind, most: None }])
    }

    /// Whether a kind may be used.
    pub fn contain(&self, kind: Kind) -> bool {
        self.0.iter().any(|wish| wish.kind == kind)
    }

    /// Whether some coordinate is read.
    pub fn positions(&self) -> bool {
        self.0.iter().any(|wish| wish.kind.is_position())
    }
}

impl fmt::Display for Wishes {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, wish) in self.0.iter().enumerate() {
            let comma = if index > 0 { "," } else { "" };
            write!(formatter, "{comma}{}", wish.kind.name())?;
            if let Some(most) = wish.most {
                write!(formatter, "={most}")?;
            }
        }
        Ok(())
    }
}

impl FromStr for Wishes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut wishes: Vec<Wish> = Vec::new();
        for part in text.split(',') {
            let (name, most) = match part.split_once('=') {
                Some((name, number)) => (name.trim(), Some(number.trim())),
                None => (part.trim(), None),
            };
            let kind = Kind::ALL.into_iter().find(|kind| kind.name() == name);
            let kind = kind.ok_or_else(|| {
                format!(
                    "'{name}' is not xyz, xy, z …, plane, distance or point, separated by commas"
                )
            })?;
            if wishes.iter().any(|wish| wish.kind == kind) {
                return Err(format!("{name} is given twice"));
            }
            let most = most.map(|number| match number.parse::<usize>() {
                Ok(most) if most > 0 => Ok(most),
                _ => Err(format!("{name}={number}: write a whole number above 0")),
            });
            let most = most.transpose()?;
            wishes.push(Wish { kind, most });
        }
        Ok(Self(wishes))
    }
}

/// A box along the robot's axes, or an upright cylinder about its z axis. Lengths in mm, in the
/// robot's frame. Written `x=-100..100,y=-100..100,z=-500..-400` and `r=200,z=-500..-400`.
///
/// ```
/// use delta_cal_host::planning::Region;
/// let region: Region = "r=200, z=-500..-400".parse().unwrap();
/// assert!(region.contains(&nalgebra::Vector3::new(0.0, 199.0, -450.0)));
/// assert!("r=200".parse::<Region>().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// Smallest and largest x, y and z.
    Box([(f64, f64); 3]),
    /// About the z axis.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Smallest and largest z.
        z: (f64, f64),
    },
}

impl Region {
    /// Whether a position is inside or on the boundary.
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        let within = |value: f64, (low, high): (f64, f64)| value >= low && value <= high;
        match self {
            Self::Box(ranges) => x.iter().zip(ranges).all(|(x, range)| within(*x, *range)),
            Self::Cylinder { radius, z } => x.xy().norm() <= *radius && within(x.z, *z),
        }
    }

    /// Converted to the axes of a convention, or back.
    #[must_use]
    pub fn turned(&self, convention: &Convention) -> Self {
        match *self {
            Self::Box(ranges) => Self::Box(convention.ranges(ranges)),
            Self::Cylinder { radius, z } => Self::Cylinder {
                radius,
                z: convention.ranges([z; 3])[2],
            },
        }
    }

    /// The part within a box; `None` if there is none.
    pub(super) fn clipped(&self, to: &[(f64, f64); 3]) -> Option<Self> {
        let common = |(low, high): (f64, f64), (least, most): (f64, f64)| {
            let range = (low.max(least), high.min(most));
            (range.0 <= range.1).then_some(range)
        };
        let [x, y, z] = *to;
        match self {
            Self::Box([own_x, own_y, own_z]) => Some(Self::Box([
                common(*own_x, x)?,
                common(*own_y, y)?,
                common(*own_z, z)?,
            ])),
            Self::Cylinder { radius, z: own_z } => {
                let furthest = |(low, high): (f64, f64)| low.abs().max(high.abs());
                let corner = (furthest(x).squared() + furthest(y).squared()).square_root();
                Some(Self::Cylinder {
                    radius: radius.min(corner),
                    z: common(*own_z, z)?,
                })
            }
        }
    }

    /// A uniformly distributed position in it.
    pub(super) fn random<R: Rng + ?Sized>(&self, rng: &mut R) -> Vector3<f64> {
        let mut between = |(low, high): (f64, f64)| low + (high - low) * uniform(rng);
        match self {
            Self::Box(ranges) => Vector3::from(ranges.map(between)),
            Self::Cylinder { radius, z } => {
                let distance = radius * between((0.0, 1.0)).sqrt();
                let (sine, cosine) = between((0.0, std::f64::consts::TAU)).sine_cosine();
                Vector3::new(distance * cosine, distance * sine, between(*z))
            }
        }
    }
}

impl fmt::Display for Region {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Box([x, y, z]) => write!(
                formatter,
                "x={}..{},y={}..{},z={}..{}",
                x.0, x.1, y.0, y.1, z.0, z.1
            ),
            Self::Cylinder { radius, z } => write!(formatter, "r={radius},z={}..{}", z.0, z.1),
        }
    }
}

impl FromStr for Region {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::parsed(text).map_err(|cause| {
            format!(
                "{cause}; a box is written x=-100..100,y=-100..100,z=-500..-400 and a cylinder \
                 r=200,z=-500..-400, both in mm"
            )
        })
    }
}

impl Region {
    fn parsed(text: &str) -> Result<Self, String> {
        let (mut coordinates, mut radius) = ([None; 3], None);
        for part in text.split(',') {
            let Some((name, value)) = part.split_once('=') else {
                return Err(format!("'{}' has no =", part.trim()));
            };
            let name = name.trim();
            let taken = if name == "r" {
                radius.replace(positive(value)?).is_some()
            } else {
                let index = ["x", "y", "z"].iter().position(|axis| *axis == name);
                let coordinate = index.and_then(|index| coordinates.get_mut(index));
                let Some(coordinate) = coordinate else {
                    return Err(format!("'{name}' is not one of x, y, z and r"));
                };
                coordinate.replace(range(name, value)?).is_some()
            };
            if taken {
                return Err(format!("{name} is given twice"));
            }
        }
        match (coordinates, radius) {
            ([Some(x), Some(y), Some(z)], None) => Ok(Self::Box([x, y, z])),
            ([None, None, Some(z)], Some(radius)) => Ok(Self::Cylinder { radius, z }),
            (_, Some(_)) => Err("a cylinder has r and z and nothing else".to_owned()),
            (coordinates, None) => {
                let missing = ["x", "y", "z"].into_iter().zip(coordinates);
                let missing: Vec<_> = missing
                    .filter_map(|(axis, range)| range.is_none().then_some(axis))
                    .collect();
                Err(format!("{} missing", missing.join(" and ")))
            }
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 {
        return Ok(value);
    }
    let cause = format!("the radius {} must be greater than 0", text.trim());
    Err(cause)
}

fn range(name: &str, text: &str) -> Result<(f64, f64), String> {
    let text = text.trim();
    let fault = |cause: &str| format!("{name}={text} {cause}");
    let (low, high) = text
        .split_once("..")
        .ok_or_else(|| fault("is not a range such as -100..100"))?;
    let (low, high) = (number(low)?, number(high)?);
    if low < high {
        Ok((low, high))
    } else {
        Err(fault("is empty: the smaller number comes first"))
    }
}

/// A length, in mm where it has no unit.
fn number(text: &str) -> Result<f64, String> {
    let length = length(text).map(|(length, _)| length);
    length.ok_or_else(|| format!("'{}' is not a number", text.trim()))
}

/// A uniformly distributed number in [0, 1).
pub(super) fn uniform<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    // 53 bits, the precision of a double.
    let bits = rng.next_u64() >> 11;
    let number = bits as f64;
    number * f64::EPSILON / 2.0
}

/// A uniformly distributed whole number below `number`.
pub(super) fn below(number: usize, rng: &mut impl Rng) -> usize {
    usize::try_from(rng.next_u64() % number.max(1) as u64).unwrap_or(0)
}
