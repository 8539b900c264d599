//! Rows of a plan in which nothing was measured yet.

use super::SamplesFile;
use super::row::Row;
use super::table::Table;
use crate::files::columns::Quantity;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use delta_cal::{Robot, Sample};
use nalgebra::Vector3;

/// Plans state positions to this many to the mm; digits of a nanometre, which nobody measures.
const STEPS: f64 = 1e6;
/// Whoever measures states no more than this many to the mm.
const MEASURED: f64 = 1e4;

/// Whether a position is the nominal robot's, to the last digit that a plan has, and has more digits
/// than a measured one.
pub(crate) fn is_planned(nominal: &Robot<f64>, sample: &Sample<f64>) -> bool {
    let position = sample.position;
    let on_steps = |steps: f64, x: f64| ((x * steps).round() / steps).total_cmp(&x).is_eq();
    let as_written = position.iter().all(|x| on_steps(STEPS, *x + 0.0));
    let measurable = position.iter().all(|x| on_steps(MEASURED, *x + 0.0));
    as_written
        && !measurable
        && nominal
            .forward(&sample.joints)
            .is_ok_and(|x| (x - position).amax() <= 0.51 / STEPS)
}

/// Whether a samples file is a plan in which nothing was measured yet: no row has a coordinate, a height or a
/// distance, or every row has the position of the nominal robot, which older plans state.
///
/// # Errors
/// As [`SamplesFile::read`].
pub fn is_unmeasured_plan(input: &InputText, robot: &RobotFile) -> Result<bool, InputError> {
    let table = Table::parse(input)?;
    table.require(&Quantity::JOINTS)?;
    let readings = [
        Quantity::X,
        Quantity::Y,
        Quantity::Z,
        Quantity::Height,
        Quantity::Distance,
    ];
    let rows = table.rows(|row| {
        let read = readings.iter().any(|own| row.text(*own).is_some());
        Ok::<_, InputError>(read)
    })?;
    if rows.iter().all(|row| !row.value) {
        return Ok(true);
    }
    let poses = PosesToCheck::read(input, robot)?;
    Ok(poses.unmeasured.len() == poses.samples.rows.len())
}

/// The joint angles of a samples file, whether or not something was measured there.
#[derive(Debug, Clone, PartialEq)]
pub struct PosesToCheck {
    /// Every row; those that are unmeasured with the robot's own position.
    pub samples: SamplesFile,
    /// The lines that hold no measured position.
    pub unmeasured: Vec<u64>,
}

impl PosesToCheck {
    /// Reads the samples file of a robot.
    ///
    /// # Errors
    /// As [`SamplesFile::read`]; an unmeasured row is none.
    pub fn read(input: &InputText, robot: &RobotFile) -> Result<Self, InputError> {
        let table = Table::parse(input)?;
        table.require(&Quantity::JOINTS)?;
        table.require(&Quantity::COORDINATES)?;
        let rows = table.rows(|row| {
            let joints = row.joints(&robot.limits)?;
            let empty = Quantity::COORDINATES.map(|own| row.text(own).is_none());
            if empty == [true; 3] {
                return Ok::<_, InputError>((joints, None));
            }
            let position = Vector3::from(row.numbers(Quantity::COORDINATES)?);
            Ok((joints, Some(position)))
        })?;
        let mut unmeasured = Vec::new();
        let rows = rows.into_iter().map(|Row { line, value }| {
            let (joints, measured) = value;
            let planned = || robot.robot.forward(&joints).unwrap_or_default();
            let position = measured.unwrap_or_else(planned);
            let sample = Sample { joints, position };
            if measured.is_none() || is_planned(&robot.robot, &sample) {
                unmeasured.push(line);
            }
            Row {
                line,
                value: sample,
            }
        });
        let samples = SamplesFile {
            rows: rows.collect(),
            ..SamplesFile::without_rows(&table, input)
        };
        Ok(Self {
            samples,
            unmeasured,
        })
    }
}
