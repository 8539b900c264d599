//! Kinds of measurements.

use crate::text::words::list;
use std::fmt;
use std::str::FromStr;

/// Fewer measurements are not planned.
pub const LEAST: usize = 4;
/// As many as a plan may have.
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
    /// Coordinates: whether x, y and z.
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

    /// As it is written: `plane`, `distance`, `point`, or the letters of the coordinates.
    pub fn name(self) -> String {
        match self {
            Self::Plane => "plane".to_owned(),
            Self::Distance => "distance".to_owned(),
            Self::Point => "point".to_owned(),
            Self::Position(_) => self.letters().concat(),
        }
    }

    /// What is measured, in the plural.
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

    /// Whether it reads coordinates, which are in some frame.
    pub const fn is_position(self) -> bool {
        matches!(self, Self::Position(_))
    }

    /// How many numbers it reads.
    pub(super) fn readings(self) -> usize {
        let coordinates = self.coordinates();
        coordinates.iter().filter(|read| **read).count().max(1)
    }
}

/// A kind that may be used, and how often.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wish {
    /// The kind.
    pub kind: Kind,
    /// So many of it at most.
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
