//! A CSV file of named columns with units.

use super::records::{IGNORED, check_length, check_separator, records};
use super::row::Row;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::geometry::joint_limits::outside_limits;
use csv::StringRecord;
use delta_cal::kinematics::JointLimits;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Joint1,
    Joint2,
    Joint3,
    X,
    Y,
    Z,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Degree,
    Radian,
    Millimetre,
    Metre,
}

const COLUMNS: [(&str, Quantity, Unit); 12] = [
    ("q1_deg", Quantity::Joint1, Unit::Degree),
    ("q2_deg", Quantity::Joint2, Unit::Degree),
    ("q3_deg", Quantity::Joint3, Unit::Degree),
    ("x_mm", Quantity::X, Unit::Millimetre),
    ("y_mm", Quantity::Y, Unit::Millimetre),
    ("z_mm", Quantity::Z, Unit::Millimetre),
    ("q1_rad", Quantity::Joint1, Unit::Radian),
    ("q2_rad", Quantity::Joint2, Unit::Radian),
    ("q3_rad", Quantity::Joint3, Unit::Radian),
    ("x_m", Quantity::X, Unit::Metre),
    ("y_m", Quantity::Y, Unit::Metre),
    ("z_m", Quantity::Z, Unit::Metre),
];

const KNOWN: &str = "the columns are q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm (or _rad and _m), in any \
                     order, separated by commas; the program ignores columns whose name begins \
                     with _";

/// Larger numbers, in mm or rad, have the wrong unit or a wrong exponent.
const LARGEST: f64 = 1e9;

impl Quantity {
    pub(super) const JOINTS: [Self; 3] = [Self::Joint1, Self::Joint2, Self::Joint3];
    pub(super) const COORDINATES: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Its column's names, the usual one first.
    fn names(self) -> impl Iterator<Item = &'static str> {
        COLUMNS
            .into_iter()
            .filter(move |(_, quantity, _)| *quantity == self)
            .map(|(name, ..)| name)
    }
}

impl Unit {
    fn to_internal(self, value: f64) -> f64 {
        match self {
            Self::Degree => value.to_radians(),
            Self::Metre => value * 1000.0,
            Self::Radian | Self::Millimetre => value,
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Column {
    name: &'static str,
    quantity: Quantity,
    unit: Unit,
}

/// A header that was understood, and rows of as many fields.
pub(super) struct Table<'a> {
    input: &'a InputText,
    header_line: u64,
    /// `None` for a column that is ignored.
    columns: Vec<Option<Column>>,
    records: Vec<(u64, StringRecord)>,
}

/// One row of a table.
pub(super) struct TableRow<'a> {
    table: &'a Table<'a>,
    line: u64,
    record: &'a StringRecord,
}

impl<'a> Table<'a> {
    pub(super) fn parse(input: &'a InputText) -> Result<Self, InputError> {
        let mut records = records(input)?.into_iter();
        let Some((header_line, header)) = records.next() else {
            return Err(
                InputError::new(input.name(), "the file is empty: it has no header")
                    .at_line(1)
                    .with_remedy(KNOWN),
            );
        };
        check_separator(input, header_line, &header)?;
        let columns = columns(input, header_line, &header)?;
        let records: Vec<_> = records.collect();
        if records.is_empty() {
            let cause = "the file has a header and no rows";
            return Err(InputError::new(input.name(), cause)
                .at_line(header_line)
                .with_remedy("add one row for each measured pose below the header"));
        }
        let names: Vec<_> = header.iter().collect();
        for (line, record) in &records {
            if record.len() < names.len() {
                check_separator(input, *line, record)?;
            }
            check_length(input, *line, record, &names)?;
        }
        Ok(Self {
            input,
            header_line,
            columns,
            records,
        })
    }

    /// Every one of these quantities must have a column.
    pub(super) fn require(&self, quantities: &[Quantity]) -> Result<(), InputError> {
        for quantity in quantities {
            if self.column(*quantity).is_none() {
                let names: Vec<_> = quantity.names().collect();
                return Err(InputError::new(self.input.name(), "the column is missing")
                    .at_line(self.header_line)
                    .at_column(names.join(" (or ") + ")")
                    .with_remedy(KNOWN));
            }
        }
        Ok(())
    }

    fn column(&self, quantity: Quantity) -> Option<(usize, Column)> {
        self.columns
            .iter()
            .enumerate()
            .filter_map(|(index, column)| Some((index, (*column)?)))
            .find(|(_, column)| column.quantity == quantity)
    }

    /// Whether all of these are in degrees or millimetres.
    pub(super) fn in_usual_units(&self, quantities: &[Quantity]) -> bool {
        quantities.iter().all(|quantity| {
            self.column(*quantity)
                .is_some_and(|(_, column)| matches!(column.unit, Unit::Degree | Unit::Millimetre))
        })
    }

    pub(super) fn rows<T>(
        &self,
        read: impl Fn(&TableRow<'_>) -> Result<T, InputError>,
    ) -> Result<Vec<Row<T>>, InputError> {
        let mut rows = Vec::with_capacity(self.records.len());
        for (line, record) in &self.records {
            let row = TableRow {
                table: self,
                line: *line,
                record,
            };
            rows.push(Row {
                line: *line,
                value: read(&row)?,
            });
        }
        Ok(rows)
    }
}

impl TableRow<'_> {
    /// In radians and millimetres.
    pub(super) fn numbers(&self, quantities: [Quantity; 3]) -> Result<[f64; 3], InputError> {
        let mut numbers = [0.0; 3];
        for (number, quantity) in numbers.iter_mut().zip(quantities) {
            *number = self.number(quantity)?.1;
        }
        Ok(numbers)
    }

    /// Joint angles in radians, within the limits or nearly so.
    pub(super) fn joints(&self, limits: &JointLimits<f64>) -> Result<[f64; 3], InputError> {
        let mut joints = [0.0; 3];
        for (joint, quantity) in joints.iter_mut().zip(Quantity::JOINTS) {
            let (column, angle) = self.number(quantity)?;
            if let Some(cause) = outside_limits(angle, limits) {
                return Err(self.fault(column.name, cause).with_remedy(
                    "check the angle, its sign, its unit (_deg or _rad in the header) and [joints] \
                     in the robot file",
                ));
            }
            *joint = angle;
        }
        Ok(joints)
    }

    fn number(&self, quantity: Quantity) -> Result<(Column, f64), InputError> {
        let found = self.table.column(quantity);
        let Some((column, field)) =
            found.and_then(|(index, column)| Some((column, self.record.get(index)?)))
        else {
            return Err(self.fault("?", "the column is missing"));
        };
        let value: f64 = field.parse().map_err(|_| {
            let cause = if field.is_empty() {
                "the field is empty".to_owned()
            } else {
                format!("\"{field}\" is not a number")
            };
            self.fault(column.name, cause)
                .with_remedy("write numbers like -12.5 or 3e-2, with a decimal point")
        })?;
        let value = column.unit.to_internal(value);
        if !value.is_finite() {
            return Err(self
                .fault(column.name, format!("\"{field}\" is not a finite number"))
                .with_remedy("leave out a row that was not measured, or measure it again"));
        }
        if value.abs() > LARGEST {
            return Err(self
                .fault(column.name, format!("\"{field}\" is too large"))
                .with_remedy("check the number and the unit in the header (_mm or _m)"));
        }
        Ok((column, value))
    }

    fn fault(&self, column: &str, cause: impl Into<String>) -> InputError {
        InputError::new(self.table.input.name(), cause)
            .at_line(self.line)
            .at_column(column)
    }
}

fn columns(
    input: &InputText,
    line: u64,
    header: &StringRecord,
) -> Result<Vec<Option<Column>>, InputError> {
    let mut columns: Vec<Option<Column>> = Vec::with_capacity(header.len());
    for (index, field) in header.iter().enumerate() {
        if field.starts_with(IGNORED) {
            columns.push(None);
            continue;
        }
        let fault = |cause: &str| InputError::new(input.name(), cause).at_line(line);
        if field.is_empty() {
            let hint = if index + 1 == header.len() {
                " (a trailing comma?)"
            } else {
                ""
            };
            let cause = format!("column {} has no name{hint}", index + 1);
            return Err(fault(&cause).with_remedy(KNOWN));
        }
        let Some((name, quantity, unit)) = COLUMNS.into_iter().find(|(name, ..)| *name == field)
        else {
            let (cause, remedy) = if field.parse::<f64>().is_ok() {
                let cause = "the first line must name the columns, but this is a number";
                (cause, KNOWN.to_owned())
            } else {
                let remedy = meant(field).map_or(KNOWN.to_owned(), |name| {
                    format!("did you mean {name}? Otherwise, {KNOWN}")
                });
                ("unknown column", remedy)
            };
            return Err(fault(cause).at_column(field).with_remedy(remedy));
        };
        if let Some(other) = columns.iter().flatten().find(|c| c.quantity == quantity) {
            let cause = format!("the column repeats column {} before it", other.name);
            return Err(fault(&cause).at_column(field).with_remedy(KNOWN));
        }
        columns.push(Some(Column {
            name,
            quantity,
            unit,
        }));
    }
    Ok(columns)
}

/// The known column that this name is but for case, spaces, underscores and brackets.
fn meant(name: &str) -> Option<&'static str> {
    let letters = |text: &str| -> String {
        let letters = text.chars().filter(char::is_ascii_alphanumeric);
        letters.map(|c| c.to_ascii_lowercase()).collect()
    };
    let wanted = letters(name);
    let mut names = COLUMNS.into_iter().map(|(known, ..)| known);
    names.find(|known| letters(known) == wanted)
}
