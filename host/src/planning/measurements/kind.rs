//! Kinds of measurements.

use std::fmt;
use std::str::FromStr;

/// What a measurement reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A height above a plane.
    Plane,
    /// The distance between the platform's positions at two poses.
    Distance,
    /// The distance from a fixed point.
    Point,
    /// Two coordinates.
    Xy,
    /// One coordinate.
    Z,
    /// Three coordinates.
    Xyz,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Plane,
        Self::Distance,
        Self::Point,
        Self::Xy,
        Self::Z,
        Self::Xyz,
    ];

    /// As it is written.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Distance => "distance",
            Self::Point => "point",
            Self::Xy => "xy",
            Self::Z => "z",
            Self::Xyz => "xyz",
        }
    }

    /// What is measured, in the plural.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Plane => "heights above a plane",
            Self::Distance => "distances between two poses",
            Self::Point => "distances from fixed points",
            Self::Xy => "positions in x and y",
            Self::Z => "positions in z",
            Self::Xyz => "positions in x, y and z",
        }
    }

    /// Which coordinates it reads.
    pub const fn coordinates(self) -> [bool; 3] {
        match self {
            Self::Plane | Self::Distance | Self::Point => [false; 3],
            Self::Xy => [true, true, false],
            Self::Z => [false, false, true],
            Self::Xyz => [true; 3],
        }
    }

    /// Whether it reads coordinates, which are in some frame.
    pub const fn is_position(self) -> bool {
        matches!(self, Self::Xy | Self::Z | Self::Xyz)
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
/// use delta_cal_host::planning::measurements::{Kind, Wishes};
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
        let names = Kind::ALL.map(Kind::name).join(", ");
        let mut wishes: Vec<Wish> = Vec::new();
        for part in text.split(',') {
            let (name, most) = match part.split_once('=') {
                Some((name, number)) => (name.trim(), Some(number.trim())),
                None => (part.trim(), None),
            };
            let kind = Kind::ALL.into_iter().find(|kind| kind.name() == name);
            let kind = kind.ok_or_else(|| {
                format!(
                    "'{name}' is no kind of measurement; there are {names}, separated by commas"
                )
            })?;
            if wishes.iter().any(|wish| wish.kind == kind) {
                return Err(format!("{name} is given twice"));
            }
            let most = most.map(|number| match number.parse::<usize>() {
                Ok(most) if most > 0 => Ok(most),
                _ => Err(format!(
                    "{name}={number}: after = stands how many of them there may be, a whole number above 0"
                )),
            });
            let most = most.transpose()?;
            wishes.push(Wish { kind, most });
        }
        Ok(Self(wishes))
    }
}
