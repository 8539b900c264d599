//! The samples file: joint angles and the readings taken there, one row per pose.

mod pairs;
mod table;

use super::columns::{Quantity, Unit};
use super::convention::Convention;
use super::input::{InputError, InputText};
pub use super::robot_file::Kind;
use super::robot_file::{ONLY_TARGET, RobotFile};
use crate::geometry::rotation;
use crate::halt;
use crate::text::list;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::Drive;
use delta_cal::{Noise, Sample};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
pub use pairs::Joined;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::hash::Hash;
use table::{Table, TableRow};

/// Readings per row: x, y, z, height, distance.
pub const READINGS: usize = 5;

/// The plane's name if the file names none.
const ONLY_PLANE: &str = "plane";
/// Blank coordinates are intentional if at least this many rows, and one in `ONE_IN`, have the same cells blank.
const LEAST_GROUP: usize = 3;
const ONE_IN: usize = 10;

const STARTS: &str = "a distance begins either at a point, named in the column point, or at the pose of \
                      to_q1_deg,to_q2_deg,to_q3_deg";

/// One row of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<T> {
    /// Its line in the file, counted from 1.
    pub line: u64,
    /// Its content.
    pub value: T,
}

/// The content of a samples file: at least one row, with at least one reading in each.
///
/// The columns are `q1_deg, q2_deg, q3_deg` (with linear drives `s1_mm, s2_mm, s3_mm`) and any of `x_mm, y_mm, z_mm`,
/// `rx_deg, ry_deg, rz_deg`, `target`, `height_mm, plane`, `distance_mm, point` or `distance_mm, to_q1_deg, to_q2_deg, to_q3_deg`, also in other units, in
/// any order, `name`, `repeat`, `approach` and `use`, separated by commas, semicolons, tabs or spaces. Columns whose name starts with `_` are ignored, and so
/// are lines that start with `#`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Readings {
    /// Name of the file, for messages.
    pub name: String,
    /// The rows: joint angles in radians, lengths in millimetres. Rows with identical numbers appear once.
    pub rows: Vec<Row<Reading>>,
    /// Names of the planes, in order of first use.
    pub planes: Vec<String>,
    /// Names of the points, in order of first use.
    pub points: Vec<String>,
    /// Names of the targets, in order of first use.
    pub targets: Vec<String>,
    /// What rows say beside their numbers, by line.
    pub labels: BTreeMap<u64, Label>,
    /// By line, if rows between these are left out: the part of the file before it, and the direction of each joint's last
    /// move, 0 before its first.
    pub(crate) order: BTreeMap<u64, (f64, [f64; 3])>,
    /// Datum points that the instrument measured: their names, and where, mm.
    pub datum: Vec<(String, Vector3<f64>)>,
    /// Lines of rows with the same numbers as an earlier row.
    pub copies: Vec<u64>,
    /// How two files were joined, if joints and readings come from two.
    pub joined: Option<Joined>,
    /// Whether the header states all three joint angles in degrees.
    pub in_degrees: bool,
    /// The unit of all three coordinates in the header, if they have the same.
    pub positions_in: Option<Unit>,
}

/// What a row says beside its numbers: the columns `name` (or `point` without distances), `repeat` and `approach`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Label {
    /// The name of the point.
    pub name: Option<String>,
    /// Which repetition of the pose it is.
    pub repeat: Option<String>,
    /// From where the pose was approached.
    pub approach: Option<String>,
}

impl Label {
    /// With what another file says where this one says nothing.
    fn or(self, other: Self) -> Self {
        Self {
            name: self.name.or(other.name),
            repeat: self.repeat.or(other.repeat),
            approach: self.approach.or(other.approach),
        }
    }
}

/// The readings at one pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// Joint angles, radians; travels of linear drives, mm.
    pub joints: [f64; 3],
    /// The measured coordinates, mm.
    pub position: [Option<f64>; 3],
    /// Index of the plane, and height above it, mm.
    pub height: Option<(usize, f64)>,
    /// The start of a distance, and the distance, mm.
    pub distance: Option<(ReadingFrom, f64)>,
    /// Standard uncertainty of the readings, mm, if the row states it.
    pub sigma: Option<f64>,
    /// Covariance of the coordinates, in squares of `sigma`, if they are not independent and alike.
    pub shape: Option<Matrix3<f64>>,
    /// Index of the target that was measured.
    pub target: usize,
    /// Rotation vector of the target's frame against that of the coordinates, radians.
    pub turn: Option<Vector3<f64>>,
}

/// Where a distance starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReadingFrom {
    /// The point with this index.
    Point(usize),
    /// The platform's position at these joint angles, radians.
    Pose([f64; 3]),
}

impl Reading {
    /// No readings yet, at these joint angles (radians) or travels (mm).
    pub fn at(joints: [f64; 3]) -> Self {
        Self {
            joints,
            ..Self::default()
        }
    }

    /// A complete position.
    pub fn of(sample: &Sample<f64>) -> Self {
        Self {
            position: sample.position.data.0[0].map(Some),
            ..Self::at(sample.joints)
        }
    }

    /// Changes its joints, and those of the pose from which its distance starts.
    pub(crate) fn each_pose(&mut self, change: impl Fn([f64; 3]) -> [f64; 3]) {
        self.joints = change(self.joints);
        if let Some((ReadingFrom::Pose(joints), _)) = &mut self.distance {
            *joints = change(*joints);
        }
    }

    /// Its joints, and those of the pose from which its distance starts.
    pub(crate) const fn poses(&self) -> [Option<[f64; 3]>; 2] {
        match self.distance {
            Some((ReadingFrom::Pose(joints), _)) => [Some(self.joints), Some(joints)],
            _ => [Some(self.joints), None],
        }
    }

    /// x, y, z, height, distance; `None` where nothing was read.
    pub fn read(&self) -> [Option<f64>; READINGS] {
        let [x, y, z] = self.position;
        let height = self.height.map(|(_, height)| height);
        [x, y, z, height, self.distance.map(|(_, distance)| distance)]
    }

    /// What tells rows apart: every bit but those of σ.
    pub(crate) fn bits(&self) -> impl Hash + Ord + use<> {
        let (point, from) = match self.distance {
            Some((ReadingFrom::Point(point), _)) => (Some(point), [None; 3]),
            Some((ReadingFrom::Pose(joints), _)) => (None, joints.map(Some)),
            None => (None, [None; 3]),
        };
        let number = |own: Option<f64>| own.map_or(u64::MAX, f64::to_bits);
        let place = |own: Option<usize>| own.unwrap_or(usize::MAX);
        let plane = self.height.map(|(plane, _)| plane);
        (
            self.joints.map(f64::to_bits),
            self.read().map(number),
            from.map(number),
            [0, 1, 2].map(|axis| number(self.turn.map(|own| own[axis]))),
            [plane, point, Some(self.target)].map(place),
        )
    }

    /// The kind of the first reading.
    pub fn kind(&self) -> Option<Kind> {
        let place = self.read().iter().position(Option::is_some)?;
        Some(Kind::of_place(place))
    }

    /// The number of readings.
    pub fn readings(&self) -> usize {
        self.read().iter().flatten().count()
    }

    /// The sample, if x, y and z were all measured.
    pub fn sample(&self) -> Option<Sample<f64>> {
        let [Some(x), Some(y), Some(z)] = self.position else {
            return None;
        };
        Some(Sample {
            joints: self.joints,
            position: Vector3::new(x, y, z),
        })
    }
}

impl Readings {
    /// Reads a robot's samples file in that robot's convention.
    ///
    /// # Errors
    /// The first fault: a missing, unknown or duplicate column, a row of the wrong length, a number that is invalid or
    /// not finite, a joint angle more than 1° outside the limits, no rows; a row without a reading, a coordinate that
    /// is blank, not -, in only a few rows; a distance that is not above 0, or starts nowhere, or starts both at a point and at
    /// a pose; a plane or point without a reading; all rows identical.
    pub fn read(input: &InputText, robot: &RobotFile) -> Result<Self, InputError> {
        if let Some(joints) = input.beside() {
            return Self::read_pair(joints, input, robot);
        }
        let table = Table::parse(input, &robot.convention, false)?;
        table.require_joints(Quantity::joints(robot.limits.drive()))?;
        table.require_readings()?;
        let mut file = Self::of_name(input.name());
        let (labels, _) = table.labels()?;
        let datum = |line: u64| {
            let name = labels.get(&line)?.name.clone();
            name.filter(|own| robot.instruments.is_datum(own))
        };
        let mut rows = table.rows(|row| {
            let joints = match datum(row.line) {
                Some(_) => [0.0; 3],
                None => row.joints(robot)?,
            };
            file.reading(row, joints, robot)
        })?;
        rows.retain(|row| row.value.readings() > 0);
        rows = file.without_datum(rows, |_, line| datum(line));
        file.with_rows(&table, rows)
    }

    /// Reads complete positions in this convention, without checking joint limits.
    pub(crate) fn read_any(input: &InputText, convention: &Convention) -> Result<Self, InputError> {
        let joints = Quantity::joints(convention.drive);
        let table = Table::parse(input, convention, false)?;
        table.require(&joints)?;
        table.require(&Quantity::COORDINATES)?;
        let rows = table.rows(|row| {
            Ok(Reading {
                position: row.numbers(Quantity::COORDINATES)?.map(Some),
                ..Reading::at(row.numbers(joints)?)
            })
        })?;
        Self::of_name(input.name()).with_rows(&table, rows)
    }

    fn with_rows(self, table: &Table<'_>, mut rows: Vec<Row<Reading>>) -> Result<Self, InputError> {
        let (labels, left_out) = table.labels()?;
        rows.retain(|row| !left_out.contains(&row.line));
        if rows.is_empty() {
            let error = InputError::new(self.name, "nothing was measured in any row");
            return Err(error.with_remedy("fill in what was measured"));
        }
        check_blanks(table, &rows)?;
        let count = rows.len();
        let mut file = Self {
            rows,
            labels,
            in_degrees: table.unit_of(&Quantity::joints(Drive::Rotary)) == Some(Unit::Degree),
            positions_in: table.unit_of(&Quantity::COORDINATES),
            ..self
        };
        file.keep_one_of_each();
        if let ([row], true) = (file.rows.as_slice(), count > 1) {
            let cause = format!("all {count} rows are equal to the last digit: one measurement");
            return Err(InputError::new(&file.name, cause)
                .at_line(row.line)
                .with_remedy("measure different poses, and write each into a row of its own"));
        }
        Ok(file)
    }

    /// An empty file, in millimetres and degrees.
    pub fn of_name(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            in_degrees: true,
            positions_in: Some(Unit::Millimetre),
            ..Self::default()
        }
    }

    /// A file of these rows, starting at line 2.
    pub(crate) fn of_readings(rows: &[Reading]) -> Self {
        let rows = (2..).zip(rows).map(|(line, value)| Row {
            line,
            value: *value,
        });
        Self {
            rows: rows.collect(),
            ..Self::of_name("")
        }
    }

    /// A file of complete positions, starting at line 2.
    pub fn of_samples(name: impl Into<String>, samples: &[Sample<f64>]) -> Self {
        let rows: Vec<_> = samples.iter().map(Reading::of).collect();
        Self {
            name: name.into(),
            ..Self::of_readings(&rows)
        }
    }

    /// Keeps the first of the rows with identical numbers, and lists the lines of the others.
    fn keep_one_of_each(&mut self) {
        let mut seen = HashSet::new();
        let copies = &mut self.copies;
        self.rows.retain(|row| {
            halt::check();
            let new = seen.insert(row.value.bits());
            if !new {
                copies.push(row.line);
            }
            new
        });
    }

    /// Takes the positions of datum points, by index and line, from rows; the mean if there are several of a name.
    fn without_datum(
        &mut self,
        rows: Vec<Row<Reading>>,
        name: impl Fn(usize, u64) -> Option<String>,
    ) -> Vec<Row<Reading>> {
        let mut found: BTreeMap<String, Vec<Vector3<f64>>> = BTreeMap::new();
        let mut others = Vec::new();
        for (index, row) in rows.into_iter().enumerate() {
            match (name(index, row.line), row.value.sample()) {
                (Some(name), Some(own)) => found.entry(name).or_default().push(own.position),
                (Some(_), None) => {}
                (None, _) => others.push(row),
            }
        }
        self.datum = found
            .into_iter()
            .map(|(name, all)| (name, all.iter().sum::<Vector3<f64>>() / all.len() as f64))
            .collect();
        // Points of the machine have no target on the platform.
        let named = std::mem::take(&mut self.targets);
        for row in &mut others {
            let name = named
                .get(row.value.target)
                .map_or(ONLY_TARGET, String::as_str);
            row.value.target = index_of(&mut self.targets, name);
        }
        others
    }

    /// A datum point of the robot file that these measurements should hold and do not.
    pub(crate) fn missing_datum(&self, robot: &RobotFile) -> Option<InputError> {
        let mut wanted = robot.instruments.datum_measured.iter();
        let known = |name: &String| self.datum.iter().any(|(own, _)| own == name);
        let (name, point) = wanted.find(|(_, point)| !known(point))?;
        let cause = format!("no row of {} is named {point}", self.name);
        let fault = InputError::new(&robot.name, cause).at_key(format!("[datum.{name}]"));
        Some(
            fault.with_remedy(
                "measure the point with the others, or state sensor_mm in place of point",
            ),
        )
    }

    /// The name of the row in a line, if the file has names.
    pub fn name_of(&self, line: u64) -> Option<&str> {
        self.labels.get(&line)?.name.as_deref()
    }

    /// The rows with x, y and z.
    pub fn samples(&self) -> impl Iterator<Item = Row<Sample<f64>>> + '_ {
        self.rows.iter().filter_map(|row| {
            Some(Row {
                line: row.line,
                value: row.value.sample()?,
            })
        })
    }

    /// Whether every row consists of x, y and z alone.
    pub fn is_complete(&self) -> bool {
        let mut rows = self.rows.iter();
        rows.all(|Row { value, .. }| {
            value.sample().is_some() && value.height.is_none() && value.distance.is_none()
        })
    }

    /// The σ, mm, that corresponds to the mean weight of all rows of a kind that state one; `None` if no row does.
    pub(crate) fn stated_sigma(&self, kind: Kind) -> Option<f64> {
        let of_kind = self
            .rows
            .iter()
            .filter(|row| row.value.kind() == Some(kind));
        let weights = of_kind.filter_map(|row| Some(1.0 / row.value.sigma?.powi(2)));
        let (sum, count) = weights.fold((0.0, 0.0), |(sum, count), own| (sum + own, count + 1.0));
        (count > 0.0).then(|| (count / sum).sqrt())
    }

    /// The kind of all readings; `None` if there are several.
    pub(crate) fn only_kind(&self) -> Option<Kind> {
        let mut kinds = Kind::ALL.into_iter().filter(|kind| self.holds(*kind));
        kinds.next().filter(|_| kinds.next().is_none())
    }

    /// Whether a row has a reading of this kind.
    pub fn holds(&self, kind: Kind) -> bool {
        let mut rows = self.rows.iter();
        rows.any(|row| {
            let mut read = row.value.read().into_iter().enumerate();
            read.any(|(place, own)| own.is_some() && Kind::of_place(place) == kind)
        })
    }

    /// The number of readings in all rows.
    pub fn readings(&self) -> usize {
        self.rows.iter().map(|row| row.value.readings()).sum()
    }

    /// The number of rows whose joint angles occur in no earlier row.
    pub fn distinct_poses(&self) -> usize {
        let bits = |row: &Row<Reading>| row.value.joints.map(f64::to_bits);
        self.rows.iter().map(bits).collect::<BTreeSet<_>>().len()
    }

    /// Transforms every complete position to another frame. Coordinates of incomplete ones have none there.
    #[must_use]
    pub(crate) fn turned(&self, by: &RigidTransform<f64>) -> Self {
        let mut turned = self.clone();
        for row in &mut turned.rows {
            let sample = row.value.sample();
            let turned = |own: Sample<f64>| by.apply(&own.position).data.0[0].map(Some);
            row.value.position = sample.map_or([None; 3], turned);
            let turn = row.value.turn.map(UnitQuaternion::new);
            row.value.turn = turn.map(|own| (rotation(by) * own).scaled_axis());
            let shape = row.value.shape;
            row.value.shape = shape.map(|own| by.rotation * own * by.rotation.transpose());
        }
        turned
    }

    /// Shifts every measured coordinate, mm.
    #[must_use]
    pub(crate) fn moved(mut self, by: &Vector3<f64>) -> Self {
        for row in &mut self.rows {
            for (coordinate, by) in row.value.position.iter_mut().zip(by.iter()) {
                *coordinate = coordinate.map(|value| value + by);
            }
        }
        self
    }

    /// Widens the σ of the rows that state one.
    #[must_use]
    pub(crate) fn with_sigma_times(mut self, factor: f64) -> Self {
        for row in &mut self.rows {
            row.value.sigma = row.value.sigma.map(|own| own * factor);
        }
        self
    }

    /// The robot with the datum points that were measured here, and the noise that rows state in place of its own; the σ of
    /// each row sets its weight relative to it.
    pub(crate) fn noise_into(&self, robot: &RobotFile) -> RobotFile {
        let [position, height, distance] = Kind::ALL.map(|kind| self.stated_sigma(kind));
        let mut own = robot.clone();
        let facts = &mut own.instruments;
        for (name, point) in &facts.datum_measured {
            let seen = self.datum.iter().find(|(own, _)| own == point);
            let datum = facts.datum.iter_mut().find(|own| own.name == *name);
            if let (Some((_, seen)), Some(datum)) = (seen, datum) {
                datum.seen = *seen;
            }
        }
        let joint = robot.joint_noise().unwrap_or_default();
        let noise = position.and_then(|sigma| Noise::new(sigma, joint).ok());
        own.noise = noise.or(robot.noise);
        facts.height_noise = height.or(facts.height_noise);
        facts.distance_noise = distance.or(facts.distance_noise);
        own
    }

    /// A fault of the row at an index, with its line.
    pub fn fault(&self, index: usize, cause: impl Into<String>) -> InputError {
        let error = InputError::new(&self.name, cause)
            .with_remedy("check the row and the units in the header (_mm or _m, _deg or _rad)");
        match self.rows.get(index) {
            Some(row) => error.at_line(row.line),
            None => error,
        }
    }

    /// If no row uses the wanted name, describes the names that rows use.
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

/// Refuses coordinates that are blank in only a few rows.
fn check_blanks(table: &Table<'_>, rows: &[Row<Reading>]) -> Result<(), InputError> {
    let has = Quantity::COORDINATES.map(|quantity| table.has_any(&[quantity]));
    let [x, y, z] = Quantity::COORDINATES.map(|quantity| table.unmeasured(quantity));
    let unmeasured = [x?, y?, z?];
    let mut groups: BTreeMap<[bool; 3], (usize, u64)> = BTreeMap::new();
    for row in rows {
        let blank = [0, 1, 2].map(|axis| {
            let missing = has[axis] && row.value.position[axis].is_none();
            missing && !unmeasured[axis].contains(&row.line)
        });
        if blank.contains(&true) && blank != has {
            groups.entry(blank).or_insert((0, row.line)).0 += 1;
        }
    }
    let least = LEAST_GROUP.max(rows.len() / ONE_IN);
    let few = groups.iter().filter(|(_, (count, _))| *count < least);
    let Some((blank, (count, line))) = few.min_by_key(|(_, (_, line))| *line) else {
        return Ok(());
    };
    let axis = blank.iter().position(|own| *own).unwrap_or_default();
    let column = table.name_of(Quantity::COORDINATES[axis]);
    let cause = format!("the cell is blank in {count} of {} rows", rows.len());
    let remedy = format!(
        "fill it in, or write - if it was not measured; blanks count as not measured if at least {LEAST_GROUP} rows, and one \
         in {ONE_IN}, have the same"
    );
    Err(InputError::new(table.input.name(), cause)
        .at_line(*line)
        .at_column(column)
        .with_remedy(remedy))
}

/// The index of a name in a list, to which new names are added.
fn index_of(names: &mut Vec<String>, name: &str) -> usize {
    if let Some(index) = names.iter().position(|known| known == name) {
        return index;
    }
    names.push(name.to_owned());
    names.len() - 1
}

impl Readings {
    /// The readings of a row with these joints.
    fn reading(
        &mut self,
        row: &TableRow<'_>,
        joints: [f64; 3],
        robot: &RobotFile,
    ) -> Result<Reading, InputError> {
        let mut position = [None; 3];
        for (coordinate, quantity) in position.iter_mut().zip(Quantity::COORDINATES) {
            *coordinate = row.optional(quantity)?;
        }
        let plane = row.text(Quantity::Plane);
        let height = row.optional(Quantity::Height)?;
        if height.is_none() && plane.is_some() {
            let cause = "the row names a plane and has no height above it";
            return Err(row
                .fault_of(Quantity::Height, cause)
                .with_remedy("fill in height_mm, or leave the cell of the plane empty"));
        }
        let plane = plane.as_deref().unwrap_or(ONLY_PLANE);
        let reading = Reading {
            joints,
            position,
            height: height.map(|height| (index_of(&mut self.planes, plane), height)),
            distance: self.distance(row, robot)?,
            sigma: sigma(row)?,
            shape: None,
            target: self.target(row),
            turn: row.turn(robot)?,
        };
        if reading.readings() == 0 && !row.is_unmeasured() {
            return Err(row
                .fault_of_row("nothing was measured in this row")
                .with_remedy(
                    "fill in what was measured at these joint angles, name the file of the measurements too, or delete the row",
                ));
        }
        Ok(reading)
    }

    fn target(&mut self, row: &TableRow<'_>) -> usize {
        index_of(
            &mut self.targets,
            row.text(Quantity::Target).as_deref().unwrap_or(ONLY_TARGET),
        )
    }

    fn distance(
        &mut self,
        row: &TableRow<'_>,
        robot: &RobotFile,
    ) -> Result<Option<(ReadingFrom, f64)>, InputError> {
        let distance = row.optional(Quantity::Distance)?;
        let (cause, remedy) = match (self.start(row, robot)?, distance) {
            (None, None) => return Ok(None),
            (Some(from), Some(distance)) if distance > 0.0 => return Ok(Some((from, distance))),
            (Some(_), None) => (
                "the row has no distance_mm for its point or second pose".to_owned(),
                "fill in distance_mm, or leave the cells of point and to_q1_deg… empty",
            ),
            (_, Some(distance)) if !(distance > 0.0) => (
                format!("a distance of {distance} mm is not above 0"),
                "check the number; a distance that was not measured has an empty cell",
            ),
            _ => ("the distance has no start".to_owned(), STARTS),
        };
        Err(row.fault_of(Quantity::Distance, cause).with_remedy(remedy))
    }

    /// Where a row's distance begins, if it says so.
    fn start(
        &mut self,
        row: &TableRow<'_>,
        robot: &RobotFile,
    ) -> Result<Option<ReadingFrom>, InputError> {
        let to_joints = Quantity::to_joints(robot.limits.drive());
        let pose = to_joints.iter().any(|joint| row.holds(*joint));
        match (row.text(Quantity::Point), pose) {
            (None, false) => Ok(None),
            (Some(point), false) => {
                let point = index_of(&mut self.points, &point);
                Ok(Some(ReadingFrom::Point(point)))
            }
            (None, true) => {
                let joints = row.joints_in(to_joints, robot)?;
                Ok(Some(ReadingFrom::Pose(joints)))
            }
            (Some(_), true) => {
                let cause = "the distance begins both at a point and at a pose";
                Err(row.fault_of(Quantity::Point, cause).with_remedy(STARTS))
            }
        }
    }

    /// The kind of reading that an unmeasured row awaits: a distance if it states a start, a height if it names a
    /// plane, otherwise what the header has columns for.
    fn awaited(
        &mut self,
        table: &Table<'_>,
        row: &TableRow<'_>,
        robot: &RobotFile,
    ) -> Result<Reading, InputError> {
        let mut own = Reading {
            target: self.target(row),
            sigma: sigma(row)?,
            ..Reading::at(row.joints(robot)?)
        };
        if let Some(from) = self.start(row, robot)? {
            own.distance = Some((from, 1.0));
        } else if let Some(plane) = row.text(Quantity::Plane) {
            own.height = Some((index_of(&mut self.planes, &plane), 0.0));
        } else if table.has_any(&Quantity::COORDINATES) {
            let there = robot.robot.forward(&own.joints).unwrap_or_default();
            for (axis, quantity) in Quantity::COORDINATES.into_iter().enumerate() {
                own.position[axis] = table.has_any(&[quantity]).then(|| there[axis]);
            }
            own.turn = table.has_any(&Quantity::TURNS).then(Vector3::zeros);
        } else if table.has_any(&[Quantity::Height]) {
            own.height = Some((index_of(&mut self.planes, ONLY_PLANE), 0.0));
        } else {
            return Err(row
                .fault_of_row("the row does not say what is to be measured")
                .with_remedy("name a point, a plane or a second pose, or delete the row"));
        }
        Ok(own)
    }
}

/// Standard uncertainty of a row, mm.
fn sigma(row: &TableRow<'_>) -> Result<Option<f64>, InputError> {
    for (quantity, factor) in [(Quantity::Sigma, 1.0), (Quantity::Expanded, 0.5)] {
        match row.optional(quantity)? {
            Some(own) if own > 0.0 => return Ok(Some(factor * own)),
            Some(_) => {
                return Err(row
                    .fault_of(quantity, "an uncertainty must be above 0")
                    .with_remedy("leave the cell empty if it is unknown"));
            }
            None => {}
        }
    }
    Ok(None)
}

/// Reads the joint angles (radians) of a file; all other columns are ignored.
///
/// # Errors
/// Same as [`Readings::read`].
pub fn read_joints(input: &InputText, robot: &RobotFile) -> Result<Vec<Row<[f64; 3]>>, InputError> {
    let table = Table::parse(input, &robot.convention, true)?;
    table.check()?;
    table.require(&Quantity::joints(robot.limits.drive()))?;
    table.rows(|row| row.joints(robot))
}

/// Reads the positions (millimetres) of a file; all other columns are ignored.
///
/// # Errors
/// Same as [`Readings::read`].
pub fn read_positions(
    input: &InputText,
    convention: &Convention,
) -> Result<Vec<Row<Vector3<f64>>>, InputError> {
    let table = Table::parse(input, convention, true)?;
    table.check()?;
    table.require(&Quantity::COORDINATES)?;
    table.rows(|row| row.numbers(Quantity::COORDINATES).map(Vector3::from))
}

/// A samples file in which some or all rows may still be unmeasured.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// All rows. Unmeasured ones hold placeholders: height 0, the robot's own coordinates, distance 1 mm.
    pub readings: Readings,
    /// The lines of unmeasured rows.
    pub unmeasured: Vec<u64>,
}

impl Planned {
    /// Reads the samples file of a robot.
    ///
    /// # Errors
    /// Same as [`Readings::read`], except that unmeasured rows are accepted.
    pub fn read(input: &InputText, robot: &RobotFile) -> Result<Self, InputError> {
        let table = Table::parse(input, &robot.convention, false)?;
        table.require(&Quantity::joints(robot.limits.drive()))?;
        table.require_units()?;
        let mut file = Readings::of_name(input.name());
        let mut unmeasured = Vec::new();
        let rows = table.rows(|row| {
            let mut readings = Quantity::READINGS.into_iter();
            if readings.any(|own| row.holds(own)) {
                return file.reading(row, row.joints(robot)?, robot);
            }
            unmeasured.push(row.line);
            file.awaited(&table, row, robot)
        })?;
        Ok(Self {
            readings: Readings { rows, ..file },
            unmeasured,
        })
    }

    /// Whether no row has been measured yet.
    pub fn is_unmeasured(&self) -> bool {
        self.unmeasured.len() == self.readings.rows.len()
    }
}
