//! The quantity and unit of each column of a file, taken from its name (`q1_deg`) or, for other names, from `--columns`
//! (`q1_deg=A1,x_mm=Pos X`).

use delta_cal::robot::Drive;
use std::str::FromStr;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// A joint angle, or the travel of a linear drive: 0, 1 or 2.
    Joint(Drive, usize),
    /// The same for the pose at which a distance between two poses starts.
    ToJoint(Drive, usize),
    X,
    Y,
    Z,
    /// A component of the rotation vector of a target's frame against that of the coordinates: 0, 1 or 2.
    Turn(usize),
    Height,
    Plane,
    Distance,
    Point,
    Target,
    /// Standard uncertainty of the row's readings.
    Sigma,
    /// Expanded uncertainty of the row's readings, k = 2.
    Expanded,
}

/// The unit of a column's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Degrees.
    Degree,
    /// Radians.
    Radian,
    /// Encoder counts; the robot file states how many make a degree.
    Count,
    /// Millimetres.
    Millimetre,
    /// Centimetres.
    Centimetre,
    /// Metres.
    Metre,
    /// Micrometres.
    Micrometre,
    /// Inches.
    Inch,
    /// A word, not a number.
    Name,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Angle,
    Length,
    Name,
}

/// The meaning of a column's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ColumnName {
    pub(crate) quantity: Quantity,
    /// `None` if the name should state a unit but does not.
    pub(crate) unit: Option<Unit>,
}

/// The usual name of each quantity comes first.
const QUANTITIES: [(Quantity, &str, Kind); 27] = [
    (Quantity::Joint(Drive::Rotary, 0), "q1", Kind::Angle),
    (Quantity::Joint(Drive::Rotary, 1), "q2", Kind::Angle),
    (Quantity::Joint(Drive::Rotary, 2), "q3", Kind::Angle),
    (Quantity::X, "x", Kind::Length),
    (Quantity::Y, "y", Kind::Length),
    (Quantity::Z, "z", Kind::Length),
    (Quantity::Turn(0), "rx", Kind::Angle),
    (Quantity::Turn(1), "ry", Kind::Angle),
    (Quantity::Turn(2), "rz", Kind::Angle),
    (Quantity::Height, "height", Kind::Length),
    (Quantity::Plane, "plane", Kind::Name),
    (Quantity::Distance, "distance", Kind::Length),
    (Quantity::Point, "point", Kind::Name),
    (Quantity::Target, "target", Kind::Name),
    (Quantity::ToJoint(Drive::Rotary, 0), "to_q1", Kind::Angle),
    (Quantity::ToJoint(Drive::Rotary, 1), "to_q2", Kind::Angle),
    (Quantity::ToJoint(Drive::Rotary, 2), "to_q3", Kind::Angle),
    (Quantity::Joint(Drive::Linear, 0), "s1", Kind::Length),
    (Quantity::Joint(Drive::Linear, 1), "s2", Kind::Length),
    (Quantity::Joint(Drive::Linear, 2), "s3", Kind::Length),
    (Quantity::ToJoint(Drive::Linear, 0), "to_s1", Kind::Length),
    (Quantity::ToJoint(Drive::Linear, 1), "to_s2", Kind::Length),
    (Quantity::ToJoint(Drive::Linear, 2), "to_s3", Kind::Length),
    (Quantity::Sigma, "sigma", Kind::Length),
    (Quantity::Sigma, "u", Kind::Length),
    (Quantity::Expanded, "u_k2", Kind::Length),
    (Quantity::Expanded, "expanded", Kind::Length),
];

/// The usual name of each unit comes first.
const UNITS: [(Unit, Kind, &str); 8] = [
    (Unit::Degree, Kind::Angle, "deg ° degree degrees"),
    (Unit::Radian, Kind::Angle, "rad radian radians"),
    (Unit::Count, Kind::Angle, "counts count"),
    (
        Unit::Millimetre,
        Kind::Length,
        "mm millimetre millimetres millimeter millimeters",
    ),
    (
        Unit::Centimetre,
        Kind::Length,
        "cm centimetre centimetres centimeter centimeters",
    ),
    (Unit::Metre, Kind::Length, "m metre metres meter meters"),
    (
        Unit::Micrometre,
        Kind::Length,
        "um \u{b5}m \u{3bc}m micron microns",
    ),
    (Unit::Inch, Kind::Length, "in inch inches"),
];

impl Quantity {
    pub(crate) const COORDINATES: [Self; 3] = [Self::X, Self::Y, Self::Z];
    /// The rotation vector.
    pub(crate) const TURNS: [Self; 3] = [Self::Turn(0), Self::Turn(1), Self::Turn(2)];
    /// Quantities that can be measured.
    pub(crate) const READINGS: [Self; 5] =
        [Self::X, Self::Y, Self::Z, Self::Height, Self::Distance];

    /// Joint angles, or travels of linear drives.
    pub(crate) fn joints(drive: Drive) -> [Self; 3] {
        [0, 1, 2].map(|joint| Self::Joint(drive, joint))
    }

    /// Joints of the pose at which a distance between two poses starts.
    pub(crate) fn to_joints(drive: Drive) -> [Self; 3] {
        [0, 1, 2].map(|joint| Self::ToJoint(drive, joint))
    }

    fn entry(self) -> (&'static str, Kind) {
        let entry = QUANTITIES.into_iter().find(|(own, ..)| *own == self);
        entry.map_or(("", Kind::Name), |(_, name, kind)| (name, kind))
    }

    /// The unit assumed if the name states none.
    pub(crate) fn usual_unit(self) -> Unit {
        match self.entry().1 {
            Kind::Angle => Unit::Degree,
            Kind::Length => Unit::Millimetre,
            Kind::Name => Unit::Name,
        }
    }

    /// The index of the coordinate or of the component of the rotation vector.
    pub(crate) fn axis(self) -> Option<usize> {
        match self {
            Self::Turn(axis) => Some(axis),
            own => Self::COORDINATES.iter().position(|axis| *axis == own),
        }
    }

    /// The index of the joint.
    pub(crate) const fn joint(self) -> Option<usize> {
        match self {
            Self::Joint(_, joint) | Self::ToJoint(_, joint) => Some(joint),
            _ => None,
        }
    }

    pub(crate) fn is_angle(self) -> bool {
        self.entry().1 == Kind::Angle
    }

    /// The column's name in a header: `q1_deg`.
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
            Self::Radian | Self::Count | Self::Millimetre | Self::Name => value,
        }
    }

    /// Converts a length from mm to this unit.
    pub(crate) fn outwards(self, length: f64) -> f64 {
        match self {
            Self::Centimetre => length / 10.0,
            Self::Metre => length / 1000.0,
            Self::Micrometre => length * 1000.0,
            Self::Inch => length / 25.4,
            _ => length,
        }
    }

    /// The unit's suffix in a column name.
    fn word(self) -> &'static str {
        let entry = UNITS.into_iter().find(|(own, ..)| *own == self);
        entry
            .and_then(|(.., words)| words.split(' ').next())
            .unwrap_or("")
    }

    fn of(word: &str) -> Option<(Self, Kind)> {
        let mut units = UNITS.into_iter();
        let (unit, kind, _) = units.find(|(.., words)| words.split(' ').any(|own| own == word))?;
        Some((unit, kind))
    }

    /// The unit at the end of an otherwise arbitrary name: `Pos X [mm]`.
    pub(crate) fn at_end_of(name: &str, quantity: Quantity) -> Option<Self> {
        let words = words(name);
        let (last, before) = words.split_last()?;
        let (unit, kind) = Self::of(last)?;
        (!before.is_empty() && kind == quantity.entry().1).then_some(unit)
    }
}

/// Parses `0.1mm`, `300 mm` or `0.3 m`: a length in mm, and whether its unit is stated.
pub(crate) fn length(text: &str) -> Option<(f64, bool)> {
    let text = text.trim();
    let (number, word) = text.split_at(text.trim_end_matches(char::is_alphabetic).len());
    let (unit, kind) = match word {
        "" => (Unit::Millimetre, Kind::Length),
        word => Unit::of(word)?,
    };
    let length = unit.to_internal(number.trim_end().parse().ok()?);
    (kind == Kind::Length && length.is_finite()).then_some((length, !word.is_empty()))
}

impl ColumnName {
    /// Recognises a name in any case and with any separators: `q1_deg`, `Q1 [deg]`, `q1/°`.
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

/// Lower-case words of letters or digits, split at everything else.
fn words(name: &str) -> Vec<String> {
    let degrees = name.replace('°', " ° ");
    let part = |c: char| c.is_alphanumeric() || c == '°';
    let words = degrees.split(|c| !part(c)).filter(|word| !word.is_empty());
    words.map(str::to_ascii_lowercase).collect()
}

/// The value of the option `--columns`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ColumnMapping(pub(crate) Vec<Mapped>);

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mapped {
    /// The column's name in the file.
    pub(crate) column: String,
    /// Its quantity, in the stated unit or in the unit at the end of the column's name.
    pub(crate) name: ColumnName,
}

const EXAMPLE: &str = "as q1_deg=A1,x_mm=X: before = what the column holds and its unit, after it the \
                       column's name in the file";

impl ColumnMapping {
    /// The quantity mapped to a column number (`place` counts from 0); `None` if one of the names is that number.
    pub(crate) fn of_place(&self, place: usize, names: &[String]) -> Option<ColumnName> {
        let number = (place + 1).to_string();
        let mapped = self.of_column(&number)?;
        (!names.contains(&number)).then_some(mapped)
    }

    /// The quantity mapped to a column name.
    pub(crate) fn of_column(&self, column: &str) -> Option<ColumnName> {
        let mut all = self.0.iter();
        let mapped = all.find(|mapped| mapped.column == column)?;
        Some(mapped.name)
    }

    /// Whether a column is mapped to this quantity.
    pub(crate) fn has(&self, quantity: Quantity) -> bool {
        self.0.iter().any(|mapped| mapped.name.quantity == quantity)
    }
}

impl FromStr for ColumnMapping {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut mapping = Self::default();
        for part in text.split(',') {
            let mapped = mapped(part.trim())?;
            let quantity = mapped.name.quantity;
            if mapping.has(quantity) {
                let name = quantity.column(quantity.usual_unit());
                return Err(format!("{name} is given two columns"));
            }
            if mapping.of_column(&mapped.column).is_some() {
                return Err(format!("the column {} is given twice", mapped.column));
            }
            mapping.0.push(mapped);
        }
        Ok(mapping)
    }
}

fn mapped(part: &str) -> Result<Mapped, String> {
    let Some((name, column)) = part.split_once('=') else {
        return Err(format!("\"{part}\" has no =; write it {EXAMPLE}"));
    };
    let (written, column) = (name.trim(), column.trim());
    if column.is_empty() {
        return Err(format!(
            "no column is named after {written}=; write it {EXAMPLE}"
        ));
    }
    let Some(mut name) = ColumnName::recognise(written) else {
        return Err(format!(
            "\"{written}\" is not what a column can hold: that is q1_deg, q2_deg, q3_deg, x_mm, y_mm, z_mm, \
             rx_deg, ry_deg, rz_deg, height_mm, plane, distance_mm, point, sigma_mm, u_k2_mm, to_q1_deg, to_q2_deg, to_q3_deg, of a linear drive s1_mm, \
             s2_mm, s3_mm, to_s1_mm, to_s2_mm, to_s3_mm, or the same in _rad, _counts, _cm, _m, _um or _in"
        ));
    };
    let own = Unit::at_end_of(column, name.quantity);
    if let (Some(stated), Some(own)) = (name.unit, own)
        && stated != own
    {
        return Err(format!(
            "{part}: the column's name ends with another unit than {written}; give the column's own unit, \
             {}={column}",
            name.quantity.column(own)
        ));
    }
    name.unit = name.unit.or(own);
    Ok(Mapped {
        column: column.to_owned(),
        name,
    })
}

#[cfg(test)]
mod tests {
    use super::{ColumnMapping, ColumnName, Drive, Quantity, Unit};

    #[test]
    fn names_are_recognised_however_they_are_written() {
        let (q, to) = (
            Quantity::joints(Drive::Rotary),
            Quantity::to_joints(Drive::Rotary),
        );
        let known: [(&str, Quantity, Option<Unit>); 16] = [
            ("q1_deg", q[0], Some(Unit::Degree)),
            ("Q1", q[0], None),
            ("q_2 (rad)", q[1], Some(Unit::Radian)),
            ("q3 [°]", q[2], Some(Unit::Degree)),
            ("Q3°", q[2], Some(Unit::Degree)),
            ("X [mm]", Quantity::X, Some(Unit::Millimetre)),
            ("y/cm", Quantity::Y, Some(Unit::Centimetre)),
            ("z_in", Quantity::Z, Some(Unit::Inch)),
            ("x_m", Quantity::X, Some(Unit::Metre)),
            ("x \u{b5}m", Quantity::X, Some(Unit::Micrometre)),
            ("x", Quantity::X, None),
            ("To Q1 [deg]", to[0], Some(Unit::Degree)),
            ("to_q2_rad", to[1], Some(Unit::Radian)),
            ("Height (mm)", Quantity::Height, Some(Unit::Millimetre)),
            ("Plane", Quantity::Plane, Some(Unit::Name)),
            ("distance", Quantity::Distance, None),
        ];
        for (name, quantity, unit) in known {
            let expected = ColumnName { quantity, unit };
            assert_eq!(ColumnName::recognise(name), Some(expected), "{name}");
        }
        // Unit of another kind, no separator before the unit, unknown name.
        for name in [
            "q1_mm", "x_deg", "xmm", "xm", "mm", "", "A1", "q4_deg", "plane_mm", "x_ft",
        ] {
            assert_eq!(ColumnName::recognise(name), None, "{name}");
        }
    }

    #[test]
    fn a_mapping_that_is_ambiguous_is_refused() {
        for (written, cause) in [
            ("", "no ="),
            ("A1", "no ="),
            ("q1_deg=", "no column"),
            ("A1=q1_deg", "not what a column can hold"),
            ("q1_deg=A1,q1_rad=A2", "two columns"),
            ("q1_deg=A1,q2_deg=A1", "given twice"),
            ("x_mm=X [m]", "another unit"),
        ] {
            let refused = written.parse::<ColumnMapping>().err().unwrap_or_default();
            assert!(refused.contains(cause), "{written}: {refused}");
        }
    }
}
