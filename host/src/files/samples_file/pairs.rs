//! Joints in one file and readings in another, as a controller and an instrument write them.

use super::table::Table;
use super::{Readings, Row};
use crate::files::columns::{Quantity, Unit};
use crate::files::input::{InputError, InputText};
use crate::files::robot_file::RobotFile;
use crate::text::count;
use delta_cal::robot::Drive;
use jiff::civil::{DateTime, Time, date};
use serde::Serialize;
use std::collections::{HashMap, HashSet};

/// Times match if they differ by at most this fraction of the median interval of the denser file.
const NEAR: f64 = 0.5;

/// How two files were joined.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Joined {
    /// The file with the joints.
    pub joints_file: String,
    /// The common column; `None` if rows were joined by order.
    pub by: Option<String>,
    /// Number of rows of joints without a measurement.
    pub unused: usize,
}

/// A column common to both files.
struct Key {
    name: String,
    joints: Vec<String>,
    measured: Vec<String>,
}

impl Readings {
    /// Reads joints from one file and readings from another, given in either order. Rows are matched by a common column
    /// (equal names or numbers, nearest times) or, without one, by order.
    ///
    /// # Errors
    /// Same as [`read`](Self::read); also a measured row without joints, a name shared by two rows of joints, or,
    /// without a common column, different numbers of rows.
    pub fn read_pair(
        one: &InputText,
        other: &InputText,
        robot: &RobotFile,
    ) -> Result<Self, InputError> {
        let joints_of = Quantity::joints(robot.limits.drive());
        let first = Table::parse(one, &robot.convention, true)?;
        let second = Table::parse(other, &robot.convention, true)?;
        let mut mapped = one.columns().0.iter().map(|own| &own.column);
        if let Some(column) = mapped.find(|own| !(first.has_name(own) || second.has_name(own))) {
            let cause = "neither file has this column, which --columns names";
            return Err(InputError::new(other.name(), cause).at_column(column));
        }
        let (joints, measured) = if first.has_any(&joints_of) || !second.has_any(&joints_of) {
            (first, second)
        } else {
            (second, first)
        };
        joints.require(&joints_of)?;
        measured.require_readings()?;
        let poses = joints.rows(|row| row.joints(robot))?;
        let mut file = Self::of_name(measured.input.name());
        let mut rows = measured.rows(|row| file.reading(row, [0.0; 3], robot))?;
        let keys = keys(&joints, &measured)?;
        let by = chosen(&keys);
        let pairs = match by {
            Some(key) if key.is_time() => by_time(key),
            Some(key) => by_name(key, &poses, &joints)?,
            None => by_order(&poses, &rows, &joints, &measured, &keys)?,
        };
        let mut used = vec![false; poses.len()];
        for (row, pair) in rows.iter_mut().zip(pairs) {
            let Some((pose, used)) =
                pair.and_then(|own| Some((poses.get(own)?, used.get_mut(own)?)))
            else {
                let of = by.map_or("", |key| key.name.as_str());
                let cause = format!("no row of {} has this {of}", joints.input.name());
                return Err(InputError::new(measured.input.name(), cause)
                    .at_line(row.line)
                    .with_remedy("add the joints of this pose, or delete the row"));
            };
            *used = true;
            row.value.joints = pose.value;
        }
        let joined = Joined {
            joints_file: joints.input.name().to_owned(),
            by: by.map(|key| key.name.clone()),
            unused: used.iter().filter(|used| !**used).count(),
        };
        Ok(Self {
            in_degrees: joints.unit_of(&Quantity::joints(Drive::Rotary)) == Some(Unit::Degree),
            joined: Some(joined),
            ..file.with_rows(&measured, rows)?
        })
    }
}

/// Columns common to both files, other than those read as joints or readings.
fn keys(joints: &Table<'_>, measured: &Table<'_>) -> Result<Vec<Key>, InputError> {
    let mut keys = Vec::new();
    for name in joints.unread() {
        let same = |own: &&String| own.trim().eq_ignore_ascii_case(name.trim());
        if let Some(other) = measured.unread().find(same) {
            keys.push(Key {
                name: name.clone(),
                joints: joints.cells(name)?,
                measured: measured.cells(other)?,
            });
        }
    }
    Ok(keys)
}

/// The name or number column that matches all rows, else a time column, else the name column with most matches.
fn chosen(keys: &[Key]) -> Option<&Key> {
    let found = |key: &Key| {
        let known: HashSet<String> = key.joints.iter().map(|own| comparable(own)).collect();
        let own = key.measured.iter();
        own.filter(|own| known.contains(&comparable(own))).count()
    };
    let complete = |key: &&Key| !key.is_time() && found(key) == key.measured.len();
    let all = keys.iter().find(complete);
    let time = || keys.iter().find(|key| key.is_time());
    let most = || {
        let some = keys.iter().filter(|key| found(key) > 0);
        some.max_by_key(|key| found(key))
    };
    all.or_else(time).or_else(most)
}

/// Normalises numbers; names stay as they are.
fn comparable(cell: &str) -> String {
    let cell = cell.trim();
    cell.replace(',', ".")
        .parse::<f64>()
        .map_or_else(|_| cell.to_owned(), |number| number.to_string())
}

impl Key {
    /// Whether no cell is a number.
    fn is_names(&self) -> bool {
        let mut cells = self.joints.iter().chain(&self.measured);
        cells.all(|cell| comparable(cell).parse::<f64>().is_err())
    }

    /// Whether its name suggests a time and every cell is one.
    fn is_time(&self) -> bool {
        let name = self.name.to_lowercase();
        let named = name.contains("time")
            || name == "t"
            || name.starts_with("t ")
            || name.starts_with("t_");
        let mut cells = self.joints.iter().chain(&self.measured);
        named && cells.all(|cell| seconds(cell).is_some())
    }
}

/// Parses seconds, a time of day, or a date with time.
fn seconds(cell: &str) -> Option<f64> {
    let cell = cell.trim();
    if let Ok(number) = cell.replace(',', ".").parse() {
        return Some(number);
    }
    let since = match cell.parse::<Time>() {
        Ok(time) => time.duration_since(Time::midnight()),
        Err(_) => cell
            .parse::<DateTime>()
            .ok()?
            .duration_since(date(1970, 1, 1).at(0, 0, 0, 0)),
    };
    Some(since.as_secs_f64())
}

/// For each measured row, the row of joints with the same name.
fn by_name(
    key: &Key,
    poses: &[Row<[f64; 3]>],
    joints: &Table<'_>,
) -> Result<Vec<Option<usize>>, InputError> {
    let mut places: HashMap<String, usize> = HashMap::new();
    for (index, (cell, row)) in key.joints.iter().zip(poses).enumerate() {
        let before = places.insert(comparable(cell), index);
        if let Some(other) = before.and_then(|other| poses.get(other))
            && other.value.iter().ne(&row.value)
        {
            let line = other.line;
            let cause = format!("{cell} is also in line {line}, with other joints");
            return Err(InputError::new(joints.input.name(), cause)
                .at_line(row.line)
                .at_column(&key.name)
                .with_remedy("give each pose a name of its own"));
        }
    }
    let find = |cell: &String| places.get(&comparable(cell)).copied();
    Ok(key.measured.iter().map(find).collect())
}

/// For each measured row, the row of joints nearest in time, if it is near enough.
fn by_time(key: &Key) -> Vec<Option<usize>> {
    let of =
        |cells: &[String]| -> Vec<f64> { cells.iter().filter_map(|own| seconds(own)).collect() };
    let (joints, measured) = (of(&key.joints), of(&key.measured));
    let between = |times: &[f64]| {
        let mut sorted = times.to_vec();
        sorted.sort_by(f64::total_cmp);
        let mut steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.retain(|step| *step > 0.0);
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
    };
    let near = NEAR * between(&joints).min(between(&measured));
    let nearest = |time: &f64| {
        let apart = |other: &f64| (other - time).abs();
        let places = joints.iter().enumerate();
        let (index, other) = places.min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)))?;
        (apart(other) <= near).then_some(index)
    };
    measured.iter().map(nearest).collect()
}

/// Matches rows one to one; their numbers must be equal, and no column may say otherwise.
fn by_order<T>(
    poses: &[Row<[f64; 3]>],
    rows: &[Row<T>],
    joints: &Table<'_>,
    measured: &Table<'_>,
    keys: &[Key],
) -> Result<Vec<Option<usize>>, InputError> {
    if let Some(key) = keys.iter().find(|own| own.is_names()) {
        let cause = format!("no cell of it is in {}", joints.input.name());
        return Err(InputError::new(measured.input.name(), cause)
            .at_column(&key.name)
            .with_remedy(
                "write the same names in both files, or _ before the name of the column",
            ));
    }
    if poses.len() == rows.len() {
        return Ok((0..rows.len()).map(Some).collect());
    }
    let cause = format!(
        "{} and {} of {} cannot be joined by their order, and the files have no column in common",
        count(rows.len(), "row"),
        count(poses.len(), "row"),
        joints.input.name()
    );
    Err(InputError::new(measured.input.name(), cause).with_remedy(
        "give both a column of the same name that says which rows belong together: a point's name, a number or a time",
    ))
}
