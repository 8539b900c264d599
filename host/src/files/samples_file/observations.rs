//! Rows that hold less than a position, or something else: single coordinates, heights, distances.

use super::row::Row;
use super::table::{Table, TableRow};
use super::{SamplesFile, Stop};
use crate::files::columns::Quantity;
use crate::files::input_error::InputError;
use crate::files::input_text::InputText;
use crate::text::words::list;
use delta_cal::kinematics::JointLimits;

/// The name of the plane of a file that names none.
pub(super) const ONLY_PLANE: &str = "plane";

/// What a samples file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurements {
    /// x, y and z in every row, and nothing else.
    Positions(SamplesFile),
    /// Any mixture.
    Observations(ObservationsFile),
}

/// A samples file of heights, distances and coordinates: at least one row, at least one reading in each.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationsFile {
    /// The file's name, for messages.
    pub name: String,
    /// Joint angles in radians, lengths in millimetres.
    pub rows: Vec<Row<Reading>>,
    /// The planes' names, in the order in which they occur.
    pub planes: Vec<String>,
    /// The points' names, likewise.
    pub points: Vec<String>,
}

/// A row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Joint angles, radians.
    pub joints: [f64; 3],
    /// The coordinates that were measured, mm.
    pub position: [Option<f64>; 3],
    /// The index of a plane and the height above it, mm.
    pub height: Option<(usize, f64)>,
    /// From where, and how far, mm.
    pub distance: Option<(ReadingFrom, f64)>,
}

/// Where a distance begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReadingFrom {
    /// At the point of this index.
    Point(usize),
    /// At the platform's position at these joint angles, radians.
    Pose([f64; 3]),
}

impl Measurements {
    /// Reads a samples file of a robot with these joint limits.
    ///
    /// # Errors
    /// As [`SamplesFile::read`]; a row without any reading; a distance that is not above 0, that begins
    /// nowhere, or both at a point and at a pose; a plane or point without a reading.
    pub fn read(input: &InputText, limits: &JointLimits<f64>) -> Result<Self, InputError> {
        let table = Table::parse(input)?;
        if has_positions_alone(&table) {
            match SamplesFile::of_table(&table, input, limits.drive(), Some(limits)) {
                Ok(samples) => return Ok(Self::Positions(samples)),
                Err(Stop::Fault(fault)) => return Err(fault),
                Err(Stop::Gap(_)) => {}
            }
        }
        observations(&table, input, limits).map(Self::Observations)
    }
}

impl Measurements {
    /// x, y and z in every row, for what takes nothing else.
    ///
    /// # Errors
    /// The first row that does not hold just these.
    pub fn positions(self) -> Result<SamplesFile, InputError> {
        match self {
            Self::Positions(samples) => Ok(samples),
            Self::Observations(file) => {
                let whole = |row: &Row<Reading>| row.value.position.iter().all(Option::is_some);
                let partial = file.rows.iter().position(|row| !whole(row));
                let cause = "the row does not hold x, y and z, and nothing else can be used here";
                Err(file.fault(partial.unwrap_or_default(), cause).with_remedy(
                    "delta-cal calibrate takes heights, distances and single coordinates",
                ))
            }
        }
    }
}

impl From<SamplesFile> for ObservationsFile {
    /// The rows in memory.
    fn from(samples: SamplesFile) -> Self {
        let rows = samples.rows.into_iter().map(|Row { line, value }| Row {
            line,
            value: Reading {
                joints: value.joints,
                position: value.position.data.0[0].map(Some),
                height: None,
                distance: None,
            },
        });
        Self {
            name: samples.name,
            rows: rows.collect(),
            planes: Vec::new(),
            points: Vec::new(),
        }
    }
}

/// Whether a header names x, y and z, or nothing else in their place.
pub(super) fn has_positions_alone(table: &Table<'_>) -> bool {
    let others = [
        Quantity::Height,
        Quantity::Plane,
        Quantity::Distance,
        Quantity::Point,
        Quantity::ToJoint1,
        Quantity::ToJoint2,
        Quantity::ToJoint3,
        Quantity::ToTravel1,
        Quantity::ToTravel2,
        Quantity::ToTravel3,
    ];
    let coordinates = Quantity::COORDINATES.iter();
    let some = coordinates.filter(|own| table.has_any(&[**own])).count();
    !table.has_any(&others) && !(1..3).contains(&some)
}

fn observations(
    table: &Table<'_>,
    input: &InputText,
    limits: &JointLimits<f64>,
) -> Result<ObservationsFile, InputError> {
    table.require(&Quantity::joints(limits.drive()))?;
    table.require_units()?;
    let rows = table.rows(|row| named(row, limits))?;
    Ok(with_indices(input, rows))
}

/// Planes and points by their indices.
pub(super) fn with_indices(input: &InputText, named: Vec<Row<Named>>) -> ObservationsFile {
    let mut file = ObservationsFile {
        name: input.name().to_owned(),
        rows: Vec::with_capacity(named.len()),
        planes: Vec::new(),
        points: Vec::new(),
    };
    for Row { line, value } in named {
        let height = value
            .height
            .map(|(plane, height)| (index_of(&mut file.planes, plane), height));
        let distance = value.distance.map(|(from, distance)| {
            let from = match from {
                NamedFrom::Point(point) => ReadingFrom::Point(index_of(&mut file.points, point)),
                NamedFrom::Pose(joints) => ReadingFrom::Pose(joints),
            };
            (from, distance)
        });
        file.rows.push(Row {
            line,
            value: Reading {
                joints: value.joints,
                position: value.position,
                height,
                distance,
            },
        });
    }
    file
}

/// A row whose plane and point still have names.
pub(super) struct Named {
    pub(super) joints: [f64; 3],
    pub(super) position: [Option<f64>; 3],
    pub(super) height: Option<(String, f64)>,
    pub(super) distance: Option<(NamedFrom, f64)>,
}

pub(super) enum NamedFrom {
    Point(String),
    Pose([f64; 3]),
}

pub(super) fn named(row: &TableRow<'_>, limits: &JointLimits<f64>) -> Result<Named, InputError> {
    let mut position = [None; 3];
    for (coordinate, quantity) in position.iter_mut().zip(Quantity::COORDINATES) {
        *coordinate = row.optional(quantity)?;
    }
    let height = row.optional(Quantity::Height)?;
    let plane = row.text(Quantity::Plane);
    if height.is_none() && plane.is_some() {
        let cause = "the row names a plane and has no height above it";
        return Err(row
            .fault_of(Quantity::Height, cause)
            .with_remedy("fill in height_mm, or leave the cell of the plane empty"));
    }
    let height = height.map(|height| (plane.unwrap_or(ONLY_PLANE).to_owned(), height));
    let named = Named {
        joints: row.joints(limits)?,
        position,
        height,
        distance: distance(row, limits)?,
    };
    let nothing = named.position.iter().all(Option::is_none);
    if nothing && named.height.is_none() && named.distance.is_none() {
        return Err(row
            .fault_of_row("nothing was measured in this row")
            .with_remedy("fill in what was measured at these joint angles, or delete the row"));
    }
    Ok(named)
}

fn distance(
    row: &TableRow<'_>,
    limits: &JointLimits<f64>,
) -> Result<Option<(NamedFrom, f64)>, InputError> {
    const REMEDY: &str = "a distance begins either at a point, whose name stands in the column point, or at \
                          the pose of to_q1_deg,to_q2_deg,to_q3_deg";
    let distance = row.optional(Quantity::Distance)?;
    let point = row.text(Quantity::Point);
    let filled = Quantity::to_joints(limits.drive()).map(|joint| row.text(joint).is_some());
    let pose = filled.contains(&true);
    let Some(distance) = distance else {
        if point.is_some() || pose {
            let cause = "the row says where a distance begins and holds no distance";
            return Err(row.fault_of(Quantity::Distance, cause).with_remedy(
                "fill in distance_mm, or leave the cells of point and to_q1_deg… empty",
            ));
        }
        return Ok(None);
    };
    if !(distance > 0.0) {
        let cause = format!("a distance of {distance} mm is not above 0");
        return Err(row
            .fault_of(Quantity::Distance, cause)
            .with_remedy("check the number; a distance that was not measured has an empty cell"));
    }
    let from = match (point, pose) {
        (Some(_), true) => {
            let cause = "the distance begins both at a point and at a pose";
            return Err(row.fault_of(Quantity::Point, cause).with_remedy(REMEDY));
        }
        (None, false) => {
            let cause = "the distance begins nowhere";
            return Err(row.fault_of(Quantity::Distance, cause).with_remedy(REMEDY));
        }
        (Some(point), false) => NamedFrom::Point(point.to_owned()),
        (None, true) => {
            NamedFrom::Pose(row.joints_in(Quantity::to_joints(limits.drive()), limits)?)
        }
    };
    Ok(Some((from, distance)))
}

/// The place of a name in a list, to which it is added if it is new.
fn index_of(names: &mut Vec<String>, name: String) -> usize {
    if let Some(index) = names.iter().position(|known| *known == name) {
        return index;
    }
    names.push(name);
    names.len() - 1
}

impl Reading {
    /// How many numbers were measured.
    pub(crate) fn readings(&self) -> usize {
        self.position.iter().flatten().count()
            + usize::from(self.height.is_some())
            + usize::from(self.distance.is_some())
    }
}

impl ObservationsFile {
    /// How many numbers were measured in all rows.
    pub fn readings(&self) -> usize {
        self.rows.iter().map(|row| row.value.readings()).sum()
    }

    /// Whether a row holds x, y or z.
    pub fn coordinates(&self) -> bool {
        let mut rows = self.rows.iter();
        rows.any(|row| row.value.position.iter().any(Option::is_some))
    }

    /// A fault of the row at an index, in its line.
    pub fn fault(&self, index: usize, cause: impl Into<String>) -> InputError {
        let error = InputError::new(&self.name, cause);
        match self.rows.get(index) {
            Some(row) => error.at_line(row.line),
            None => error,
        }
    }

    /// Which of these names occurs in no row, and what names do, in words.
    pub(crate) fn unused(names: &[String], wanted: &str) -> Option<String> {
        if names.iter().any(|name| name == wanted) {
            return None;
        }
        Some(match names {
            [] => "no row names one".to_owned(),
            names => format!("the rows name {}", list(names)),
        })
    }
}
