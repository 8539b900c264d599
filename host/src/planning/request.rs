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
pub struct Region {
    /// Smallest and largest x, y and z.
    ranges: [(f64, f64); 3],
    /// Of a cylinder.
    radius: Option<f64>,
}

impl Region {
    /// Whether a position is inside or on the boundary.
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        let mut coordinates = x.iter().zip(&self.ranges);
        coordinates.all(|(x, (low, high))| x >= low && x <= high)
            && self.radius.is_none_or(|radius| x.xy().norm() <= radius)
    }

    /// Converted to the axes of a convention, or back.
    pub(super) fn turned(&self, convention: &Convention) -> Self {
        Self {
            ranges: convention.ranges(self.ranges),
            ..*self
        }
    }

    /// The part within a box; `None` if there is none.
    pub(super) fn clipped(&self, to: &[(f64, f64); 3]) -> Option<Self> {
        let mut ranges = self.ranges;
        for ((low, high), (least, most)) in ranges.iter_mut().zip(to) {
            (*low, *high) = (low.max(*least), high.min(*most));
            if *low > *high {
                return None;
            }
        }
        let furthest = |(low, high): (f64, f64)| low.abs().max(high.abs()).squared();
        let corner = (furthest(to[0]) + furthest(to[1])).square_root();
        let radius = self.radius.map(|radius| radius.min(corner));
        Some(Self { ranges, radius })
    }

    /// A uniformly distributed position in it.
    pub(super) fn random<R: Rng + ?Sized>(&self, rng: &mut R) -> Vector3<f64> {
        let mut between = |(low, high): (f64, f64)| low + (high - low) * uniform(rng);
        let Some(radius) = self.radius else {
            return Vector3::from(self.ranges.map(between));
        };
        let distance = radius * between((0.0, 1.0)).sqrt();
        let (sine, cosine) = between((0.0, std::f64::consts::TAU)).sine_cosine();
        Vector3::new(distance * cosine, distance * sine, between(self.ranges[2]))
    }
}

impl fmt::Display for Region {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.ranges;
        match self.radius {
            Some(radius) => write!(formatter, "r={radius}")?,
            None => write!(formatter, "x={}..{},y={}..{}", x.0, x.1, y.0, y.1)?,
        }
        write!(formatter, ",z={}..{}", z.0, z.1)
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
            let (name, value) = (name.trim(), value.trim());
            let taken = if name == "r" {
                let number = number(value)?;
                if !(number > 0.0) {
                    return Err(format!("the radius {value} must be greater than 0"));
                }
                radius.replace(number).is_some()
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
        let ranges = match (coordinates, radius) {
            ([Some(x), Some(y), Some(z)], None) => [x, y, z],
            ([None, None, Some(z)], Some(radius)) => [(-radius, radius), (-radius, radius), z],
            (_, Some(_)) => return Err("a cylinder has r and z and nothing else".to_owned()),
            (coordinates, None) => {
                let missing = ["x", "y", "z"].into_iter().zip(coordinates);
                let missing = missing.filter_map(|(axis, range)| range.is_none().then_some(axis));
                let missing: Vec<_> = missing.collect();
                return Err(format!("{} missing", missing.join(" and ")));
            }
        };
        Ok(Self { ranges, radius })
    }
}

fn range(name: &str, text: &str) -> Result<(f64, f64), String> {
    let Some((low, high)) = text.split_once("..") else {
        return Err(format!("{name}={text} is not a range such as -100..100"));
    };
    let (low, high) = (number(low)?, number(high)?);
    if low < high {
        Ok((low, high))
    } else {
        let cause = "is empty: the smaller number comes first";
        Err(format!("{name}={text} {cause}"))
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
