//! A table of named columns with units.

use super::Row;
use super::header::{Column, Header, KNOWN};
use super::number::Numbers;
use super::records::Records;
use crate::files::columns::{Quantity, Unit};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::geometry::joint_limits::outside_limits;
use csv::StringRecord;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;

/// A table whose header was understood.
pub(super) struct Table<'a> {
    input: &'a InputText,
    header: Header,
    records: Records<'a>,
}

/// One row of a table.
pub(super) struct TableRow<'a> {
    table: &'a Table<'a>,
    numbers: &'a Numbers,
    line: u64,
    record: &'a StringRecord,
}

impl<'a> Table<'a> {
    pub(super) fn parse(input: &'a InputText) -> Result<Self, InputError> {
        let Some(records) = Records::new(input) else {
            return Err(
                InputError::new(input.name(), "the file is empty: it has no header")
                    .at_line(1)
                    .with_remedy(KNOWN),
            );
        };
        let header = Header::new(&records)?;
        Ok(Self {
            input,
            header,
            records,
        })
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
        ];
        let there = lengths
            .into_iter()
            .filter(|quantity| self.has_any(&[*quantity]));
        self.require(&there.collect::<Vec<_>>())
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
            None => quantity.column(quantity.usual_unit()),
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
    pub(super) fn rows<T, E: From<InputError>>(
        &self,
        read: impl Fn(&TableRow<'_>) -> Result<T, E>,
    ) -> Result<Vec<Row<T>>, E> {
        let mut rows = Vec::new();
        self.each(read, |row| {
            rows.push(row);
            Ok(())
        })?;
        Ok(rows)
    }

    /// The same, one after the other.
    pub(super) fn each<T, E: From<InputError>>(
        &self,
        read: impl Fn(&TableRow<'_>) -> Result<T, E>,
        mut take: impl FnMut(Row<T>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut empty = true;
        let numbers = Numbers::default();
        self.records.each(|line, record| {
            self.header.check_length(&self.records, line, record)?;
            let row = TableRow {
                table: self,
                numbers: &numbers,
                line,
                record,
            };
            empty = false;
            take(Row {
                line,
                value: read(&row)?,
            })
        })?;
        if empty {
            let cause = "the file has a header and no rows";
            return Err(InputError::new(self.input.name(), cause)
                .at_line(self.records.header_line)
                .with_remedy("add one row for each measured pose below the header")
                .into());
        }
        if let Some((line, column, cause)) = numbers.doubtful_comma(self.records.separator()) {
            return Err(InputError::new(self.input.name(), cause)
                .at_line(line)
                .at_column(self.header.name(column))
                .with_remedy(
                    "write all numbers with a decimal point and without a separator of thousands",
                )
                .into());
        }
        if !numbers.must_be_degrees() {
            self.header.check_angles()?;
        }
        Ok(())
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
    pub(super) fn joints(&self, limits: &JointLimits<f64>) -> Result<[f64; 3], InputError> {
        self.joints_in(Quantity::joints(limits.drive()), limits)
    }

    /// The same of other columns.
    pub(super) fn joints_in(
        &self,
        quantities: [Quantity; 3],
        limits: &JointLimits<f64>,
    ) -> Result<[f64; 3], InputError> {
        let mut joints = [0.0; 3];
        for (joint, quantity) in joints.iter_mut().zip(quantities) {
            let angle = self.number(quantity)?;
            if let Some(cause) = outside_limits(angle, limits) {
                return Err(self.fault_of(quantity, cause).with_remedy(match limits.drive() {
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
        column.unit.checked(field, value)
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
