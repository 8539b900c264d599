//! The samples file: joint angles and measured positions, one row a pose.

mod columns;

use crate::units::degrees;
use crate::{InputError, InputText};
use columns::{Quantity, Table};
use delta_cal::{JointLimits, Sample};
use nalgebra::Vector3;

/// A joint angle may be this many degrees outside the limits: encoder zeros differ.
const LIMIT_MARGIN: f64 = 1.0;

/// Whether a joint angle is further outside the limits than that, and how to say so.
pub(crate) fn outside_limits(angle: f64, limits: &JointLimits<f64>) -> Option<String> {
    let margin = LIMIT_MARGIN.to_radians();
    (angle < limits.minimum() - margin || angle > limits.maximum() + margin).then(|| {
        format!(
            "{:.3}° is more than {LIMIT_MARGIN}° outside the joint limits of {}° to {}°",
            degrees(angle),
            degrees(limits.minimum()),
            degrees(limits.maximum()),
        )
    })
}

/// One row of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<T> {
    /// Its line in the file, counted from 1.
    pub line: u64,
    /// What it holds.
    pub value: T,
}

/// What a samples file says: at least one sample.
///
/// The columns are `q1_deg, q2_deg, q3_deg, x_mm, y_mm, z_mm`, or `_rad` and `_m`, in any order.
/// Lines that begin with `#` are comments.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplesFile {
    /// The file's name, for messages.
    pub name: String,
    /// Joint angles in radians and positions in millimetres.
    pub rows: Vec<Row<Sample<f64>>>,
}

impl SamplesFile {
    /// Reads a samples file of a robot with these joint limits.
    ///
    /// # Errors
    /// The first fault: a missing, unknown or doubled column, a short or long row, a number that
    /// does not parse or is not finite, a joint angle more than 1° outside the limits, no rows.
    pub fn read(input: &InputText, limits: &JointLimits<f64>) -> Result<Self, InputError> {
        let table = Table::parse(input)?;
        table.require(&Quantity::JOINTS)?;
        table.require(&Quantity::COORDINATES)?;
        let rows = table.rows(|row| {
            Ok(Sample {
                joints: row.joints(limits)?,
                position: Vector3::from(row.numbers(Quantity::COORDINATES)?),
            })
        })?;
        Ok(Self {
            name: input.name().to_owned(),
            rows,
        })
    }

    /// The fault of the sample at `index`, in its line.
    pub(crate) fn fault(&self, index: usize, cause: impl Into<String>) -> InputError {
        let error = InputError::new(&self.name, cause)
            .with_remedy("check the row and the units in the header (_mm or _m, _deg or _rad)");
        match self.rows.get(index) {
            Some(row) => error.at_line(row.line),
            None => error,
        }
    }
}

/// Reads the joint angles (radians) of a file; positions may be there too and are not looked at.
///
/// # Errors
/// As [`SamplesFile::read`].
pub fn read_joints(
    input: &InputText,
    limits: &JointLimits<f64>,
) -> Result<Vec<Row<[f64; 3]>>, InputError> {
    let table = Table::parse(input)?;
    table.require(&Quantity::JOINTS)?;
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
