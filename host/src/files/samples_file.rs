//! The samples file: joint angles and measured positions, one row a pose.

mod header;
mod many_rows;
mod number;
mod observations;
mod planned;
mod records;
mod row;
mod table;

pub use many_rows::{MOST_IN_MEMORY, ManyRows};
pub use observations::{Measurements, ObservationsFile, Reading, ReadingFrom};
pub(crate) use planned::is_planned;
pub use planned::{MeasurementsToCheck, ObservationsToCheck, PosesToCheck, is_unmeasured_plan};
pub use row::Row;

use crate::files::columns::{Quantity, Unit};
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::text::units::degrees;
use delta_cal::Sample;
use delta_cal::kinematics::JointLimits;
use delta_cal::robot::Drive;
use many_rows::{RowCollector, unusable};
use nalgebra::Vector3;
use std::io;
use table::{Table, TableRow};

/// Degrees and millimetres that are all below this look like radians and metres…
const OTHER_UNIT: f64 = 2.0;
/// …if there are so many rows.
const ROWS_TO_TELL_UNITS: usize = 8;

/// What a samples file says: at least one sample.
///
/// The columns are `q1_deg, q2_deg, q3_deg, x_mm, y_mm, z_mm`, with linear drives `s1_mm, s2_mm, s3_mm` first, or in other units, in any order, separated by
/// commas, semicolons, tabs or spaces. Columns whose name begins with `_` are ignored. Lines that begin
/// with `#` are comments.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplesFile {
    /// The file's name, for messages.
    pub name: String,
    /// Joint angles in radians, or travels in millimetres, and positions in millimetres. If `all` holds the rows of
    /// a file with many, these are some of them, chosen evenly over the file.
    pub rows: Vec<Row<Sample<f64>>>,
    /// All rows, if they are too many for the memory.
    pub all: Option<ManyRows>,
    /// Whether the header states the joint angles in degrees, all three.
    pub in_degrees: bool,
    /// In which unit the header states the positions, all three coordinates.
    pub positions_in: PositionUnit,
}

/// In which unit positions are stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionUnit {
    /// Millimetres.
    Millimetre,
    /// Metres.
    Metre,
    /// Centimetres, inches, micrometres, or not all three the same.
    Other,
}

/// Why a table of positions was not read.
enum Stop {
    Fault(InputError),
    /// A cell of x, y or z is empty.
    Gap(InputError),
}

impl From<InputError> for Stop {
    fn from(fault: InputError) -> Self {
        Self::Fault(fault)
    }
}

impl From<Stop> for InputError {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::Fault(fault) | Stop::Gap(fault) => fault,
        }
    }
}

impl SamplesFile {
    /// Reads a samples file of a robot with these joint limits.
    ///
    /// # Errors
    /// The first fault: a missing, unknown or doubled column, a short or long row, a number that
    /// does not parse or is not finite, a joint angle more than 1° outside the limits, no rows.
    pub fn read(input: &InputText, limits: &JointLimits<f64>) -> Result<Self, InputError> {
        let table = Table::parse(input)?;
        Ok(Self::of_table(&table, input, limits.drive(), Some(limits))?)
    }

    /// As [`read`](Self::read) of a robot with these drives, whatever the joint angles.
    pub(crate) fn read_any(input: &InputText, drive: Drive) -> Result<Self, InputError> {
        Ok(Self::of_table(&Table::parse(input)?, input, drive, None)?)
    }

    fn of_table(
        table: &Table<'_>,
        input: &InputText,
        drive: Drive,
        limits: Option<&JointLimits<f64>>,
    ) -> Result<Self, Stop> {
        table.require(&Quantity::joints(drive))?;
        table.require(&Quantity::COORDINATES)?;
        let read = |row: &TableRow<'_>| {
            let joints = match limits {
                Some(limits) => row.joints(limits)?,
                None => row.numbers(Quantity::joints(drive))?,
            };
            let position = position_of(row)?;
            Ok::<_, Stop>(Sample { joints, position })
        };
        let (rows, all) = if input.has_many_rows() {
            let unusable = |error: io::Error| unusable(input.name(), "written", &error);
            let mut collector = RowCollector::new();
            table.each(read, |row| Ok(collector.push(row).map_err(unusable)?))?;
            collector.finish().map_err(unusable)?
        } else {
            (table.rows(read)?, None)
        };
        Ok(Self {
            rows,
            all,
            ..Self::without_rows(table, input)
        })
    }

    fn without_rows(table: &Table<'_>, input: &InputText) -> Self {
        Self {
            name: input.name().to_owned(),
            rows: Vec::new(),
            all: None,
            in_degrees: table.unit_of(&Quantity::joints(Drive::Rotary)) == Some(Unit::Degree),
            positions_in: match table.unit_of(&Quantity::COORDINATES) {
                Some(Unit::Millimetre) => PositionUnit::Millimetre,
                Some(Unit::Metre) => PositionUnit::Metre,
                _ => PositionUnit::Other,
            },
        }
    }

    /// Whether the numbers look like another unit than the header states, in words.
    pub(crate) fn unit_hint(&self) -> Option<String> {
        if self.rows.len() < ROWS_TO_TELL_UNITS {
            return None;
        }
        let angles = self.rows.iter().flat_map(|row| row.value.joints);
        let radians = self.in_degrees && angles.map(degrees).all(|q| q.abs() < OTHER_UNIT);
        let positions = self
            .rows
            .iter()
            .flat_map(|row| row.value.position.data.0[0]);
        let in_millimetres = self.positions_in == PositionUnit::Millimetre;
        let metres = in_millimetres && positions.into_iter().all(|x| x.abs() < OTHER_UNIT);
        let angles = "the joint angles are all below 2° and look like radians: then name their \
                      columns q1_rad,q2_rad,q3_rad";
        let positions = "the positions are all below 2 mm and look like metres: then name their \
                         columns x_m,y_m,z_m";
        match (radians, metres) {
            (true, true) => Some(format!("{angles}; {positions}")),
            (true, false) => Some(angles.to_owned()),
            (false, true) => Some(positions.to_owned()),
            (false, false) => None,
        }
    }

    /// How many rows the file has.
    pub fn count(&self) -> usize {
        self.all.as_ref().map_or(self.rows.len(), ManyRows::count)
    }

    /// The line of the row at `index`.
    pub(crate) fn line(&self, index: usize) -> Option<u64> {
        match &self.all {
            Some(all) => all.line(index),
            None => self.rows.get(index).map(|row| row.line),
        }
    }

    /// Every row, some at a time, with the index of the first of them.
    ///
    /// # Errors
    /// The first error of `take`.
    pub(crate) fn each_part<E>(
        &self,
        mut take: impl FnMut(usize, &[Row<Sample<f64>>]) -> Result<(), E>,
    ) -> Result<(), E> {
        match &self.all {
            Some(all) => all.each_part(take),
            None => take(0, &self.rows),
        }
    }

    /// With every position moved.
    #[must_use]
    pub(crate) fn moved(mut self, by: &Vector3<f64>) -> Self {
        for row in &mut self.rows {
            row.value.position += by;
        }
        self.all = self.all.map(|all| all.moved(by));
        self
    }

    /// The fault of the sample at `index`, in its line.
    pub fn fault(&self, index: usize, cause: impl Into<String>) -> InputError {
        let error = InputError::new(&self.name, cause)
            .with_remedy("check the row and the units in the header (_mm or _m, _deg or _rad)");
        match self.line(index) {
            Some(line) => error.at_line(line),
            None => error,
        }
    }
}

fn position_of(row: &TableRow<'_>) -> Result<Vector3<f64>, Stop> {
    let position = row.numbers(Quantity::COORDINATES).map_err(|fault| {
        if row.has_gap(Quantity::COORDINATES) {
            Stop::Gap(fault)
        } else {
            Stop::Fault(fault)
        }
    })?;
    Ok(Vector3::from(position))
}

/// Reads the joint angles (radians) of a file; positions may be there too and are ignored.
///
/// # Errors
/// As [`SamplesFile::read`].
pub fn read_joints(
    input: &InputText,
    limits: &JointLimits<f64>,
) -> Result<Vec<Row<[f64; 3]>>, InputError> {
    let table = Table::parse(input)?;
    table.require(&Quantity::joints(limits.drive()))?;
    table.rows(|row| row.joints(limits))
}

/// Reads the positions (millimetres) of a file; joint angles may be there too and are not looked
/// at.
///
/// # Errors
/// As [`SamplesFile::read`].
pub fn read_positions(input: &InputText) -> Result<Vec<Row<Vector3<f64>>>, InputError> {
    let table = Table::parse(input)?;
    table.require(&Quantity::COORDINATES)?;
    table.rows(|row| row.numbers(Quantity::COORDINATES).map(Vector3::from))
}
