//! What a column holds, in which unit, as its name says.

use delta_cal::robot::Drive;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    Joint1,
    Joint2,
    Joint3,
    X,
    Y,
    Z,
    Height,
    Plane,
    Distance,
    Point,
    ToJoint1,
    ToJoint2,
    ToJoint3,
    Travel1,
    Travel2,
    Travel3,
    ToTravel1,
    ToTravel2,
    ToTravel3,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    Degree,
    Radian,
    Millimetre,
    Centimetre,
    Metre,
    Micrometre,
    Inch,
    /// A word.
    Name,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Angle,
    Length,
    Name,
}

/// What the name of a column says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ColumnName {
    pub(crate) quantity: Quantity,
    /// `None` if the name states none and should.
    pub(crate) unit: Option<Unit>,
}

/// How many there are.
pub(crate) const COUNT: usize = 19;

const QUANTITIES: [(Quantity, &str, Kind); COUNT] = [
    (Quantity::Joint1, "q1", Kind::Angle),
    (Quantity::Joint2, "q2", Kind::Angle),
    (Quantity::Joint3, "q3", Kind::Angle),
    (Quantity::X, "x", Kind::Length),
    (Quantity::Y, "y", Kind::Length),
    (Quantity::Z, "z", Kind::Length),
    (Quantity::Height, "height", Kind::Length),
    (Quantity::Plane, "plane", Kind::Name),
    (Quantity::Distance, "distance", Kind::Length),
    (Quantity::Point, "point", Kind::Name),
    (Quantity::ToJoint1, "to_q1", Kind::Angle),
    (Quantity::ToJoint2, "to_q2", Kind::Angle),
    (Quantity::ToJoint3, "to_q3", Kind::Angle),
    (Quantity::Travel1, "s1", Kind::Length),
    (Quantity::Travel2, "s2", Kind::Length),
    (Quantity::Travel3, "s3", Kind::Length),
    (Quantity::ToTravel1, "to_s1", Kind::Length),
    (Quantity::ToTravel2, "to_s2", Kind::Length),
    (Quantity::ToTravel3, "to_s3", Kind::Length),
];

/// The usual unit of its kind first; of each unit the usual name first.
const UNITS: [(Unit, Kind, &[&str]); 7] = [
    (
        Unit::Degree,
        Kind::Angle,
        &["deg", "°", "degree", "degrees"],
    ),
    (Unit::Radian, Kind::Angle, &["rad", "radian", "radians"]),
    (
        Unit::Millimetre,
        Kind::Length,
        &[
            "mm",
            "millimetre",
            "millimetres",
            "millimeter",
            "millimeters",
        ],
    ),
    (
        Unit::Centimetre,
        Kind::Length,
        &[
            "cm",
            "centimetre",
            "centimetres",
            "centimeter",
            "centimeters",
        ],
    ),
    (
        Unit::Metre,
        Kind::Length,
        &["m", "metre", "metres", "meter", "meters"],
    ),
    (
        Unit::Micrometre,
        Kind::Length,
        &["um", "\u{b5}m", "\u{3bc}m", "micron", "microns"],
    ),
    (Unit::Inch, Kind::Length, &["in", "inch", "inches"]),
];

/// The first word of names whose columns hold no measurement.
const NOTES: [&str; 24] = [
    "comment",
    "comments",
    "date",
    "datetime",
    "file",
    "id",
    "index",
    "label",
    "name",
    "no",
    "note",
    "notes",
    "nr",
    "number",
    "operator",
    "remark",
    "remarks",
    "row",
    "sample",
    "temperature",
    "time",
    "timestamp",
    "user",
    "utc",
];

impl Quantity {
    pub(crate) const COORDINATES: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Joint angles, or the travels of linear drives.
    pub(crate) const fn joints(drive: Drive) -> [Self; 3] {
        match drive {
            Drive::Rotary => [Self::Joint1, Self::Joint2, Self::Joint3],
            Drive::Linear => [Self::Travel1, Self::Travel2, Self::Travel3],
        }
    }

    /// Those at which a distance between two poses begins.
    pub(crate) const fn to_joints(drive: Drive) -> [Self; 3] {
        match drive {
            Drive::Rotary => [Self::ToJoint1, Self::ToJoint2, Self::ToJoint3],
            Drive::Linear => [Self::ToTravel1, Self::ToTravel2, Self::ToTravel3],
        }
    }

    fn entry(self) -> (&'static str, Kind) {
        let entry = QUANTITIES.into_iter().find(|(own, ..)| *own == self);
        entry.map_or(("", Kind::Name), |(_, name, kind)| (name, kind))
    }

    /// Its unit, if a name states none.
    pub(crate) fn usual_unit(self) -> Unit {
        match self.entry().1 {
            Kind::Angle => Unit::Degree,
            Kind::Length => Unit::Millimetre,
            Kind::Name => Unit::Name,
        }
    }

    pub(crate) fn is_angle(self) -> bool {
        self.entry().1 == Kind::Angle
    }

    /// As a header should have it: `q1_deg`.
    pub(crate) fn column(self, unit: Unit) -> String {
        let (name, _) = self.entry();
        match unit.word() {
            "" => name.to_owned(),
            word => format!("{name}_{word}"),
        }
    }
}

impl Unit {
    pub(crate) fn to_internal(self, value: f64) -> f64 {
        match self {
            Self::Degree => value.to_radians(),
            Self::Centimetre => value * 10.0,
            Self::Metre => value * 1000.0,
            Self::Micrometre => value / 1000.0,
            Self::Inch => value * 25.4,
            Self::Radian | Self::Millimetre | Self::Name => value,
        }
    }

    /// As a column's name ends with it.
    fn word(self) -> &'static str {
        let entry = UNITS.into_iter().find(|(own, ..)| *own == self);
        entry.and_then(|(.., words)| words.first()).unwrap_or(&"")
    }

    fn of(word: &str) -> Option<(Self, Kind)> {
        let mut units = UNITS.into_iter();
        let (unit, kind, _) = units.find(|(.., words)| words.contains(&word))?;
        Some((unit, kind))
    }

    /// The unit of length that this word names.
    pub(crate) fn of_length(word: &str) -> Option<Self> {
        let (unit, kind) = Self::of(word)?;
        (kind == Kind::Length).then_some(unit)
    }

    /// The unit with which a name ends that is otherwise any: `Pos X [mm]`.
    pub(crate) fn at_end_of(name: &str, quantity: Quantity) -> Option<Self> {
        let words = words(name);
        let (last, before) = words.split_last()?;
        let (unit, kind) = Self::of(last)?;
        (!before.is_empty() && kind == quantity.entry().1).then_some(unit)
    }
}

impl ColumnName {
    /// Whatever its letters' case and however its words are separated: `q1_deg`, `Q1 [deg]`, `q1/°`.
    pub(crate) fn recognise(name: &str) -> Option<Self> {
        let words = words(name);
        let (last, before) = words.split_last()?;
        let unit = Unit::of(last).filter(|_| !before.is_empty());
        let own = if unit.is_some() { before } else { &words };
        let own = own.concat();
        let found = |(_, name, kind): &(Quantity, &str, Kind)| {
            name.replace('_', "") == own && unit.is_none_or(|(_, of)| of == *kind)
        };
        let (quantity, _, kind) = QUANTITIES.into_iter().find(found)?;
        Some(Self {
            quantity,
            unit: match unit {
                Some((unit, _)) => Some(unit),
                None => (kind == Kind::Name).then_some(Unit::Name),
            },
        })
    }
}

/// Whether a column of this name holds no measurement: a time, a number of the row, a comment.
pub(crate) fn is_note(name: &str) -> bool {
    let words = words(name);
    let length = |word: &String| Unit::of(word).is_some();
    let first = words
        .first()
        .is_some_and(|word| NOTES.contains(&word.as_str()));
    first && !words.last().is_some_and(length)
}

/// Its letters and digits in lower case, wherever anything else separates them.
fn words(name: &str) -> Vec<String> {
    let degrees = name.replace('°', " ° ");
    let part = |c: char| c.is_alphanumeric() || c == '°';
    let words = degrees.split(|c| !part(c)).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::{ColumnName, Quantity, Unit, is_note};

    #[test]
    fn names_are_recognised_however_they_are_written() {
        let known: [(&str, Quantity, Option<Unit>); 16] = [
            ("q1_deg", Quantity::Joint1, Some(Unit::Degree)),
            ("Q1", Quantity::Joint1, None),
            ("q_2 (rad)", Quantity::Joint2, Some(Unit::Radian)),
            ("q3 [°]", Quantity::Joint3, Some(Unit::Degree)),
            ("Q3°", Quantity::Joint3, Some(Unit::Degree)),
            ("X [mm]", Quantity::X, Some(Unit::Millimetre)),
            ("y/cm", Quantity::Y, Some(Unit::Centimetre)),
            ("z_in", Quantity::Z, Some(Unit::Inch)),
            ("x_m", Quantity::X, Some(Unit::Metre)),
            ("x \u{b5}m", Quantity::X, Some(Unit::Micrometre)),
            ("x", Quantity::X, None),
            ("To Q1 [deg]", Quantity::ToJoint1, Some(Unit::Degree)),
            ("to_q2_rad", Quantity::ToJoint2, Some(Unit::Radian)),
            ("Height (mm)", Quantity::Height, Some(Unit::Millimetre)),
            ("Plane", Quantity::Plane, Some(Unit::Name)),
            ("distance", Quantity::Distance, None),
        ];
        for (name, quantity, unit) in known {
            let expected = ColumnName { quantity, unit };
            assert_eq!(ColumnName::recognise(name), Some(expected), "{name}");
        }
        // A unit of another kind, no separator before the unit, another name.
        for name in [
            "q1_mm", "x_deg", "xmm", "xm", "mm", "", "A1", "q4_deg", "plane_mm", "x_ft",
        ] {
            assert_eq!(ColumnName::recognise(name), None, "{name}");
        }
    }

    #[test]
    fn notes_are_no_measurements() {
        for name in [
            "timestamp",
            "Timestamp (UTC)",
            "time [s]",
            "Comment",
            "sample_no",
            "nr.",
        ] {
            assert!(is_note(name), "{name}");
        }
        for name in ["q1", "force", "time_mm", "sample_deg", "w_mm", "", "x_time"] {
            assert!(!is_note(name), "{name}");
        }
    }
}
