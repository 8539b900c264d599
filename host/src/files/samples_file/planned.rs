//! Rows of a plan in which nothing was measured yet.

use super::table::{Table, TableRow};
use super::{Named, NamedFrom, ONLY_PLANE, Readings, Row, named};
use crate::files::columns::Quantity;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::files::robot_file::RobotFile;

/// A samples file of which some rows, or all, may still be unmeasured.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Every row. What an unmeasured one reads does not matter: its heights are 0, its coordinates the robot's
    /// own, its distances 1 mm.
    pub readings: Readings,
    /// The lines in which nothing was measured.
    pub unmeasured: Vec<u64>,
}

impl Planned {
    /// Reads the samples file of a robot.
    ///
    /// # Errors
    /// As [`Readings::read`]; an unmeasured row is none.
    pub fn read(input: &InputText, robot: &RobotFile) -> Result<Self, InputError> {
        let table = Table::parse(input)?;
        table.require(&Quantity::joints(robot.limits.drive()))?;
        table.require_units()?;
        let mut unmeasured = Vec::new();
        let mut rows = Vec::new();
        for row in table.rows(|row| {
            let measured = has_reading(row);
            let value = if measured {
                named(row, &robot.limits)?
            } else {
                to_measure(&table, row, robot)?
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
            readings: Readings::with_indices(input, rows),
            unmeasured,
        })
    }

    /// Whether nothing was measured yet.
    pub fn is_unmeasured(&self) -> bool {
        self.unmeasured.len() == self.readings.rows.len()
    }
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
