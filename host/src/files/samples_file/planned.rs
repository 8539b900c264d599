//! Rows of a plan in which nothing was measured yet.

use super::observations::{
    Named, NamedFrom, ONLY_PLANE, ObservationsFile, has_positions_alone, named, with_indices,
};
use super::row::Row;
use super::table::{Table, TableRow};
use super::{SamplesFile, Stop, position_of};
use crate::files::columns::Quantity;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;
use delta_cal::{Robot, Sample};

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
    table.require(&Quantity::joints(robot.limits.drive()))?;
    let rows = table.rows(|row| Ok::<_, InputError>(has_reading(row)))?;
    if rows.iter().all(|row| !row.value) {
        return Ok(true);
    }
    let poses = PosesToCheck::of_table(&table, input, robot)?;
    Ok(poses.unmeasured.len() == poses.samples.rows.len())
}

fn has_reading(row: &TableRow<'_>) -> bool {
    let readings = [
        Quantity::X,
        Quantity::Y,
        Quantity::Z,
        Quantity::Height,
        Quantity::Distance,
    ];
    readings.iter().any(|own| row.text(*own).is_some())
}

/// A samples file of which some rows, or all, may still be unmeasured.
#[derive(Debug, Clone, PartialEq)]
pub enum MeasurementsToCheck {
    /// x, y and z, and nothing else.
    Positions(PosesToCheck),
    /// Any mixture.
    Observations(ObservationsToCheck),
}

impl MeasurementsToCheck {
    /// Reads the samples file of a robot. If its transmissions are to be found, positions are observations as well.
    ///
    /// # Errors
    /// As [`Measurements::read`](super::Measurements::read); an unmeasured row is none.
    pub fn read(input: &InputText, robot: &RobotFile) -> Result<Self, InputError> {
        let table = Table::parse(input)?;
        if has_positions_alone(&table) {
            match PosesToCheck::of_table(&table, input, robot) {
                Ok(poses) if robot.transmission.is_some() => {
                    return Ok(Self::Observations(ObservationsToCheck {
                        file: poses.samples.into(),
                        unmeasured: poses.unmeasured,
                    }));
                }
                Ok(poses) => return Ok(Self::Positions(poses)),
                Err(Stop::Fault(fault)) => return Err(fault),
                Err(Stop::Gap(_)) => {}
            }
        }
        ObservationsToCheck::of_table(&table, input, robot).map(Self::Observations)
    }
}

/// Heights, distances and single coordinates, whether or not they were measured yet.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationsToCheck {
    /// Every row. What an unmeasured one reads does not matter: its heights are 0, its coordinates the robot's
    /// own, its distances 1 mm.
    pub file: ObservationsFile,
    /// The lines in which nothing was measured.
    pub unmeasured: Vec<u64>,
}

impl ObservationsToCheck {
    fn of_table(
        table: &Table<'_>,
        input: &InputText,
        robot: &RobotFile,
    ) -> Result<Self, InputError> {
        table.require(&Quantity::joints(robot.limits.drive()))?;
        table.require_units()?;
        let mut unmeasured = Vec::new();
        let mut rows = Vec::new();
        for row in table.rows(|row| {
            let measured = has_reading(row);
            let value = if measured {
                named(row, &robot.limits)?
            } else {
                to_measure(table, row, robot)?
            };
            Ok::<_, InputError>((measured, value))
        })? {
            let (measured, value) = row.value;
            if !measured {
                unmeasured.push(row.line);
            }
            rows.push(Row {
                line: row.line,
                value,
            });
        }
        Ok(Self {
            file: with_indices(input, rows),
            unmeasured,
        })
    }
}

/// What is to be measured in a row that has no reading: a distance if it says where one begins, a height if it
/// names a plane, otherwise what the header has columns for.
fn to_measure(
    table: &Table<'_>,
    row: &TableRow<'_>,
    robot: &RobotFile,
) -> Result<Named, InputError> {
    let mut own = Named {
        joints: row.joints(&robot.limits)?,
        position: [None; 3],
        height: None,
        distance: None,
    };
    let to_joints = Quantity::to_joints(robot.limits.drive());
    let height = |plane: &str| Some((plane.to_owned(), 0.0));
    if let Some(point) = row.text(Quantity::Point) {
        own.distance = Some((NamedFrom::Point(point.to_owned()), 1.0));
    } else if row.text(to_joints[0]).is_some() {
        let to = row.joints_in(to_joints, &robot.limits)?;
        own.distance = Some((NamedFrom::Pose(to), 1.0));
    } else if let Some(plane) = row.text(Quantity::Plane) {
        own.height = height(plane);
    } else if table.has_any(&Quantity::COORDINATES) {
        let there = robot.robot.forward(&own.joints).unwrap_or_default();
        for (axis, quantity) in Quantity::COORDINATES.into_iter().enumerate() {
            own.position[axis] = table.has_any(&[quantity]).then(|| there[axis]);
        }
    } else if table.has_any(&[Quantity::Height]) {
        own.height = height(ONLY_PLANE);
    } else {
        return Err(row
            .fault_of_row("the row does not say what is to be measured")
            .with_remedy("name a point, a plane or a second pose, or delete the row"));
    }
    Ok(own)
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
    fn of_table(table: &Table<'_>, input: &InputText, robot: &RobotFile) -> Result<Self, Stop> {
        table.require(&Quantity::joints(robot.limits.drive()))?;
        table.require(&Quantity::COORDINATES)?;
        let rows = table.rows(|row| {
            let joints = row.joints(&robot.limits)?;
            let empty = Quantity::COORDINATES.map(|own| row.text(own).is_none());
            if empty == [true; 3] {
                return Ok::<_, Stop>((joints, None));
            }
            Ok((joints, Some(position_of(row)?)))
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
            ..SamplesFile::without_rows(table, input)
        };
        Ok(Self {
            samples,
            unmeasured,
        })
    }
}
