//! A table of named columns with units, and its numbers, with decimal points or decimal commas.

use super::Row;
use super::header::{Column, Header, KNOWN};
use super::records::Records;
use crate::files::columns::{Quantity, Unit};
use crate::files::convention::Convention;
use crate::files::input::{InputError, InputText};
use crate::files::robot_file::RobotFile;
use crate::text::decimal_comma;
use csv::StringRecord;
use delta_cal::robot::Drive;
use std::cell::{Cell, RefCell};
use std::f64::consts::TAU;

/// A table whose header was understood.
pub(super) struct Table<'a> {
    input: &'a InputText,
    header: Header,
    records: Records<'a>,
    convention: &'a Convention,
}

/// One row of a table.
pub(super) struct TableRow<'a> {
    table: &'a Table<'a>,
    numbers: &'a Numbers,
    line: u64,
    record: &'a StringRecord,
}

impl<'a> Table<'a> {
    pub(super) fn parse(
        input: &'a InputText,
        convention: &'a Convention,
    ) -> Result<Self, InputError> {
        Self::with(input, convention, false)
    }

    /// The same of a file of which other columns belong to another file.
    pub(super) fn lenient(
        input: &'a InputText,
        convention: &'a Convention,
    ) -> Result<Self, InputError> {
        Self::with(input, convention, true)
    }

    fn with(
        input: &'a InputText,
        convention: &'a Convention,
        lenient: bool,
    ) -> Result<Self, InputError> {
        let Some(records) = Records::new(input) else {
            return Err(
                InputError::new(input.name(), "the file is empty: it has no header")
                    .at_line(1)
                    .with_remedy(KNOWN),
            );
        };
        let header = Header::new(&records, convention, lenient)?;
        Ok(Self {
            input,
            header,
            records,
            convention,
        })
    }

    /// Whether the header has this name.
    pub(super) fn has_name(&self, name: &str) -> bool {
        self.header.names().iter().any(|own| own == name)
    }

    /// The names of the columns that are not read.
    pub(super) fn unread(&self) -> Vec<String> {
        self.header.unread()
    }

    /// The cells of a column, row by row.
    pub(super) fn cells(&self, name: &str) -> Result<Vec<String>, InputError> {
        let place = self.header.names().iter().position(|own| own == name);
        let mut cells = Vec::new();
        self.records.each(|_, record| {
            let cell = place.and_then(|place| record.get(place));
            cells.push(cell.unwrap_or_default().trim().to_owned());
            Ok(())
        })?;
        Ok(cells)
    }

    /// Every one of these quantities must have a column, and lengths a unit.
    pub(super) fn require(&self, quantities: &[Quantity]) -> Result<(), InputError> {
        self.header.require(quantities)
    }

    /// Every length must have a unit.
    pub(super) fn require_units(&self) -> Result<(), InputError> {
        let lengths = [
            Quantity::X,
            Quantity::Y,
            Quantity::Z,
            Quantity::Height,
            Quantity::Distance,
            Quantity::Sigma,
            Quantity::Expanded,
        ];
        let there = lengths
            .into_iter()
            .filter(|quantity| self.has_any(&[*quantity]));
        self.require(&there.collect::<Vec<_>>())
    }

    /// Whether something that can be measured has a column.
    pub(super) fn has_readings(&self) -> bool {
        let [x, y, z] = Quantity::COORDINATES;
        self.has_any(&[x, y, z, Quantity::Height, Quantity::Distance])
    }

    /// Whether one of these has a column.
    pub(super) fn has_any(&self, quantities: &[Quantity]) -> bool {
        let mut quantities = quantities.iter();
        quantities.any(|quantity| self.header.column(*quantity).is_some())
    }

    /// The name of the column that a quantity has or should have.
    pub(super) fn name_of(&self, quantity: Quantity) -> String {
        match self.header.column(quantity) {
            Some(column) => self.header.name(column.place).to_owned(),
            None => self.convention.column(quantity),
        }
    }

    /// The unit that all of these have.
    pub(super) fn unit_of(&self, quantities: &[Quantity]) -> Option<Unit> {
        let unit = |quantity: &Quantity| Some(self.header.column(*quantity)?.unit);
        let first = unit(quantities.first()?)?;
        let same = quantities
            .iter()
            .all(|quantity| unit(quantity) == Some(first));
        same.then_some(first)
    }

    /// Every row; there must be one.
    pub(super) fn rows<T>(
        &self,
        read: impl Fn(&TableRow<'_>) -> Result<T, InputError>,
    ) -> Result<Vec<Row<T>>, InputError> {
        let mut rows = Vec::new();
        let numbers = Numbers::default();
        self.records.each(|line, record| {
            self.header.check_length(&self.records, line, record)?;
            let value = read(&TableRow {
                table: self,
                numbers: &numbers,
                line,
                record,
            })?;
            rows.push(Row { line, value });
            Ok(())
        })?;
        if rows.is_empty() {
            let cause = "the file has a header and no rows";
            return Err(InputError::new(self.input.name(), cause)
                .at_line(self.records.header_line)
                .with_remedy("add one row for each measured pose below the header"));
        }
        if let Some((line, column, cause)) = numbers.doubtful_comma(self.records.separator()) {
            return Err(InputError::new(self.input.name(), cause)
                .at_line(line)
                .at_column(self.header.name(column))
                .with_remedy(
                    "write all numbers with a decimal point and without a separator of thousands",
                ));
        }
        if !numbers.must_be_degrees() {
            self.header.check_angles()?;
        }
        Ok(rows)
    }
}

impl TableRow<'_> {
    /// In radians and millimetres.
    pub(super) fn numbers(&self, quantities: [Quantity; 3]) -> Result<[f64; 3], InputError> {
        let mut numbers = [0.0; 3];
        for (number, quantity) in numbers.iter_mut().zip(quantities) {
            *number = self.number(quantity)?;
        }
        Ok(numbers)
    }

    /// In radians and millimetres; `None` where there is no such column or the cell is empty.
    pub(super) fn optional(&self, quantity: Quantity) -> Result<Option<f64>, InputError> {
        if self.text(quantity).is_none() {
            return Ok(None);
        }
        self.number(quantity).map(Some)
    }

    /// What a cell holds, if it holds anything.
    pub(super) fn text(&self, quantity: Quantity) -> Option<&str> {
        let column = self.table.header.column(quantity)?;
        let field = self.record.get(column.place)?.trim();
        (!field.is_empty()).then_some(field)
    }

    /// Joint angles in radians or travels in mm, within the limits or nearly so.
    pub(super) fn joints(&self, robot: &RobotFile) -> Result<[f64; 3], InputError> {
        self.joints_in(Quantity::joints(robot.limits.drive()), robot)
    }

    /// The same of other columns.
    pub(super) fn joints_in(
        &self,
        quantities: [Quantity; 3],
        robot: &RobotFile,
    ) -> Result<[f64; 3], InputError> {
        let mut joints = [0.0; 3];
        for (joint, quantity) in joints.iter_mut().zip(quantities) {
            let angle = self.number(quantity)?;
            if let Some(cause) = robot.outside_limits(angle) {
                return Err(self.fault_of(quantity, cause).with_remedy(match robot.limits.drive() {
                    Drive::Rotary => {
                        "check the angle, its sign, its unit (_deg or _rad in the header) and [joints] \
                         in the robot file"
                    }
                    Drive::Linear => {
                        "check the travel, its unit (_mm or _m in the header) and [joints] in the \
                         robot file"
                    }
                }));
            }
            *joint = angle;
        }
        Ok(joints)
    }

    fn number(&self, quantity: Quantity) -> Result<f64, InputError> {
        let Some(column) = self.table.header.column(quantity) else {
            return Err(self.fault_of(quantity, "the column is missing"));
        };
        let field = self.record.get(column.place);
        let field = field.unwrap_or_default().trim_ascii();
        self.in_column(column, field)
            .map_err(|(cause, remedy)| self.fault_of(quantity, cause).with_remedy(remedy))
    }

    fn in_column(&self, column: &Column, field: &str) -> Result<f64, (String, &'static str)> {
        let value = self.numbers.read(self.line, column.place, field)?;
        if column.quantity.is_angle() && !column.stated {
            self.numbers.angle_without_unit(value);
        }
        let Some(value) = self
            .table
            .convention
            .inwards(column.quantity, column.unit, value)
        else {
            return Err((
                "the joint is in counts, and the robot file does not say how many a degree has"
                    .to_owned(),
                "state counts_per_deg in [convention]",
            ));
        };
        possible(field, value)
    }

    /// A fault of this row, in the column that a quantity has or should have.
    pub(super) fn fault_of(&self, quantity: Quantity, cause: impl Into<String>) -> InputError {
        self.fault_of_row(cause)
            .at_column(self.table.name_of(quantity))
    }

    /// A fault of this row as a whole.
    pub(super) fn fault_of_row(&self, cause: impl Into<String>) -> InputError {
        InputError::new(self.table.input.name(), cause).at_line(self.line)
    }
}

/// Larger numbers, in mm or rad, have the wrong unit or a wrong exponent.
const LARGEST: f64 = 1e9;

/// What the numbers of a table have in common, as far as it was read.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    /// The line of the first decimal point, or 0.
    point: Cell<u64>,
    /// The first decimal comma: line, column, field.
    comma: RefCell<Option<(u64, usize, String)>>,
    /// Whether some comma does not separate thousands.
    no_thousands: Cell<bool>,
    /// The largest angle without a stated unit.
    angle: Cell<f64>,
}

/// Cause and remedy.
type Fault = (String, &'static str);

impl Numbers {
    pub(super) fn read(&self, line: u64, column: usize, field: &str) -> Result<f64, Fault> {
        if let Ok(number) = field.parse() {
            if self.point.get() == 0 && field.contains('.') {
                self.point.set(line);
                self.check_marks(field)?;
            }
            return Ok(number);
        }
        if let Some(number) = decimal_comma(field) {
            if self.comma.borrow().is_none() {
                *self.comma.borrow_mut() = Some((line, column, field.to_owned()));
            }
            self.check_marks(field)?;
            self.no_thousands
                .set(self.no_thousands.get() || !thousands(field));
            return Ok(number);
        }
        let cause = if field.is_empty() {
            "the field is empty".to_owned()
        } else {
            format!("\"{field}\" is not a number")
        };
        Err((
            cause,
            "write numbers like -12.5 or 3e-2, with a decimal point",
        ))
    }

    /// A file has decimal points or decimal commas.
    fn check_marks(&self, field: &str) -> Result<(), Fault> {
        let comma = self.comma.borrow();
        let (Some((with_comma, ..)), with_point @ 1..) = (comma.as_ref(), self.point.get()) else {
            return Ok(());
        };
        let cause = if field.contains('.') {
            format!("\"{field}\" has a decimal point, and line {with_comma} has a decimal comma")
        } else {
            format!("\"{field}\" has a decimal comma, and line {with_point} has a decimal point")
        };
        Err((
            cause,
            "write all numbers with a decimal point and without a separator of thousands",
        ))
    }

    /// A comma that may as well separate thousands: line, column and cause. Programs that separate
    /// fields by semicolons do so because the comma is their decimal mark.
    pub(super) fn doubtful_comma(&self, separator: char) -> Option<(u64, usize, String)> {
        if separator == ';' || self.no_thousands.get() {
            return None;
        }
        let (line, column, field) = self.comma.take()?;
        let (point, none) = (field.replace(',', "."), field.replace(',', ""));
        Some((
            line,
            column,
            format!("\"{field}\" may be {point} or {none}"),
        ))
    }

    pub(super) fn angle_without_unit(&self, value: f64) {
        self.angle.set(self.angle.get().max(value.abs()));
    }

    /// Whether some angle without a stated unit is more than a full turn in radians.
    pub(super) fn must_be_degrees(&self) -> bool {
        self.angle.get() > TAU
    }
}

/// Whether the comma of `-12,345` may separate thousands.
fn thousands(field: &str) -> bool {
    let digits = field.trim_start_matches(['-', '+']);
    let (before, after) = digits.split_once(',').unwrap_or_default();
    before.len() <= 3 && !before.starts_with('0') && after.len() == 3
}

/// A number in radians or millimetres, if it can be one.
fn possible(field: &str, value: f64) -> Result<f64, Fault> {
    if !value.is_finite() {
        return Err((
            format!("\"{field}\" is not a finite number"),
            "leave out a row that was not measured, or measure it again",
        ));
    }
    if value.abs() > LARGEST {
        return Err((
            format!("\"{field}\" is too large"),
            "check the number and the unit in the header (_mm or _m)",
        ));
    }
    Ok(value)
}
