//! What a plan may contain, and in which order it is measured.

use super::PlanError;
use crate::files::{Kind as ReadingKind, RobotFile};
use crate::fit::Frame;
use crate::geometry::Region;
use crate::halt::Steps;
use crate::text::list;
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// The smallest number of measurements in a plan.
pub const LEAST: usize = 4;
/// The largest number of measurements in a plan.
pub const MOST: usize = 500;

/// A request for measurements.
#[derive(Debug, Clone)]
pub struct PlanRequest<'a> {
    /// The robot as it is known, with its instruments, their noise and its tolerance.
    pub robot: &'a RobotFile,
    /// The kinds to choose from.
    pub kinds: Wishes,
    /// The number of measurements.
    pub count: usize,
    /// The expected position error, mm, rms, that as few measurements as possible are to reach in place of that number.
    pub accuracy: Option<f64>,
    /// The frame of coordinates.
    pub frame: Frame,
    /// Where the platform may be, in the axes of the robot file; anywhere if `None`.
    pub region: Option<Region>,
    /// Minimise the absolute position error instead of the relative one.
    pub absolute: bool,
    /// The order in which they are taken.
    pub order: Order,
    /// The same seed gives the same plan.
    pub seed: u64,
    /// Where the planner counts its exchanges.
    pub steps: Option<&'a Steps>,
}

impl<'a> PlanRequest<'a> {
    /// `count` measurements of these kinds anywhere, minimising the relative error, in random order.
    pub fn new(robot: &'a RobotFile, kinds: Wishes, count: usize) -> Self {
        Self {
            robot,
            kinds,
            count,
            accuracy: None,
            frame: Frame::Base,
            region: None,
            absolute: false,
            order: Order::Random,
            seed: 1,
            steps: None,
        }
    }

    /// Whether something has a known place, if that is needed.
    pub(super) fn place(&self) -> Result<(), PlanError> {
        let known = &self.robot.instruments;
        let places = known.datum.len() + known.planes.len() + known.points.len();
        if self.absolute && self.frame == Frame::Sensor && places == 0 {
            return Err(PlanError::NoPlace);
        }
        Ok(())
    }
}

/// The order of the measurements within each set-up: a gauge block, or a sensor at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// Random, with each instrument's first measurement repeated as its last. A drift then cannot be mistaken for an
    /// error of the parameters, and shows in the repeated measurement.
    #[default]
    Random,
    /// A short path of the joints.
    Shortest,
}

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

    /// Whose noise it has.
    pub const fn reads(self) -> ReadingKind {
        match self {
            Self::Position(_) => ReadingKind::Position,
            Self::Plane => ReadingKind::Height,
            Self::Distance | Self::Point => ReadingKind::Distance,
        }
    }

    /// The number of readings per measurement.
    pub(super) fn readings(self) -> usize {
        let coordinates = self.coordinates();
        coordinates.iter().filter(|read| **read).count().max(1)
    }
}

/// The name, in JSON.
impl Serialize for Kind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.name().serialize(serializer)
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
        self.read(ReadingKind::Position)
    }

    /// Whether some reading is of this kind.
    pub(super) fn read(&self, kind: ReadingKind) -> bool {
        self.0.iter().any(|wish| wish.kind.reads() == kind)
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
