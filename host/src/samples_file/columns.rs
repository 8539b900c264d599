//! A CSV file of named columns with units.

use super::{Row, outside_limits};
use crate::{InputError, InputText};
use csv::{ReaderBuilder, StringRecord, Trim};
use delta_cal::JointLimits;

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
                     order, separated by commas";

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
    columns: Vec<Column>,
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
        let columns = columns(input, header_line, &header)?;
        let records: Vec<_> = records.collect();
        if records.is_empty() {
            let cause = "the file has a header and no rows";
            return Err(InputError::new(input.name(), cause)
                .at_line(header_line)
                .with_remedy("add one row a measured pose below the header"));
        }
        for (line, record) in &records {
            check_length(input, *line, record, &columns)?;
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
            if !self.columns.iter().any(|c| c.quantity == *quantity) {
                let names: Vec<_> = quantity.names().collect();
                return Err(InputError::new(self.input.name(), "the column is missing")
                    .at_line(self.header_line)
                    .at_column(names.join(" (or ") + ")")
                    .with_remedy(KNOWN));
            }
        }
        Ok(())
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
                    "check the angle, its unit (_deg or _rad in the header) and [joints] in the \
                     robot file",
                ));
            }
            *joint = angle;
        }
        Ok(joints)
    }

    fn number(&self, quantity: Quantity) -> Result<(Column, f64), InputError> {
        let found = self.table.columns.iter().zip(self.record);
        let Some((column, field)) = found
            .filter(|(column, _)| column.quantity == quantity)
            .map(|(column, field)| (*column, field))
            .next()
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
        Ok((column, value))
    }

    fn fault(&self, column: &str, cause: impl Into<String>) -> InputError {
        InputError::new(self.table.input.name(), cause)
            .at_line(self.line)
            .at_column(column)
    }
}

/// Every record with its line, without comments and empty lines.
fn records(input: &InputText) -> Result<Vec<(u64, StringRecord)>, InputError> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .comment(Some(b'#'))
        .from_reader(input.text().as_bytes());
    let mut records = Vec::new();
    let mut record = StringRecord::new();
    let mut lines = Lines::new(input.text());
    loop {
        let read = reader.read_record(&mut record).map_err(|error| {
            InputError::new(input.name(), format!("is not CSV: {error}")).with_remedy(KNOWN)
        })?;
        if !read {
            return Ok(records);
        }
        // The reader's own position of a record is that of the comments before it. The record ends
        // where the reader now stands: at the start of the next line or at the end of the text.
        let line = lines.of_byte_before(reader.position().byte());
        let first = record.get(0).unwrap_or_default();
        let empty = record.len() == 1 && first.is_empty();
        if !(empty || first.starts_with('#')) {
            records.push((line, record.clone()));
        }
    }
}

/// Counts lines once through a text.
struct Lines<'a> {
    text: &'a [u8],
    counted: usize,
    line: u64,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            text: text.as_bytes(),
            counted: 0,
            line: 1,
        }
    }

    /// The line of the byte before `end`; `end` must not decrease from call to call.
    fn of_byte_before(&mut self, end: u64) -> u64 {
        let end = usize::try_from(end).unwrap_or(usize::MAX);
        let to = end.saturating_sub(1).min(self.text.len());
        if let Some(bytes) = self.text.get(self.counted..to) {
            let newlines: u64 = bytes.iter().map(|b| u64::from(*b == b'\n')).sum();
            self.line += newlines;
            self.counted = to;
        }
        self.line
    }
}

fn columns(input: &InputText, line: u64, header: &StringRecord) -> Result<Vec<Column>, InputError> {
    let mut columns: Vec<Column> = Vec::with_capacity(header.len());
    for field in header {
        let fault = |cause: String| {
            InputError::new(input.name(), cause)
                .at_line(line)
                .at_column(field)
                .with_remedy(KNOWN)
        };
        let Some((name, quantity, unit)) = COLUMNS.into_iter().find(|(name, ..)| *name == field)
        else {
            let cause = if field.is_empty() {
                "a column has no name"
            } else if field.parse::<f64>().is_ok() {
                "the first line must name the columns, and this is a number"
            } else {
                "unknown column"
            };
            return Err(fault(cause.to_owned()));
        };
        if let Some(other) = columns.iter().find(|column| column.quantity == quantity) {
            return Err(fault(format!(
                "the column says the same as column {} before it",
                other.name
            )));
        }
        columns.push(Column {
            name,
            quantity,
            unit,
        });
    }
    Ok(columns)
}

fn check_length(
    input: &InputText,
    line: u64,
    record: &StringRecord,
    columns: &[Column],
) -> Result<(), InputError> {
    let (found, expected) = (record.len(), columns.len());
    if found == expected {
        return Ok(());
    }
    let fault = InputError::new(
        input.name(),
        format!("the row has {found} fields and the header {expected}"),
    )
    .at_line(line);
    let (column, remedy) = if found < expected {
        (
            columns.get(found),
            "this is the first column that is missing",
        )
    } else {
        (
            columns.last(),
            "the row goes on after this column; decimal commas do that, too",
        )
    };
    Err(match column {
        Some(column) => fault.at_column(column.name).with_remedy(remedy),
        None => fault,
    })
}
